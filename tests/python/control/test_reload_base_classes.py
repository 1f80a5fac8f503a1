"""A class of one library is the base of a class in another one: parts of two builds of the class never meet.

On threads and in virtual time. reload_tests/Other and reload_tests/WideShell are of libreload_other.so. Their
bases Loop and LoopShell are of libreload_tests.so.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from rebuilt_package import RebuiltPackage
from reload_world import WORLDS, World, make_world

from mauve_rt.control.requests import Step
from mauve_rt.errors import PluginError

REMEDY = "build the packages of both, and reload both in one request"
TAKE_OTHER = Step("replace_core", "loop", "reload_tests/Other")


@pytest.fixture(params=WORLDS)
def world(request: pytest.FixtureRequest, rebuilt: RebuiltPackage, tmp_path: Path) -> Iterator[World]:
    del rebuilt  # searched first
    yield from make_world(request.param, tmp_path, "[reload_tests/Other, reload_tests/WideShell]")


def test_the_new_build_of_a_base_class_is_refused_to_a_core_of_the_old_one(
    world: World, rebuilt: RebuiltPackage
) -> None:
    assert world.ask(TAKE_OTHER).success
    rebuilt.build("OTHER_METHODS", "STEP=2.0")  # another table of virtual functions
    refused = world.reload()
    assert not refused.success
    assert "the parts were compiled for two builds of the class reload_tests::Loop" in refused.message
    assert "core reload_tests/Other of libreload_other.so: the parts were" in refused.message
    assert "as fsm reload_tests/LoopFsm of libreload_tests@" in refused.message
    assert f"found generation 1; {REMEDY}" in refused.message
    assert {world.generation(name) for name in ("loop", "twin", "python")} == {1}, "nothing has changed"
    assert (world.part().core, world.part().state) == ("reload_tests/Other", "RUNNING")
    assert world.mean_step() == 1.0
    rebuilt.build_other("OTHER_METHODS", "STEP=3.0")
    together = world.reload()
    assert together.success, together.message
    assert world.generation() == world.generation("twin") > 1
    assert world.mean_step() == 3.0
    assert world.reload(back=True).success
    assert (world.generation(), world.mean_step()) == (1, 1.0)


def test_a_core_of_the_old_build_is_refused_beside_the_new_fsm(world: World, rebuilt: RebuiltPackage) -> None:
    rebuilt.build("OTHER_METHODS", "STEP=2.0")
    assert world.reload().success, "no component has a core of the other library"
    refused = world.ask(TAKE_OTHER)
    assert not refused.success
    assert REMEDY in refused.message
    assert world.mean_step() == 2.0
    rebuilt.build_other("OTHER_METHODS", "STEP=3.0")
    assert world.reload().success
    taken = world.ask(TAKE_OTHER)
    assert taken.success, taken.message
    assert world.mean_step() == 3.0


def test_a_derived_core_alone_is_reloaded(world: World, rebuilt: RebuiltPackage) -> None:
    assert world.ask(TAKE_OTHER).success
    rebuilt.build_other("STEP=3.0")
    outcome = world.reload()
    assert outcome.success, outcome.message
    assert world.generation() > world.generation("twin") == 1
    assert world.mean_step() == 3.0


def test_a_derived_core_is_not_reloaded_without_its_rebuilt_base(
    world: World, rebuilt: RebuiltPackage
) -> None:
    rebuilt.build("OTHER_METHODS")
    rebuilt.build_other("OTHER_METHODS")
    with world.runtime.loading() as loader:
        other = [source for source in loader.loaded_sources() if "libreload_other" in source.target]
        words = (
            "core 'reload_tests/Other' derives from the class of core 'reload_tests/Loop', whose library "
            f"was rebuilt, too: {rebuilt.library} is not reloaded"
        )
        with pytest.raises(PluginError, match=words) as refused:
            loader.reload(other, in_use=())
    assert "reload both in one request" in refused.value.remedy
    assert world.reload().success


def test_a_shell_of_the_old_build_of_its_base_class_is_refused(world: World, rebuilt: RebuiltPackage) -> None:
    wide = world.ask(Step("replace_shell", "loop", "reload_tests/WideShell"))
    assert wide.success, wide.message
    rebuilt.build("OTHER_SHELL")
    refused = world.reload()
    assert not refused.success
    assert "shell 'reload_tests/WideShell' was compiled for the shell as it was" in refused.message
    assert "build its package, too, then reload both" in refused.message
    assert [port.name for port in world.part().ports] == ["sum"]
    rebuilt.build_other("OTHER_SHELL")
    together = world.reload()
    assert together.success, together.message
    assert [port.name for port in world.part().ports] == ["bias", "sum"]


@pytest.mark.parametrize("kind", WORLDS)
@pytest.mark.parametrize("fallback", ["Loop", "Other"])
def test_a_fallback_core_is_of_the_build_of_the_new_parts(
    rebuilt: RebuiltPackage, tmp_path: Path, kind: str, fallback: str
) -> None:
    with contextmanager(make_world)(kind, tmp_path, f"installed, fallback: reload_tests/{fallback}") as world:
        rebuilt.build("OTHER_METHODS", "STEP=2.0")
        if fallback == "Other":
            refused = world.reload()
            assert not refused.success
            assert REMEDY in refused.message
            assert world.generation("twin") == 1, "nothing has changed"
            rebuilt.build_other("OTHER_METHODS", "STEP=2.0")
        outcome = world.reload()
        assert outcome.success, outcome.message
        assert world.mean_step() == 2.0
