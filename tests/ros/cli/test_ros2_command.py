"""`ros2 mauve` and `ros2 run` against a running executor: as `mauve`, word for word."""

import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from mauve_rt.cli.verbs import VERBS

pytest.importorskip("ros2cli", reason="the ros2 command line is not installed: it is no wheel")

NODE = "/robot_1/executor"
ROS2 = [sys.executable, "-c", "import sys; from ros2cli.cli import main; sys.exit(main())"]
MAUVE = [sys.executable, "-m", "mauve_rt.cli"]


@pytest.fixture
def environment(domain: int) -> dict[str, str]:
    return {**os.environ, "ROS_DOMAIN_ID": str(domain)}


def _run(command: list[str], *words: str, environment: dict[str, str]) -> tuple[int, str, str]:
    done = subprocess.run(
        [*command, *words], env=environment, capture_output=True, text=True, check=False, timeout=200
    )
    return done.returncode, done.stdout, done.stderr


def test_verbs_answer_as_those_of_mauve(executor: Any, environment: dict[str, str], tmp_path: Path) -> None:
    assert executor.process.poll() is None
    both = (MAUVE, [*ROS2, "mauve"])
    for words, status in (
        (("list", NODE, "--json"), 0),
        (("plugins", "--json"), 0),
        (("stop", NODE, "sleepy", "--request-id", "one"), 0),
        (("stop", NODE, "sleepy"), 1),
        (("replace-core", NODE, "guard", "executor_tests/Backwards"), 1),
        (("reconfigure", NODE, str(tmp_path / "none.yaml")), 2),
        (("check", str(tmp_path / "none.yaml")), 2),
    ):
        first, second = (_run(command, *words, environment=environment) for command in both)
        if words[0] != "list":
            assert first == second
        assert (first[0], second[0]) == (status, status)
        assert second[1] or second[2]


def test_bad_usage_and_help(environment: dict[str, str]) -> None:
    command = [*ROS2, "mauve"]
    status, _, errors = _run(command, "list", environment=environment)
    assert (status, "the following arguments are required: executor" in errors) == (2, True)
    status, out, _ = _run(command, environment=environment)
    assert status == 0
    assert all(f"{verb.name} " in out and verb.help in out for verb in VERBS)
    assert "--dry-run" in _run(command, "reconfigure", "--help", environment=environment)[1]


def test_verbs_are_completed(environment: dict[str, str], tmp_path: Path) -> None:
    line = "ros2 mauve rep"
    asked = {"_ARGCOMPLETE": "1", "COMP_LINE": line, "COMP_POINT": str(len(line)), "_ARGCOMPLETE_IFS": " "}
    program = tmp_path / "completions"
    asked |= {"_ARGCOMPLETE_STDOUT_FILENAME": str(program)}
    _run(ROS2, environment={**environment, **asked})
    assert program.read_text().split() == ["replace-core", "report"]


def test_ros2_run_starts_an_executor(architecture: Path, graph: Any, environment: dict[str, str]) -> None:
    pytest.importorskip("ros2run", reason="`ros2 run` is not installed: it is no wheel")
    words = ["run", "mauve_rt", "executor", "--ros-args", "-p", f"architecture:={architecture}"]
    run = subprocess.Popen([*ROS2, *words], env=environment, start_new_session=True)
    try:
        graph.spin_until(
            lambda: any(
                name == f"{NODE}/list_components" for name, _ in graph.node.get_service_names_and_types()
            ),
            "the executor",
        )
    finally:
        os.killpg(run.pid, signal.SIGINT)
    assert run.wait(20) == 0
