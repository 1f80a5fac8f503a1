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


def test_a_file_a_node_and_a_bag_tell_one_model(
    architecture: Path, start_executor: Callable[..., Any], graph: Any, domain: int, tmp_path: Path
) -> None:
    text = architecture.read_text(encoding="utf-8")
    declared = "counter: {deadline_ns: 7000000, states: {Count: {wcet_ns: 900000000}}, "
    text = text.replace("counter: {", declared, 1)
    text = text.replace("[counter.set, set.read]", "[counter.set, set.read]\n  - [guard.set, set.read]")
    ring = "set: {kind: ring_buffer, capacity: 8, longest_hold_ns: 30000, "  # two readers: with a lock
    text = text.replace("set: {kind: shared_data, ", ring)
    architecture.write_text(text, encoding="utf-8")
    bag = tmp_path / "bag"
    executor = start_executor("-p", f"architecture:={architecture}", "-p", f"bag:={bag}")
    counts = graph.hear(Float64, "/robot_1/count")
    graph.spin_until(lambda: len(counts) > 20, "counts")

    def analyzed(*words: str) -> dict[str, Any]:
        command = [sys.executable, "-m", "mauve_rt.cli", "analyze", *words, "--json"]
        environment = {**os.environ, "ROS_DOMAIN_ID": str(domain)}
        done = subprocess.run(
            command, env=environment, capture_output=True, text=True, check=False, timeout=200
        )
        assert (done.returncode, done.stderr) == (NOT_PROVED, ""), "no component has a CPU of its own"
        return {component["name"]: component for component in json.loads(done.stdout)["components"]}

    of_node = analyzed(NODE)
    assert executor.end(signal.SIGTERM)[0] == 0
    of_file, of_bag = analyzed(str(architecture)), analyzed(str(bag))
    assert [*of_file] == [*of_node] == [*of_bag] == ["counter", "guard", "sleepy"]
    for name, told in of_file.items():
        for other in (of_node[name], of_bag[name]):
            for key in SAME:
                assert other[key] == told[key], (name, key)
        assert told["period_ns"] > 0
    assert of_file["counter"]["deadline_ns"] == 7_000_000
    assert of_file["counter"]["states"][0]["origin"] == "declared"
    held = [{"resource": "set", "longest_ns": 30_000, "origin": "declared"}]
    assert of_file["counter"]["holds"] == of_file["guard"]["holds"] == held
    assert of_file["counter"]["undeclared_locks"] == [], "the only writer of count takes no lock"

    measured = analyzed(str(architecture), "--budget-from", str(bag), "--margin", str(MARGIN))
    assert measured["counter"]["states"] == of_file["counter"]["states"], "what is declared stays"
    (state,) = measured["guard"]["states"]
    assert state["origin"].startswith("measured in bag (n = ")
    assert state["origin"].endswith(f" x {MARGIN:g}")
    assert state["time_ns"] > 0
    assert {job["cost_ns"] for job in measured["guard"]["jobs"]} == {state["time_ns"]}

    before = architecture.read_text(encoding="utf-8")
    command = [sys.executable, "-m", "mauve_rt.cli", "analyze", str(architecture)]
    words = ["--budget-from", str(bag), "--margin", str(MARGIN), "--write"]
    done = subprocess.run([*command, *words], capture_output=True, text=True, check=False, timeout=200)
    assert done.returncode == NOT_PROVED, done.stderr
    assert "2 times written as wcet_ns; nothing enforces them" in done.stderr
    after = architecture.read_text(encoding="utf-8")
    entry = f"states: {{Count: {{wcet_ns: {state['time_ns']}}}}},  # {state['origin']}\n"
    assert entry in after
    assert re.sub(r"states: \{Count: \{wcet_ns: \d+\}\},  # measured.*\n *", "", after) == before
    written = analyzed(str(architecture))
    assert written["guard"]["states"] == [{**state, "origin": "declared"}]
