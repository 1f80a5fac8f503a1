"""Completion of `mauve` and `ros2 mauve` with a running executor: a refresh in the background asks it."""

import argparse
import importlib.util
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from ros_processes import PATIENCE_S

from mauve_rt.cli.completion import complete_properties, complete_values
from mauve_rt.cli.completion_cache import Cache

NODE = "/robot_1/executor"
MAUVE = [sys.executable, "-m", "mauve_rt.cli"]
ROS2 = [sys.executable, "-c", "import sys; from ros2cli.cli import main; sys.exit(main())"]
CORES = [f"executor_tests/{name}" for name in ("Backwards", "Held", "PyCounter", "Reluctant", "Unready")]
Complete = Callable[[str], list[str]]


@pytest.fixture(autouse=True)
def environment(domain: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    runtime = tmp_path / "runtime"
    runtime.mkdir(mode=0o700)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(runtime))
    monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))


def _complete(line: str) -> list[str]:
    """The words that may stand at the end of a line, as one TAB gives them."""
    answer = Path(os.environ["XDG_RUNTIME_DIR"], "answer")
    asked = {"_ARGCOMPLETE": "1", "COMP_LINE": line, "COMP_POINT": str(len(line)), "_ARGCOMPLETE_IFS": "\n"}
    done = subprocess.run(
        ROS2 if line.startswith("ros2 ") else MAUVE,
        env={**os.environ, **asked, "_ARGCOMPLETE_STDOUT_FILENAME": str(answer)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    words = [word.strip() for word in answer.read_text(encoding="utf-8").splitlines()]
    return [word for word in words if not word.startswith("-")]  # ros2 offers options, too


def _await(line: str, words: list[str]) -> None:
    """TABs until the words are offered."""
    deadline = time.monotonic() + PATIENCE_S
    while (offered := _complete(line)) != words:
        assert time.monotonic() < deadline, f"{line}: {offered}"
        time.sleep(0.1)


@pytest.mark.parametrize("command", ["mauve", "ros2 mauve"])
def test_names_of_a_running_executor_are_completed(executor: Any, command: str) -> None:
    if command.startswith("ros2") and importlib.util.find_spec("ros2cli") is None:
        pytest.skip("the ros2 command line is not installed: it is no wheel")
    _await(f"{command} list ", [NODE])
    _await(f"{command} stop {NODE} ", ["counter", "guard", "sleepy"])
    _await(f"{command} replace-core {NODE} counter ", CORES)
    _await(f"{command} replace-core {NODE} guard ", [])
    line = argparse.Namespace(executor=NODE)
    values = complete_values("", line)
    assert {"count", "set", "counter.count", "counter.set", "sleepy.count"} <= set(values)
    assert "counter.period_ms" in complete_properties("", line)
    executor.end(signal.SIGINT)
    _await(f"{command} list ", [])


def test_verbs_write_what_a_completion_reads(executor: Any) -> None:
    cache = Cache.of_environment()
    assert cache is not None
    subprocess.run([*MAUVE, "list", NODE], check=True, capture_output=True)
    assert [part.name for part in cache.read().executors[NODE].components] == ["counter", "guard", "sleepy"]
    assert cache.read().found_s == 0.0, "nobody has looked for all executors yet"
    subprocess.run([*MAUVE, "nodes"], check=True, capture_output=True)
    known = cache.read()
    assert known.found_s > 0.0
    assert list(known.executors) == [NODE]
    assert known.executors[NODE].components, "a search does not forget the parts"
    sockets = set(known.executors[NODE].sockets)
    assert sockets, "on this machine only, the executor's socket is known"
    executor.end(signal.SIGINT)
    assert not sockets <= cache.sockets(), "its socket has gone with it"


def test_where_no_executor_runs_nothing_is_offered() -> None:
    assert _complete("mauve list ") == []
    cache = Cache.of_environment()
    assert cache is not None
    deadline = time.monotonic() + PATIENCE_S
    while cache.read().found_s == 0.0:
        assert time.monotonic() < deadline, "the refresh never came to an end"
        time.sleep(0.05)
    assert _complete("mauve list ") == []
