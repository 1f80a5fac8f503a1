"""`mauve watch` in a terminal: a table that keys sort, filter and open, and that outlives an executor."""

import os
import re
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ros_processes import PATIENCE_S
from terminal import Terminal

NODE = "/robot_1/executor"


def lines_of(text: str) -> list[str]:
    return [line.strip() for line in text.replace("\r", "").splitlines()]


def test_a_table_that_keys_change(executor: Any, terminal: Callable[..., Terminal]) -> None:
    del executor
    screen = terminal("watch", NODE, "--value", "count", "--value", "counter.count:data")
    screen.await_text(
        "counter", "guard", "sleepy", "RUNNING", "wake-up", "data ", "counter.count:data", "q quit"
    )
    text = screen.await_text(" 50 ", " us")  # its rate, by two statuses
    assert max(len(line) for line in lines_of(text)) <= 80
    screen.press("s")
    screen.await_text("sorted by wake-up")
    screen.press("/gua\r")
    text = screen.await_text("filter gua", "guard")
    last = text.rpartition(NODE)[2]
    assert "guard" in last
    assert "sleepy" not in last
    screen.press("\x1b")
    screen.await_text("sleepy", "guard")
    screen.press("sssss")
    screen.await_text("counter")
    screen.press("\r")
    opened = screen.await_text("core executor_tests/Counter", "count.write", "data ", "period_ms", "property")
    assert "structural" not in opened
    screen.press("\x1b")
    screen.await_text("sleepy")
    screen.press("p")
    screen.await_text("PAUSED")
    screen.press("q")
    assert screen.process.wait(PATIENCE_S) == 0


def test_an_executor_may_end_and_come_back(
    start_executor: Callable[..., Any], architecture: Path, terminal: Callable[..., Terminal]
) -> None:
    arguments = "-p", f"architecture:={architecture}"
    first = start_executor(*arguments)
    screen = terminal("watch", NODE, "/nobody/executor")
    screen.await_text("counter", "/nobody/executor  no answer yet", "real")
    first.process.terminate()
    first.process.wait(PATIENCE_S)
    screen.await_text("does not answer")
    start_executor(*arguments)
    screen.press("s")
    screen.await_text("sorted by wake-up")
    deadline = time.monotonic() + PATIENCE_S
    while "does not answer" in screen.await_text(NODE).rpartition("/robot_1/executor")[2]:
        assert time.monotonic() < deadline, "it is back"
        screen.press(" ")
        screen.press(" ")
    screen.press("q")
    assert screen.process.wait(PATIENCE_S) == 0


def test_once_it_needs_no_terminal(executor: Any, domain: int) -> None:
    assert executor.process.poll() is None

    def run(*words: str) -> subprocess.CompletedProcess[str]:
        environment = {**os.environ, "ROS_DOMAIN_ID": str(domain)}
        command = [sys.executable, "-m", "mauve_rt.cli", "watch", *words]
        return subprocess.run(command, env=environment, capture_output=True, text=True, check=False)

    done = run(NODE, "--once", "--value", "count", "--value", "cuont")
    assert (done.returncode, done.stderr) == (0, "")
    assert "counter" in done.stdout
    assert re.search(r"^ count +data ", done.stdout, re.MULTILINE)
    assert "no resource or port is named 'cuont'; did you mean count?" in done.stdout
    assert "q quit" not in done.stdout
    refused = run(NODE)
    assert (refused.returncode, refused.stderr) == (
        2,
        "mauve: watch needs a terminal; add --once for one table without it\n",
    )
    nobody = run("/nobody/executor", "--once")
    assert (nobody.returncode, nobody.stderr) == (
        2,
        "mauve: no answer from /nobody/executor; see mauve nodes\n",
    )
