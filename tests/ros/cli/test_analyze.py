"""`mauve analyze` tells the same of a file, of the executor that runs it, and of the bag that it records."""

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from std_msgs.msg import Float64

from mauve_msgs.srv import ListTasks

NODE = "/robot_1/executor"
MARGIN = 1.5
NOT_PROVED = 3
SAME = (
    "states",
    "jobs",
    "priority",
    "period_ns",
    "offset_ns",
    "deadline_ns",
    "overrun",
    "holds",
    "undeclared_locks",
)


def test_a_file_a_node_and_a_bag_tell_one_model(  # noqa: PLR0915 - one executor for all three
    architecture: Path, start_executor: Callable[..., Any], graph: Any, domain: int, tmp_path: Path
) -> None:
    text = architecture.read_text(encoding="utf-8")
    declared = "counter: {deadline_ns: 7000000, states: {Count: {wcet_ns: 900000000}}, "
    text = text.replace("counter: {", declared, 1)
    text = text.replace("executor: {", "executor: {wakeup_us: 70, overhead_ns: 9000, ", 1)
    text = text.replace("[counter.set, set.read]", "[counter.set, set.read]\n  - [guard.set, set.read]")
    ring = "set: {kind: ring_buffer, capacity: 8, longest_hold_ns: 30000, "  # two readers: with a lock
    text = text.replace("set: {kind: shared_data, ", ring)
    architecture.write_text(text, encoding="utf-8")
    bag = tmp_path / "bag"
    executor = start_executor("-p", f"architecture:={architecture}", "-p", f"bag:={bag}")
    counts = graph.hear(Float64, "/robot_1/count")
    graph.spin_until(lambda: len(counts) > 20, "counts")

    threads: dict[str, Any] = {}
    routes: dict[str, Any] = {}

    def analyzed(*words: str) -> dict[str, Any]:
        command = [sys.executable, "-m", "mauve_rt.cli", "analyze", *words, "--chain", "set:count", "--json"]
        environment = {**os.environ, "ROS_DOMAIN_ID": str(domain)}
        done = subprocess.run(
            command, env=environment, capture_output=True, text=True, check=False, timeout=200
        )
        assert (done.returncode, done.stderr) == (NOT_PROVED, ""), "no component has a CPU of its own"
        told = json.loads(done.stdout)
        threads[words[0]] = told["threads"]
        (routes[words[0]],) = told["chains"][0]["routes"]
        assert (told["wakeup_ns"], told["overhead_ns"]) == (70_000, 9_000)
        return {component["name"]: component for component in told["components"]}

    of_node = analyzed(NODE)
    assert executor.end(signal.SIGTERM)[0] == 0
    of_file, of_bag = analyzed(str(architecture)), analyzed(str(bag))
    assert threads[NODE] == threads[str(bag)] == threads[str(architecture)]
    assert {one["route"] for one in routes.values()} == {"set -> counter -> count"}
    assert "set has several readers (counter, guard): each takes" in " ".join(
        routes[str(architecture)]["reasons"]
    )
    assert routes[str(bag)]["measured"]["reaction"]["count"] > 0
    assert [*of_file] == [*of_node] == [*of_bag] == ["counter", "guard", "sleepy"]
    for name, told in of_file.items():
        for other in (of_node[name], of_bag[name]):
            has_rights = other["policy"] == "SCHED_FIFO"  # else its thread has no priority
            for key in SAME if has_rights else set(SAME) - {"priority"}:
                assert other[key] == told[key], (name, key)
        assert told["period_ns"] > 0
    assert of_file["counter"]["deadline_ns"] == 7_000_000
    assert of_file["counter"]["states"][0]["origin"] == "declared"
    (held,) = of_file["counter"]["holds"]
    assert (held["resource"], held["longest_ns"], held["origin"]) == ("set", 30_000, "declared")
    assert of_file["guard"]["holds"] == [held]
    assert of_file["counter"]["undeclared_locks"] == [], "the only writer of count takes no lock"

    measured = analyzed(str(architecture), "--budget-from", str(bag), "--margin", str(MARGIN))
    assert measured["counter"]["states"] == of_file["counter"]["states"], "what is declared stays"
    (state,) = measured["guard"]["states"]
    assert state["origin"].startswith("measured in bag (n = ")
    assert state["origin"].endswith(f" x {MARGIN:g}")
    assert state["time_ns"] > 0
    assert {job["cost_ns"] for job in measured["guard"]["jobs"]} == {state["time_ns"] + 9_000}

    before = architecture.read_text(encoding="utf-8")
    command = [sys.executable, "-m", "mauve_rt.cli", "analyze", str(architecture)]
    words = ["--budget-from", str(bag), "--margin", str(MARGIN), "--write"]
    done = subprocess.run([*command, *words], capture_output=True, text=True, check=False, timeout=200)
    assert done.returncode == NOT_PROVED, done.stderr
    assert "2 times written as wcet_ns; enforce_wcet enforces them" in done.stderr
    after = architecture.read_text(encoding="utf-8")
    entry = f"states: {{Count: {{wcet_ns: {state['time_ns']}}}}},  # {state['origin']}\n"
    assert entry in after
    assert re.sub(r"states: \{Count: \{wcet_ns: \d+\}\},  # measured.*\n *", "", after) == before
    written = analyzed(str(architecture))
    assert written["guard"]["states"] == [{**state, "origin": "declared"}]


def test_the_list_of_threads_is_the_one_that_runs(
    architecture: Path, start_executor: Callable[..., Any], graph: Any, domain: int
) -> None:
    """The kernel of the computer says which threads of the executor run under SCHED_FIFO."""
    executor = start_executor("-p", f"architecture:={architecture}")
    counts = graph.hear(Float64, "/robot_1/count")
    graph.spin_until(lambda: len(counts) > 2, "counts")
    reply = graph.ask(ListTasks, f"{NODE}/list_tasks")
    listed = {task.name: task.priority for task in reply.list.tasks}
    assert (reply.list.wakeup_ns, reply.list.overhead_ns) == (-1, -1)
    assert listed["topics_out"] + 1 == listed["stops_out"]
    assert listed["trace"] == 1
    components = {"counter", "guard", "sleepy"}
    silent = ("safe outputs", "watchdog", "commit ", "reserve ")  # no state has a bound here
    for task in Path(f"/proc/{executor.process.pid}/task").iterdir():
        try:
            policy, priority = os.sched_getscheduler(int(task.name)), os.sched_getparam(int(task.name))
            name = (task / "comm").read_text(encoding="utf-8").rstrip("\n")
        except OSError:  # the thread has ended
            continue
        if policy != os.SCHED_FIFO or name in components or name.startswith(silent):
            continue
        assert listed.get(name) == priority.sched_priority, name


ALONE = """\
mauve: 1
executor: {namespace: /robot_1, wakeup_us: 900000, overhead_ns: 20000}
components:
  counter: {shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm,
            priority: 40, cpus: [0], properties: {period_ms: 20}, deadline_ns: 2000000000,
            states: {Count: {wcet_ns: 1000000}}}
resources:
  count: {kind: shared_data, type: std_msgs/msg/Float64, topic: {name: count, direction: publish}}
connections:
  - [counter.count, count.write]
"""


def test_the_report_of_a_run_has_bounds_beside_what_was_measured(
    start_executor: Callable[..., Any], graph: Any, tmp_path: Path
) -> None:
    architecture, bag, page = tmp_path / "alone.yaml", tmp_path / "bag", tmp_path / "page.html"
    architecture.write_text(ALONE, encoding="utf-8")
    executor = start_executor("-p", f"architecture:={architecture}", "-p", f"bag:={bag}")
    counts = graph.hear(Float64, "/robot_1/count")
    graph.spin_until(lambda: len(counts) > 5, "counts")
    assert executor.end(signal.SIGTERM)[0] == 0
    command = [sys.executable, "-m", "mauve_rt.cli"]
    options: dict[str, Any] = {"capture_output": True, "text": True, "timeout": 200}
    report = [*command, "report", str(bag), "--out", str(page)]
    done = subprocess.run(report, check=False, **options)
    assert (done.returncode, done.stderr) == (0, "")
    text = page.read_text(encoding="utf-8")
    analysis = [*command, "analyze", str(bag), "--json"]
    told = json.loads(subprocess.run(analysis, check=False, **options).stdout)
    [counter] = told["components"]
    has_bound = counter["response"]["response_ns"] is not None
    assert has_bound or counter["not_provable"], "without real-time rights nothing is proved"
    assert ("The bounds are those of mauve analyze" in text) == has_bound
    if has_bound:
        assert f"{told['verdict']['sentence']}." in text
