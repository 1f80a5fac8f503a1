"""The `mauve` command against a running executor."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from ros_processes import PATIENCE_S

Mauve = Callable[..., subprocess.CompletedProcess[str]]
STEPS = """\
- {kind: add_resource, target: sum, value: {kind: shared_data, type: std_msgs/msg/Float64}}
- kind: add_component
  target: second
  value: {shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm}
- {kind: connect, target: second, name: count, value: sum.write}
- {kind: start, target: second}
"""
NODE = "/robot_1/executor"


@pytest.fixture
def environment(domain: int) -> dict[str, str]:
    return {**os.environ, "ROS_DOMAIN_ID": str(domain)}


@pytest.fixture
def mauve(environment: dict[str, str], executor: Any, graph: Any) -> Mauve:
    graph.spin_until(lambda: graph.node.count_services(f"{NODE}/list_parameters") > 0, "all services")
    assert executor.process.poll() is None

    def run(*words: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "mauve_rt.cli", *words]
        return subprocess.run(
            command, env=environment, capture_output=True, text=True, check=False, timeout=200
        )

    return run


def test_verbs_do_what_they_say(mauve: Mauve) -> None:
    listed = mauve("list", NODE)
    assert (listed.returncode, listed.stderr) == (0, "")
    assert "counter" in listed.stdout
    replaced = mauve("replace-core", NODE, "counter", "executor_tests/Backwards", "--cause", "for a test")
    assert replaced.returncode == 0, replaced.stderr
    assert "runs executor_tests/Backwards, in place of executor_tests/Counter" in replaced.stdout
    assert "missed releases 0, next release due" in replaced.stdout
    at_once = mauve("replace-core", NODE, "counter", "executor_tests/Backwards", "--phase-timeout", "0")
    assert at_once.returncode == 0, at_once.stderr
    stopped = mauve("stop", NODE, "counter")
    assert (stopped.returncode, stopped.stdout) == (0, "component 'counter' is stopped\n")
    again = mauve("stop", NODE, "counter")
    assert (again.returncode, again.stdout) == (1, "")
    assert again.stderr == "refused, NOT_RUNNING (4): component 'counter' is already stopped\n"
    started = mauve("start", NODE, "counter", "--json")
    assert json.loads(started.stdout)["success"] is True
    states = {part["name"]: part for part in json.loads(mauve("list", NODE, "--json").stdout)["components"]}
    assert states["counter"]["core"] == "executor_tests/Backwards"


def test_a_property_is_set(mauve: Mauve) -> None:
    done = mauve("set", NODE, "counter.step", "2.5", "--cause", "for a test")
    assert (done.returncode, done.stderr) == (0, "")
    parts = {part["name"]: part for part in json.loads(mauve("list", NODE, "--json").stdout)["components"]}
    assert "step=2.5" in parts["counter"]["properties"]
    beyond = mauve("set", NODE, "counter.step", "11")
    assert beyond.returncode == 1
    assert "10" in beyond.stderr
    unknown = mauve("set", NODE, "counter.stepp", "1")
    assert unknown.returncode == 1
    assert "did you mean step?" in unknown.stderr
    bad = mauve("set", NODE, "step", "1")
    assert bad.returncode == 2
    assert "expected COMPONENT.PROPERTY such as control.max_speed, found step" in bad.stderr


def test_output_that_nobody_reads_ends_a_verb_quietly(
    mauve: Mauve, environment: dict[str, str], graph: Any
) -> None:
    def unread(*words: str) -> subprocess.Popen[str]:
        reading, writing = os.pipe()
        os.close(reading)
        try:
            return subprocess.Popen(
                [sys.executable, "-m", "mauve_rt.cli", *words],
                stdout=writing,
                stderr=subprocess.PIPE,
                text=True,
                env=environment,
            )
        finally:
            os.close(writing)

    for words in (("list", NODE), ("list", NODE, "--json"), ("nodes",)):
        process = unread(*words)
        assert (process.communicate(timeout=PATIENCE_S)[1], process.returncode) == ("", 141)
    events = unread("events", NODE)
    graph.spin_until(lambda: graph.node.count_subscribers(f"{NODE}/events") > 0, "the listener")
    deadline_s = time.monotonic() + PATIENCE_S
    while events.poll() is None and time.monotonic() < deadline_s:  # a refusal is an event, too
        mauve("stop", NODE, "nobody")
    assert (events.communicate(timeout=PATIENCE_S)[1], events.returncode) == ("", 141)


def test_a_transaction_is_carried_out_and_reported_step_by_step(mauve: Mauve, tmp_path: Path) -> None:
    file = tmp_path / "steps.yaml"
    file.write_text(STEPS, encoding="utf-8")
    dry = mauve("reconfigure", NODE, str(file), "--dry-run")
    assert (dry.returncode, dry.stderr) == (0, "")
    assert dry.stdout.startswith("dry run: 'add_resource sum ")
    done = mauve("reconfigure", NODE, str(file), "--cause", "a test")
    assert (done.returncode, done.stderr) == (0, "")
    lines = done.stdout.splitlines()
    assert lines[0].startswith("4 steps are in force; prepared in ")
    begins = [
        "add_resource sum: prepared",
        "second: add_component: prepared",
        "second: connect count sum.write",
    ]
    begins.append("second: start")
    assert len(lines) == 5
    for line, begin in zip(lines[1:], begins, strict=True):
        assert line.startswith(f"  {begin}"), lines
    again = mauve("reconfigure", NODE, str(file))
    assert (again.returncode, again.stdout) == (1, "")
    assert again.stderr.startswith("refused, INVALID (14): step 1 (add_resource sum ")


def test_events_are_followed(mauve: Mauve, environment: dict[str, str], tmp_path: Path) -> None:
    command = [sys.executable, "-u", "-m", "mauve_rt.cli", "events", NODE]
    told = tmp_path / "events.txt"
    with told.open("w") as out, subprocess.Popen(command, env=environment, stdout=out) as events:
        for _ in range(20):  # until it has discovered the executor
            mauve("stop", NODE, "nobody", "--cause", "a test")
            if told.read_text():
                break
        events.send_signal(signal.SIGINT)
    assert events.returncode == 0
    assert (
        "stop nobody by mauve because a test: refused (1): component 'nobody' is unknown" in told.read_text()
    )


def test_executors_are_found(mauve: Mauve, environment: dict[str, str]) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while (found := mauve("nodes").stdout) != f"{NODE}\n":  # it may still be loading
        assert (found, time.monotonic() < deadline) == ("", True)
    missing = mauve("list", "/robot_9/executor")
    assert missing.returncode == 2
    expected = f"no executor /robot_9/executor in ROS_DOMAIN_ID {environment['ROS_DOMAIN_ID']}"
    assert missing.stderr == f"mauve: {expected}; did you mean {NODE}?\n"


def test_a_domain_without_an_executor_is_told(environment: dict[str, str]) -> None:
    command = [sys.executable, "-m", "mauve_rt.cli", "list", "/executor"]
    empty = environment | {"ROS_DOMAIN_ID": "101"}  # above those that tests choose from
    done = subprocess.run(command, env=empty, capture_output=True, text=True, check=False, timeout=40)
    assert done.returncode == 2
    expected = "no executor /executor: none is seen at all in ROS_DOMAIN_ID 101"
    assert done.stderr == f"mauve: {expected}; is it started, in this domain?\n"


def test_a_snapshot_by_the_command(mauve: Mauve, tmp_path: Path) -> None:
    refused = mauve("record", "snapshot", NODE)
    assert refused.returncode == 1
    assert "needs a recording into memory (snapshot_s), and nothing is being recorded" in refused.stderr
    bad = mauve("record", "start", NODE, "--snapshot", "-3")
    assert bad.returncode == 1
    assert "bad snapshot_s: expected 0 (record into a bag) or 1 to 1e+06 s, found -3" in bad.stderr
    alone = mauve("record", "start", NODE, "--snapshot-mb", "5")
    assert "bad snapshot_bytes: it limits the memory of snapshot_s; give snapshot_s, too" in alone.stderr
    assert mauve("record", "start", NODE, "--snapshot", "30").returncode == 0
    written = mauve("record", "snapshot", NODE, "--cause", "it shook", "--json")
    assert written.returncode == 0
    bag = json.loads(written.stdout)["bag"]
    try:
        checked = mauve("trace", "check", bag)
        assert checked.returncode == 0, checked.stdout
        assert "note: snapshot of " in checked.stdout
    finally:
        shutil.rmtree(bag)
    assert "the recording into memory has ended" in mauve("record", "stop", NODE).stdout
