"""`mauve graph` draws the same of a file, of the executor that runs it, and of the bag that it records."""

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


def test_a_file_a_node_and_a_bag_have_one_drawing(
    architecture: Path, start_executor: Callable[..., Any], graph: Any, domain: int, tmp_path: Path
) -> None:
    bag = tmp_path / "bag"
    executor = start_executor("-p", f"architecture:={architecture}", "-p", f"bag:={bag}")
    counts = graph.hear(Float64, "/robot_1/count")
    graph.spin_until(lambda: len(counts) > 20, "counts")

    def drawn(*words: str) -> str:
        done = subprocess.run(
            [sys.executable, "-m", "mauve_rt.cli", "graph", *words],
            env={**os.environ, "ROS_DOMAIN_ID": str(domain)},
            capture_output=True,
            text=True,
            check=False,
            timeout=200,
        )
        assert (done.returncode, done.stderr) == (0, "")
        return done.stdout

    of_node, fsm_of_node = drawn(NODE), drawn(NODE, "--fsm", "guard")
    assert executor.end(signal.SIGTERM)[0] == 0
    of_file, of_bag = drawn(str(architecture)), drawn(str(bag))
    assert _facts(of_file) == _facts(of_node)
    assert _facts(of_file, ros_names=False) == _facts(of_bag, ros_names=False), "a bag has no names of topics"
    assert "publishes /robot_1/count" in of_node
    assert fsm_of_node == drawn(str(architecture), "--fsm", "guard")
    assert fsm_of_node == drawn(str(bag), "--fsm", "guard")


def _facts(dot: str, *, ros_names: bool = True) -> tuple[set[str], set[tuple[str, str]]]:
    """Labels without priorities, which a thread without real-time rights has not; and arrows by names."""
    labels = dict(re.findall(r'(n\d+) \[id="n\d+", label="(.*?)"', dot))
    texts = {re.sub(r", priority \d+", "", text) for text in labels.values()}
    if not ros_names:
        texts = {re.sub(r"\\n(?:publishes|subscribes|calls|offers) [\w/]+", "", text) for text in texts}
    names = {number: text.partition(r"\n")[0] for number, text in labels.items()}
    return texts, {(names[start], names[end]) for start, end in re.findall(r"(n\d+) -> (n\d+) ", dot)}
