"""What our programs load to do their work: nothing heavy that this work has no need of.

numpy is none of these: rclpy loads it with the first service.
"""

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any

import pytest
from lifecycle_msgs.msg import State
from lifecycle_msgs.srv import GetState

from mauve_rt import _kernel

NODE = "/robot_1/executor"
HEAVY = {
    "_hashlib",
    "lark",
    "matplotlib",
    "mcap",
    "networkx",
    "pandas",
    "pydantic",
    "rich",
    "rosbags",
    "ruamel",
}
ROS = {"mauve_msgs", "numpy", "rclpy"}
# An executor without rules and Python components loads these after its components have started, or never.
AFTER_THE_START = {
    "diagnostic_msgs",
    "mauve_rt.control.control",
    "mauve_rt.node.executor.diagnostics",
    "mauve_rt.node.executor.parameter_services",
    "mauve_rt.node.executor.services",
}
# 1 MB of the standard library, without which an executor starts whose plug-ins are all in C++.
LARGE_FOR_LITTLE = {"bz2", "lzma", "random", "shutil", "sysconfig", "tempfile", "uuid"}
MODULES = Path(_kernel.__file__).parents[1]
WITHOUT_RULES = {"mauve_rt.node.executor.rules_file", "mauve_rt.supervision.rules"}
FORBIDDEN = {
    ("--help",): HEAVY | ROS,
    ("plugins", "--json"): HEAVY | ROS,
    ("nodes",): HEAVY,
    ("list", NODE, "--json"): HEAVY,
    ("stop", NODE, "counter"): HEAVY,
}

STARTED = "components are started"
TELL_THE_START = f"""\
import sys
from mauve_rt._kernel import Deployer
deploy = Deployer.deploy
def deploy_and_tell(self):
    deploy(self)
    sys.stderr.write("{STARTED}\\n")
Deployer.deploy = deploy_and_tell
"""


def modules(log: str) -> set[str]:
    """The modules in what `python -X importtime` wrote."""
    lines = [line for line in log.splitlines() if line.startswith("import time:")]
    return {line.rpartition("|")[2].strip() for line in lines}


def loaded(log: str) -> set[str]:
    """The packages in what `python -X importtime` wrote."""
    found = {name.partition(".")[0] for name in modules(log)}
    assert "mauve_rt" in found, log
    return found


@pytest.fixture
def traced(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Every Python started from here on tells what it loads, and when components were started.

    The executor's own log is written by a thread of its own, later than what it tells of.
    """
    (tmp_path / "sitecustomize.py").write_text(TELL_THE_START, encoding="utf-8")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path), prepend=os.pathsep)
    monkeypatch.setenv("PYTHONPROFILEIMPORTTIME", "1")


def log_until_active(executor: Any, graph: Any) -> tuple[str, str]:
    """What an executor wrote before and after its components were started."""

    def state() -> int:
        return int(graph.ask(GetState, f"{NODE}/get_state").current_state.id)

    graph.spin_until(lambda: state() == State.PRIMARY_STATE_ACTIVE, "active")
    assert executor.end(signal.SIGINT)[0] == 0
    before, started, after = executor.output.partition(STARTED)
    assert started
    return before, after


def test_start_of_an_executor(traced: None, executor: Any, graph: Any) -> None:
    before, after = log_until_active(executor, graph)
    assert loaded(before + after) & HEAVY == set()
    assert modules(before) & AFTER_THE_START == set()
    assert modules(after) >= AFTER_THE_START
    assert modules(before + after) & WITHOUT_RULES == set()


def test_modules_of_each_start() -> None:
    """Those before the plug-ins; plug-ins in Python need more."""
    names = ("control.runtime", "node.shared.first_steps", "node.shared.log_folder")
    program = "".join(f"import mauve_rt.{name}\n" for name in names)
    program += "mauve_rt.node.shared.first_steps.take_first_steps('program')\n"
    command = [sys.executable, "-P", "-X", "importtime", "-c", program]
    environment = {**os.environ, "PYTHONPATH": str(MODULES)}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert loaded(done.stderr) & LARGE_FOR_LITTLE == set()


def test_components_in_python_wait_for_no_module_once_they_run(
    traced: None, architecture: Path, start_executor: Callable[..., Any], graph: Any
) -> None:
    text = architecture.read_text(encoding="utf-8")
    in_python = text.replace("core: executor_tests/Counter,", "core: executor_tests/PyCounter,")
    assert in_python != text
    architecture.write_text(in_python, encoding="utf-8")
    before, after = log_until_active(start_executor("-p", f"architecture:={architecture}"), graph)
    assert modules(before) >= AFTER_THE_START
    assert modules(after) & AFTER_THE_START == set()


@pytest.mark.parametrize(("words", "forbidden"), FORBIDDEN.items(), ids=[words[0] for words in FORBIDDEN])
def test_verb(
    words: tuple[str, ...], forbidden: Collection[str], executor: Any, graph: Any, domain: int
) -> None:
    graph.spin_until(lambda: graph.node.count_services(f"{NODE}/list_parameters") > 0, "all services")
    done = _mauve(words, ROS_DOMAIN_ID=str(domain))
    assert done.returncode == 0, done.stderr
    assert loaded(done.stderr) & set(forbidden) == set()


def test_completion(tmp_path: Path) -> None:
    told = tmp_path / "told"
    line = "mauve rep"
    shell = {"COMP_LINE": line, "COMP_POINT": str(len(line)), "_ARGCOMPLETE_STDOUT_FILENAME": str(told)}
    done = _mauve((), _ARGCOMPLETE="1", **shell)
    assert told.read_text("utf-8").split("\v") == ["replace-core", "report"]
    assert loaded(done.stderr) & (HEAVY | ROS) == set()


def _mauve(words: Collection[str], **environment: str) -> "subprocess.CompletedProcess[str]":
    command = [sys.executable, "-X", "importtime", "-m", "mauve_rt.cli", *words]
    return subprocess.run(
        command, env={**os.environ, **environment}, capture_output=True, text=True, check=False, timeout=40
    )
