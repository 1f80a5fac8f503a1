"""An executor that requires schedulable changes: refusals, dry runs, and rules, over its services."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from mauve_msgs.msg import ReconfigurationStep
from mauve_msgs.srv import ListComponents, LoadRules, Reconfigure, ReplaceCore, Stop
from mauve_rt.control.requests import Code

NODE = "/robot_1/executor"
COUNTER = "shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm"


def counter(priority: int, wcet_ms: int, more: str = "properties: {period_ms: 16}") -> str:
    times = f"states: {{Count: {{wcet_ns: {wcet_ms}000000}}}}"
    return f"{{{COUNTER}, priority: {priority}, cpus: [0], {more}, {times}}}"


FILE = f"""\
mauve: 1
executor: {{namespace: /robot_1, wakeup_us: 0, overhead_ns: 0, require_schedulable: REQUIRED}}
components:
  one: {{shell: executor_tests/TimedShell, core: executor_tests/Timed, fsm: executor_tests/TimedFsm,
        alternatives: [executor_tests/HalfTimed, executor_tests/Timed], priority: 50, cpus: [0]}}
  a: {counter(40, 6)}
  b: {counter(30, 2)}
  c: {counter(20, 6, "properties: {period_ms: 48}, deadline_ns: 19000000")}
"""
SWAP = f"""\
- {{kind: remove_component, target: a}}
- {{kind: remove_component, target: b}}
- {{kind: add_component, target: a2, value: {counter(40, 2)}}}
- {{kind: add_component, target: b2, value: {counter(30, 6)}}}
"""
HALF = "{kind: replace_core, target: one, name: executor_tests/HalfTimed}"
WHY = "one: no time is known of Count (core executor_tests/HalfTimed declares no time of is_enabled)"
RULES = f"""\
mauve: 1
rules:
  - name: halves
    when: {{fault: {{component: c}}}}
    do: [{HALF}]
"""
Start = Callable[..., Any]


def half(*, dry_run: bool = False) -> dict[str, Any]:
    step = ReconfigurationStep(kind="replace_core", target="one", name="executor_tests/HalfTimed")
    return {"steps": [step], "dry_run": dry_run}


@pytest.fixture
def required(tmp_path: Path, start_executor: Start, plugin_prefix: Path) -> Start:
    """required(REQUIRED, WORD...): an executor with that requirement."""

    def start(requirement: str, *words: str) -> Any:
        file = tmp_path / "robot.yaml"
        file.write_text(FILE.replace("REQUIRED", requirement), encoding="utf-8")
        return start_executor("-p", f"architecture:={file}", "-p", f"rules_folder:={tmp_path}", *words)

    return start


def test_a_change_that_is_not_proved_is_refused_and_a_stop_is_not(required: Start, graph: Any) -> None:
    required("true")
    before = graph.ask(ListComponents, f"{NODE}/list_components")
    for dry_run in (True, False):
        refused = graph.ask(Reconfigure, f"{NODE}/reconfigure", **half(dry_run=dry_run))
        assert (refused.success, refused.code) == (False, Code.NOT_SCHEDULABLE)
        assert refused.message.startswith("during the change: not provable: something is missing of one")
        has_rights = all(part.policy == "SCHED_FIFO" for part in before.components)
        outcomes = [verdict.outcome for verdict in refused.timing]
        assert outcomes == ["schedulable" if has_rights else "not provable", "not provable", "not provable"]
        assert any(line.startswith(WHY) for line in refused.timing[2].missing)
    replaced = graph.ask(
        ReplaceCore, f"{NODE}/replace_core", component="one", core="executor_tests/HalfTimed"
    )
    assert replaced.code == Code.NOT_SCHEDULABLE
    assert graph.ask(ListComponents, f"{NODE}/list_components").revision == before.revision
    assert graph.ask(Stop, f"{NODE}/stop", component="one").success


def test_warn_makes_the_change_and_logs_the_sentence(required: Start, graph: Any) -> None:
    executor = required("warn")
    made = graph.ask(Reconfigure, f"{NODE}/reconfigure", **half())
    assert made.success
    assert "; warning: during the change: not provable: something is missing of one" in made.message
    executor.await_output("; warning: during the change: not provable")


def test_rules_are_judged_when_they_are_loaded(required: Start, graph: Any, tmp_path: Path) -> None:
    rules = tmp_path / "rules.yaml"
    rules.write_text(RULES, encoding="utf-8")
    executor = required("true")
    refused = graph.ask(LoadRules, f"{NODE}/load_rules", path=str(rules))
    assert (refused.success, refused.code) == (False, Code.NOT_SCHEDULABLE)
    words = "rules.yaml:5:5: rule halves: its action is not proved: during the change: not provable: "
    assert words in refused.message
    rules.write_text(RULES.replace(HALF, "{kind: stop, target: one}"), encoding="utf-8")
    assert graph.ask(LoadRules, f"{NODE}/load_rules", path=str(rules)).success, "a rule that protects"
    assert executor.process.poll() is None


def test_rules_at_the_start_are_judged(required: Start, graph: Any, tmp_path: Path) -> None:
    rules = tmp_path / "rules.yaml"
    rules.write_text(RULES, encoding="utf-8")
    executor = required("warn", "-p", f"rules:={rules}")
    executor.await_output("rules.yaml:5:5: rule halves: its action is not proved: during the change")
    assert graph.ask(ListComponents, f"{NODE}/list_components").components
    strict = required("true", "-p", f"rules:={rules}")
    strict.await_output("rules.yaml:5:5: rule halves: its action is not proved: during the change")


def test_the_command_asks_the_executor(required: Start, graph: Any, domain: int, tmp_path: Path) -> None:
    required("false")
    listed = graph.ask(ListComponents, f"{NODE}/list_components").components
    has_rights = all(part.policy == "SCHED_FIFO" for part in listed)

    def analyzed(text: str, *words: str) -> Any:
        file = tmp_path / "change.yaml"
        file.write_text(text, encoding="utf-8")
        command = [sys.executable, "-m", "mauve_rt.cli", "analyze", NODE, "--plan", str(file), *words]
        environment = {**os.environ, "ROS_DOMAIN_ID": str(domain)}
        return subprocess.run(
            command, env=environment, capture_output=True, text=True, check=False, timeout=200
        )

    done = analyzed(f"[{HALF}]\n")
    assert done.returncode == 3, done.stderr
    assert "\nafter it: not provable: something is missing of one" in done.stdout
    assert f"  {WHY}" in done.stdout
    done = analyzed(RULES)
    assert "when rule halves acts: not provable: something is missing of one" in done.stdout
    done = analyzed(f"[{HALF.replace('HalfTimed', 'None')}]\n")
    assert done.returncode == 2
    assert "change.yaml:1:2: core 'executor_tests/None' is not installed" in done.stderr
    done = analyzed(f"idle: true\nsteps:\n{SWAP}")
    if has_rights:
        assert "\nduring the change: not proved: " in done.stdout
        assert "with the change at an idle instant" in done.stdout
    bag = tmp_path / "bag"
    done = analyzed(SWAP, "--witness", str(bag))
    if has_rights:
        assert done.returncode == 1, done.stderr
        assert "\nduring the change: not schedulable: " in done.stdout
        command = [sys.executable, "-m", "mauve_rt.cli", "trace", "check", str(bag)]
        assert subprocess.run(command, check=False, timeout=200).returncode == 0
    else:
        assert "its thread is SCHED_OTHER" in done.stdout
