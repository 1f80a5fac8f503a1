"""Rebuilt code is put in force by one transaction, or refused before anything changes.

On threads and in virtual time.
"""

import os
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from compiled_plugins import compile_plugin
from page_blocks import blocks
from pages import PAGES
from rebuilt_package import RebuiltPackage
from reload_world import WORLDS, World, make_world

from mauve_rt.api import Core
from mauve_rt.control.requests import NOT_MEASURED, Code, Outcome, Step
from mauve_rt.model.plugins import PluginLoader
from mauve_rt.parts.state_fields import StateCells


@pytest.fixture(params=WORLDS)
def world(request: pytest.FixtureRequest, rebuilt: RebuiltPackage, tmp_path: Path) -> Iterator[World]:
    del rebuilt  # searched first
    yield from make_world(request.param, tmp_path, "[reload_tests/PyLoop, reload_tests/Other]")


def _report(outcome: Outcome, step: str) -> tuple[str, ...]:
    """The state fields that a step has taken over."""
    return next(report.taken for report in outcome.report if report.step.startswith(step))


def test_rebuilt_code_is_put_in_force(world: World, rebuilt: RebuiltPackage) -> None:
    assert world.mean_step() == 1.0
    assert world.generation() == 1
    before, first = world.sum()
    rebuilt.build("STEP=2.0")
    outcome = world.reload("reload_tests")
    assert outcome.success, outcome.message
    assert outcome.loaded == (str(rebuilt.library),)
    assert "3 components run it: loop, twin, python" in outcome.message
    assert _report(outcome, "replace_core") == ("sum", "rounds")
    assert [report.missed_releases for report in outcome.report] == [0] * len(outcome.report)
    assert {report.phase_nominal_ns for report in outcome.report} <= {0, NOT_MEASURED}
    assert world.mean_step() == 2.0, "an inline variable of the new code is its own"
    after, last = world.sum()
    assert last - first < after - before <= 2 * (last - first), "it went on from the sum of the old core"
    new = world.generation()
    assert new == world.generation("twin") > 1
    assert "no code was rebuilt" in world.reload().message
    assert world.generation() == new


def test_there_is_a_way_back_and_forward_again(world: World, rebuilt: RebuiltPackage) -> None:
    assert world.reload(back=True).code is Code.INVALID
    rebuilt.build("STEP=2.0")
    assert world.reload().success
    rebuilt.build("STEP=4.0", "GAIN=0.75")
    assert world.reload("loop").success
    assert world.mean_step() == 3.0, "a default that nobody has set is that of the new code"
    sum_before = world.sum()[0]
    outcome = world.reload(back=True)
    assert outcome.success
    assert "is in force again" in outcome.message
    assert world.mean_step() == 2.0
    assert world.sum()[0] > sum_before, "the sum was handed back"
    assert world.reload(back=True).success
    assert world.mean_step() == 1.0
    assert world.generation() == 1
    assert world.reload(back=True).code is Code.INVALID
    assert world.reload().success, "what the disk has"
    assert world.mean_step() == 3.0


def test_a_property_that_was_set_keeps_its_value(world: World, rebuilt: RebuiltPackage) -> None:
    assert world.ask(Step("set_property", "loop", "gain", "10.0")).success
    rebuilt.build("GAIN=0.5")
    assert world.reload().success
    assert world.mean_step() == 10.0
    assert world.part("twin").properties[0].value == 0.5


def test_another_shell_comes_with_its_component(world: World, rebuilt: RebuiltPackage) -> None:
    rebuilt.build("OTHER_SHELL", "STEP=2.0")
    outcome = world.reload()
    assert outcome.success, outcome.message
    assert [port.name for port in world.part().ports] == ["bias", "sum"]
    assert world.mean_step() == 2.0


def test_max_slew_goes_on_over_a_reload(rebuilt: RebuiltPackage, tmp_path: Path) -> None:
    worlds = make_world("virtual time", tmp_path, "[]", settings=", max_slew: {sum.data: 2000}")
    world = next(worlds)
    rebuilt.build("OTHER_SHELL", "STEP=1000.0")
    before, first = world.sum()
    assert world.reload().success
    after, last = world.sum()
    assert last > first
    assert after - before <= 2.0 * (last - first), "the first output of the new code moves no faster"
    assert world.mean_step() == 2.0
    assert next(worlds, None) is None


def test_an_adopt_that_expects_its_own_build_is_told_of_generations_and_state_fields(
    world: World, rebuilt: RebuiltPackage
) -> None:
    rebuilt.build("ADOPTS")
    outcome = world.reload()
    assert outcome.code is Code.ADOPT_REFUSED
    assert "adopt refused: the adopt of the new core returned false" in outcome.message
    assert "dynamic_cast of it gives nullptr: name the state in MAUVE_STATE" in outcome.message
    assert world.generation() == 1


def test_refused_reloads_use_up_no_generation_number(world: World, rebuilt: RebuiltPackage) -> None:
    for macro in ("MISSING", "ADOPTS"):  # refused before it is loaded into this process, and after that
        rebuilt.build(macro)
        assert not world.reload().success
    rebuilt.build("STEP=2.0")
    outcome = world.reload()
    assert "generation 2 is in force" in outcome.message
    assert world.generation() == 2
    assert world.reload(back=True).success
    rebuilt.build("STEP=3.0")
    assert "generation 3 is in force" in world.reload().message, "2 was in force"


def test_limits_of_a_probation_name_component_and_output(world: World, rebuilt: RebuiltPackage) -> None:
    rebuilt.build("CRASH")  # never tried: the limits come first
    for output, why in (
        ("twin.total.data", "'twin.total.data' is no output of loop, twin, python"),
        ("other.sum.data", "known: loop.sum, python.sum, twin.sum"),
        ("loop.sum.velocity", "found velocity; name the field of a number"),
    ):
        limit = f"{{output: {output}, maximum: 1.0}}"
        outcome = world.reload(probation=f"{{probation_s: 60, revert_on: [{limit}]}}")
        assert (outcome.code, why in outcome.message) == (Code.INVALID, True), outcome.message
    rebuilt.build("STEP=2.0")
    limit = "{output: twin.sum.data, maximum: -1.0}"
    assert world.reload(probation=f"{{probation_s: 60, revert_on: [{limit}]}}").success
    record = world.decided()
    assert (record.component, record.verdict) == ("twin", "reverted")
    assert record.reason.startswith("output twin.sum.data is ")


def test_state_that_does_not_fit_is_told(world: World, rebuilt: RebuiltPackage) -> None:
    rebuilt.build("OTHER_STATE")
    outcome = world.reload()
    assert outcome.success
    report = next(each for each in outcome.report if each.step == "replace_core reload_tests/Loop")
    assert report.taken == ("sum",)
    assert report.left == (
        "rounds: int64 before, int32 now",
        "history: the old core has no such field",
    )


REFUSED = {
    "OTHER_LAYOUT": "type reload_tests/Number: its layout has changed: field data: float64 at byte 0 before, "
    "float32 at byte 0 now",
    "CRASH": "crashed (SIGABRT",
    "MISSING": "undefined symbol",
    "WITHOUT_CORE": "core 'reload_tests/Loop' is gone from the new code, and a component has it",
    "WITHOUT_PORT": "the new shell lacks a port that is connected",
    'MAUVE_RT_VERSION="9.9.9"': "built against another version of MAUVE RT; expected 0.1.0, found 9.9.9",
}


def test_what_does_not_fit_is_refused_before_anything_changes(world: World, rebuilt: RebuiltPackage) -> None:
    before = world.part()
    for macro, why in REFUSED.items():
        rebuilt.build(macro, "STEP=2.0")
        outcome = world.reload()
        assert not outcome.success, macro
        assert why in outcome.message
        assert world.generation() == 1
    data = rebuilt.library.read_bytes()
    rebuilt.library.unlink()
    rebuilt.library.write_bytes(data[: len(data) // 2])
    assert "wait for the end of the build" in world.reload().message
    assert world.mean_step() == 1.0
    after = world.part()
    assert (after.core, after.state, after.fault) == (before.core, "RUNNING", "")
    rebuilt.build("STEP=3.0")
    assert world.reload().success, "a refusal is in nobody's way"
    assert world.mean_step() == 3.0


def test_a_dry_run_changes_nothing(world: World, rebuilt: RebuiltPackage) -> None:
    rebuilt.build("CRASH")
    assert "crashed" in world.reload(dry_run=True).message
    rebuilt.build("STEP=2.0")
    outcome = world.reload(dry_run=True)
    assert outcome.success
    assert str(rebuilt.library) in outcome.message
    assert (world.generation(), world.mean_step()) == (1, 1.0)


def test_a_resource_keeps_its_code(world: World, rebuilt: RebuiltPackage) -> None:
    rebuilt.build("STEP=2.0")
    outcome = world.reload()
    assert outcome.success
    assert "resources keep the code that they were made with: box" in outcome.message


def test_cores_of_other_libraries_have_to_be_built_with_a_changed_shell(
    world: World, rebuilt: RebuiltPackage
) -> None:
    rebuilt.build("OTHER_SHELL")
    outcome = world.reload()
    assert outcome.success
    assert "not usable until they are built and reloaded, too: reload_tests/Other" in outcome.message
    refused = world.ask(Step("replace_core", "loop", "reload_tests/Other"))
    assert not refused.success
    assert "it was compiled for a shell that has other members by now" in refused.message
    rebuilt.build_other("OTHER_SHELL")
    assert world.reload().success
    swapped = world.ask(Step("replace_core", "loop", "reload_tests/Other"))
    assert swapped.success, swapped.message


def test_the_state_fields_of_the_page(tmp_path: Path) -> None:
    cpp, python = (
        next(block.text for block in blocks(PAGES["docs/howto/reload_code.md"]) if words in block.text)
        for words in ("MAUVE_STATE", "state_fields = {")
    )
    source = tmp_path / "pid.cpp"
    source.write_text(
        '#include "mauve_rt/mauve_rt.hpp"\nstruct ControlShell : mauve::Shell {};\n'
        + cpp.replace("...", "")
        + "int fields() { return Pid().state_fields().size(); }\n",
        encoding="utf-8",
    )
    library = tmp_path / "pid.so"
    compile_plugin(source, library)
    names: dict[str, Any] = {"Core": Core}
    exec(python, names)  # noqa: S102 - a block of the page
    pid = names["Pid"](None)
    pid.integral, pid.previous_error = 1.0, 2.0
    cells = StateCells(pid)
    assert cells.fields == [("integral", "float64", 8), ("previous_error", "float64", 8)]
    assert cells.store() == (struct.pack("<dd", 1.0, 2.0), True)


def test_a_module_comes_with_the_modules_that_it_uses(world: World, rebuilt: RebuiltPackage) -> None:
    assert world.ask(Step("replace_core", "loop", "reload_tests/PyLoop")).success
    first = world.part("python").releases
    rebuilt.write("reload_tests_step", "STEP = 5.0\n")  # the core's own file is as it was
    outcome = world.reload("python")
    assert outcome.success, outcome.message
    assert outcome.loaded == ("reload_tests_cores",)
    assert world.generation("python") == world.generation() > 1
    assert world.generation("twin") == 1
    assert _report(outcome, "replace_core") == ("sum", "rounds")
    assert world.part("python").state == "RUNNING"
    assert world.part("python").releases > first
    rebuilt.write("reload_tests_step", "STEP = 5.0 +\n")
    refused = world.reload()
    assert not refused.success
    assert "SyntaxError" in refused.message
    assert world.reload(back=True).success
    assert world.generation("python") == 1


def test_a_refused_module_is_not_that_of_later_parts(world: World, rebuilt: RebuiltPackage) -> None:
    rebuilt.write("reload_tests_step", "STEP = 5.0\n")
    rebuilt.build("WITHOUT_PORT")
    assert not world.reload().success
    assert PluginLoader.generations.module_of("reload_tests_cores") is None
    rebuilt.build("STEP=2.0")
    assert world.reload().success
    assert PluginLoader.generations.module_of("reload_tests_cores") is not None
    assert world.reload(back=True).success
    assert PluginLoader.generations.module_of("reload_tests_cores") is None


def test_from_cpp_to_python_and_back_the_state_goes_along(world: World, rebuilt: RebuiltPackage) -> None:
    del rebuilt
    before = world.sum()[0]
    there = world.ask(Step("replace_core", "loop", "reload_tests/PyLoop"))
    assert there.success, there.message
    assert there.report[0].taken == ("sum", "rounds")
    assert there.report[0].left == ()
    world.run(20)
    back = world.ask(Step("replace_core", "loop", "reload_tests/Loop"))
    assert back.report[0].taken == ("sum", "rounds")
    assert world.mean_step() == 1.0
    assert world.sum()[0] > before + 10, "the core in Python has added to it"


def test_a_core_of_rebuilt_code_is_not_taken_without_a_reload(world: World, rebuilt: RebuiltPackage) -> None:
    rebuilt.build("STEP=2.0")
    refused = world.ask(Step("replace_core", "loop", "reload_tests/Loop"))
    assert not refused.success
    assert f"{rebuilt.library} was changed since this process loaded it" in refused.message
    assert "mauve reload" in refused.message
    assert world.mean_step() == 1.0


def test_unknown_targets_and_protected_components_are_refused(world: World, rebuilt: RebuiltPackage) -> None:
    refused = world.reload("lop")
    assert refused.code is Code.INVALID
    assert "'lop' is no component, and no package with code that is loaded; did you mean" in refused.message
    rebuilt.build("STEP=2.0")
    assert world.reload("loop", "python").success


def test_the_file_may_be_overwritten_while_its_copy_runs(world: World, rebuilt: RebuiltPackage) -> None:
    rebuilt.build("STEP=2.0")
    assert world.reload().success
    with rebuilt.library.open("r+b") as file:  # in place, as `cp` does
        file.write(os.urandom(rebuilt.library.stat().st_size))
    assert world.mean_step() == 2.0
    assert not world.reload().success


@pytest.mark.parametrize("requirement", ["true", "warn"])
def test_a_reload_is_judged_and_the_way_back_is_not(
    rebuilt: RebuiltPackage, tmp_path: Path, requirement: str
) -> None:
    """Nothing is declared here, so nothing is proved."""
    settings = f"require_schedulable: {requirement}"
    made = make_world("virtual time", tmp_path, "[]", settings)
    world = next(made)
    rebuilt.build("STEP=2.0")
    outcome = world.reload()
    assert "during the change: not provable: something is missing of loop, " in outcome.message
    if requirement == "true":
        assert outcome.code is Code.NOT_SCHEDULABLE
        assert world.mean_step() == 1.0
        assert world.generation() == 1
    else:
        assert outcome.code is Code.OK
        assert world.mean_step() == 2.0
        back = world.reload(back=True)
        assert back.code is Code.OK
        assert "warning" not in back.message
    assert [*made] == []
