"""Plug-ins that are rebuilt, or installed for the first time, while an executor runs."""

import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from mauve_msgs.srv import ListComponents, ReplaceCore
from mauve_rt.control.requests import Code

NODE = "/robot_1/executor"
ARCHITECTURE = """\
mauve: 1
executor: {namespace: /robot_1}
components:
  counter: {shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm,
            alternatives: installed, properties: {period_ms: 20}}
"""
CORE = """\
from mauve_rt.parts.cores import Core

class Mine(Core):
    def configure(self) -> None:
        pass

    def act(self) -> None:
        pass
"""


class Installed(NamedTuple):
    """An ament prefix of the test's own, and a folder of Python modules."""

    prefix: Path
    modules: Path

    @property
    def library(self) -> Path:
        return self.prefix / "lib" / "libexecutor_tests.so"

    def write_core(self, module: str, text: str) -> None:
        """As an installation does: a new file under the name."""
        new = self.modules / "new"
        new.write_text(text, encoding="utf-8")
        new.replace(self.modules / f"{module}.py")

    def unlist(self, name: str) -> None:
        """Take the lines about a part out of the index of plug-ins."""
        index = (
            self.prefix / "share" / "ament_index" / "resource_index" / "mauve_rt_plugins" / "executor_tests"
        )
        lines = index.read_text(encoding="utf-8").splitlines(keepends=True)
        index.write_text("".join(line for line in lines if f"; {name};" not in line), encoding="utf-8")

    def list_core(self, module: str) -> None:
        """Name a core in the index of plug-ins."""
        index = self.prefix / "share" / "ament_index" / "resource_index" / "mauve_rt_plugins"
        with (index / "executor_tests").open("a", encoding="utf-8") as file:
            file.write(f"core; executor_tests/{module}; executor_tests/CounterShell; {module}:Mine\n")


@pytest.fixture
def installed(plugin_prefix: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Installed:
    prefix, modules = tmp_path / "prefix", tmp_path / "modules"
    shutil.copytree(plugin_prefix, prefix)
    index = prefix / "share" / "ament_index" / "resource_index" / "mauve_rt_plugins" / "executor_tests"
    lines = index.read_text(encoding="utf-8").splitlines(keepends=True)
    index.write_text("".join(line for line in lines if "Missing" not in line), encoding="utf-8")
    modules.mkdir()
    for name, first in (("AMENT_PREFIX_PATH", prefix), ("PYTHONPATH", modules)):
        monkeypatch.setenv(name, os.pathsep.join([str(first), os.environ.get(name, "")]))
    return Installed(prefix, modules)


@pytest.fixture
def start(start_executor: Callable[..., Any], tmp_path: Path) -> Callable[..., None]:
    def started(alternatives: str = "installed") -> None:
        path = tmp_path / "robot.yaml"
        text = ARCHITECTURE.replace("alternatives: installed", f"alternatives: {alternatives}")
        path.write_text(text, encoding="utf-8")
        start_executor("-p", f"architecture:={path}")

    return started


def _replace(graph: Any, core: str) -> Any:
    return graph.ask(ReplaceCore, f"{NODE}/replace_core", component="counter", core=f"executor_tests/{core}")


def _counter(graph: Any) -> Any:
    (counter,) = graph.ask(ListComponents, f"{NODE}/list_components").components
    return counter


def test_a_library_that_was_rebuilt_is_told(
    installed: Installed, start: Callable[..., None], graph: Any
) -> None:
    start()
    assert _replace(graph, "Backwards").success
    new = installed.library.with_suffix(".new")
    shutil.copyfile(installed.library, new)
    new.replace(installed.library)
    assert _replace(graph, "Counter").success, "the same contents are the same code"
    new.write_bytes(installed.library.read_bytes() + b"\0")
    new.replace(installed.library)
    before = _counter(graph)
    refused = _replace(graph, "Backwards")
    assert (refused.success, refused.code) == (False, Code.PREPARE_FAILED)
    assert f"{installed.library} was changed since this process loaded it" in refused.message
    assert refused.message.endswith("start the executor again, or install the new code under another name")
    assert _counter(graph).core == before.core == "executor_tests/Counter"
    installed.library.unlink()
    assert f"{installed.library} is gone since" in _replace(graph, "Backwards").message


def test_a_library_that_was_rebuilt_without_a_core_is_told(
    installed: Installed, start: Callable[..., None], graph: Any
) -> None:
    """The index lists the core no longer, but the old library, which is loaded, still has it."""
    start("[executor_tests/Backwards]")
    assert _replace(graph, "Backwards").success
    assert _replace(graph, "Counter").success
    installed.unlist("executor_tests/Backwards")
    assert _replace(graph, "Backwards").success, "it is the code that was listed"
    assert _replace(graph, "Counter").success
    new = installed.library.with_suffix(".new")
    new.write_bytes(installed.library.read_bytes() + b"\0")
    new.replace(installed.library)
    refused = _replace(graph, "Backwards")
    assert (refused.success, refused.code) == (False, Code.PREPARE_FAILED)
    assert f"{installed.library} was changed since this process loaded it" in refused.message
    assert _counter(graph).core == "executor_tests/Counter"


def test_a_python_module_that_was_changed_is_told(
    installed: Installed, start: Callable[..., None], graph: Any
) -> None:
    installed.write_core("first", CORE)
    installed.list_core("first")
    start()
    assert _replace(graph, "first").success
    assert _replace(graph, "Counter").success
    installed.write_core("first", CORE.replace("act", "other"))
    refused = _replace(graph, "first")
    assert not refused.success
    assert f"{installed.modules / 'first.py'} was changed since this process loaded it" in refused.message
    assert _counter(graph).core == "executor_tests/Counter"


def test_a_core_installed_meanwhile_is_taken(
    installed: Installed, start: Callable[..., None], graph: Any
) -> None:
    start()
    assert _replace(graph, "late").code == Code.UNKNOWN_CORE
    installed.write_core("late", CORE)
    installed.list_core("late")
    reply = _replace(graph, "late")
    assert reply.success, reply.message
    counter = _counter(graph)
    assert counter.core == "executor_tests/late"
    assert _replace(graph, "Counter").success
    assert "executor_tests/late" in _counter(graph).alternatives
