"""What `mauve list` and ~/list_components tell of connections and of ROS names."""

import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from mauve_msgs.msg import ReconfigurationStep
from mauve_msgs.srv import ListComponents, Reconfigure

NODE = "/robot_1/executor"
OPERATE = Path(__file__).parents[3] / "docs/howto/operate.md"
LAMP = """\
  lamp: {kind: client, type: std_srvs/srv/SetBool, service: {name: lamp}}
  spare: {kind: shared_data, type: std_msgs/msg/Float64}
connections:
"""


def _resources(graph: Any) -> dict[str, dict[str, str]]:
    reply = graph.ask(ListComponents, f"{NODE}/list_components")
    sides = ("publishes", "subscribes", "calls", "offers")
    return {
        found.name: {side: getattr(found, side) for side in sides if getattr(found, side)}
        for found in reply.resources
    }


def test_resources_have_the_names_that_ros_sees(
    start_executor: Callable[..., Any], architecture: Path, graph: Any
) -> None:
    text = architecture.read_text(encoding="utf-8").replace("connections:\n", LAMP)
    architecture.write_text(text, encoding="utf-8")
    start_executor("-p", f"architecture:={architecture}", "-r", "count:=tally")
    assert _resources(graph) == {
        "count": {"publishes": "/robot_1/tally"},
        "set": {"subscribes": "/robot_1/set"},
        "lamp": {"calls": "/robot_1/lamp"},
        "spare": {},
    }
    seen = {name for name, _ in graph.node.get_topic_names_and_types()}
    assert {"/robot_1/tally", "/robot_1/set"} <= seen


def test_what_a_transaction_adds_and_removes_is_listed(graph: Any, executor: Any) -> None:
    def change(*steps: tuple[str, str, str, str]) -> None:
        messages = [
            ReconfigurationStep(kind=kind, target=target, name=name, value=value)
            for kind, target, name, value in steps
        ]
        reply = graph.ask(Reconfigure, f"{NODE}/reconfigure", steps=messages)
        assert reply.success, reply.message

    def added(direction: str) -> tuple[str, str, str, str]:
        topic = f"{{name: aside, direction: {direction}}}"
        return (
            "add_resource",
            "aside",
            "",
            f"{{kind: shared_data, type: std_msgs/msg/Float64, topic: {topic}}}",
        )

    assert executor.process.poll() is None
    change(added("publish"), ("connect", "sleepy", "count", "aside.write"))
    assert _resources(graph)["aside"] == {"publishes": "/robot_1/aside"}
    reply = graph.ask(ListComponents, f"{NODE}/list_components")
    port = next(port for port in reply.components[2].ports if port.name == "count")
    assert (port.resource, port.service) == ("aside", "write")
    change(("disconnect", "sleepy", "count", ""), ("remove_resource", "aside", "", ""))
    assert "aside" not in _resources(graph)
    change(added("subscribe"))
    assert _resources(graph)["aside"] == {"subscribes": "/robot_1/aside"}


def test_mauve_list_shows_what_is_connected(executor: Any, domain: int) -> None:
    def run(*words: str) -> str:
        command = [sys.executable, "-m", "mauve_rt.cli", "list", NODE, *words]
        environment = {**os.environ, "ROS_DOMAIN_ID": str(domain)}
        return subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout

    assert executor.process.poll() is None
    lines = [line.split() for line in run().splitlines()]
    assert ["counter.count", "count.write", "publishes", "/robot_1/count"] in lines
    assert ["counter.set", "set.read", "subscribes", "/robot_1/set"] in lines
    assert ["guard.count", "nothing"] in lines
    told = {found["name"]: found for found in json.loads(run("--json"))["resources"]}
    assert told["set"]["subscribes"] == "/robot_1/set"


def test_the_interface_is_the_one_that_readme_lists(executor: Any, graph: Any) -> None:
    told = re.search(r"Its interface is in `mauve_msgs`\s+\((.*?)\)", OPERATE.read_text("utf-8"), re.DOTALL)
    assert told is not None
    names = {name.replace("~", NODE) for name in re.findall(r"`(\S+)`", told[1])}
    assert len(names) >= 10

    def offered() -> set[str]:
        node = graph.node
        if ("executor", "/robot_1") not in node.get_node_names_and_namespaces():
            return set()  # its endpoints are known before its name is
        known = node.get_service_names_and_types_by_node("executor", "/robot_1")
        known += node.get_publisher_names_and_types_by_node("executor", "/robot_1")
        return {name for name, _ in known}

    assert executor.process.poll() is None
    graph.ask(ListComponents, f"{NODE}/list_components")
    graph.spin_until(lambda: names <= offered(), f"{names}")
    ours = {
        name
        for name, types in graph.node.get_service_names_and_types_by_node("executor", "/robot_1")
        if any(kind.startswith("mauve_msgs/") for kind in types)
    }
    assert ours <= names  # and no service of ours that README does not name
