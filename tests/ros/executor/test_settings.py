"""The executor's and the supervisor's own parameters: what can be set is used, all else is refused."""

import math
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rcl_interfaces.srv import DescribeParameters, GetParameters, ListParameters, SetParameters
from rclpy.parameter import Parameter, parameter_value_to_python
from ros_processes import PATIENCE_S, ExecutorProcess
from std_msgs.msg import Float64

from mauve_msgs.msg import ReconfigurationStep, ReplyCode
from mauve_msgs.srv import ListComponents, Reconfigure
from mauve_rt.node.executor.settings import PARAMETERS
from mauve_rt.node.shared.settings import OF_RCLPY
from mauve_rt.node.supervisor.settings import PARAMETERS as OF_SUPERVISOR

NODE = "/robot_1/executor"
FIXED = sorted(name for name, setting in PARAMETERS.items() if setting.is_fixed)
CHANGEABLE = [
    "bag",
    "bag_compression",
    "bag_max_size_bytes",
    "bag_snapshot_bytes",
    "bag_snapshot_s",
    "bag_split_bytes",
    "bag_split_s",
    "record_topic_regexes",
    "record_topics",
    "rules",
]
OTHER_VALUES = {bool: False, int: 1, float: 0.5, str: "elsewhere", list: ["elsewhere"]}
PARTS = "{shell: executor_tests/TwinShell, core: executor_tests/Twin, fsm: executor_tests/TwinFsm}"
RULES = """\
mauve: 1
rules:
  - name: lost
    when: {silence: {topic: in, type: std_msgs/msg/Bool, longer_than_s: 0.5}}
    do: [{kind: stop, target: counter}]
"""


class Remote:
    """A node's parameters as a client of the parameter services sees them."""

    def __init__(self, graph: Any, node: str = NODE) -> None:
        self._graph, self._node = graph, node

    def names(self) -> list[str]:
        return sorted(self._graph.ask(ListParameters, f"{self._node}/list_parameters").result.names)

    def get(self, *names: str) -> list[Any]:
        values = self._graph.ask(GetParameters, f"{self._node}/get_parameters", names=names).values
        return [parameter_value_to_python(value) for value in values]

    def describe(self, *names: str) -> list[Any]:
        return list(
            self._graph.ask(DescribeParameters, f"{self._node}/describe_parameters", names=names).descriptors
        )

    def set(self, name: str, value: object) -> Any:
        """The result of one."""
        kind = Parameter.Type.STRING_ARRAY if value == [] else Parameter.Type.from_parameter_value(value)
        message = Parameter(name, kind, value).to_parameter_msg()
        reply = self._graph.ask(SetParameters, f"{self._node}/set_parameters", parameters=[message])
        return reply.results[0]

    def dump(self) -> str:
        """As `ros2 param dump` prints them."""
        parameters: dict[str, Any] = {}
        names = self.names()
        for name, value in zip(names, self.get(*names), strict=True):
            *outer, last = name.split(".")
            place = parameters
            for part in outer:
                place = place.setdefault(part, {})
            place[last] = value
        return yaml.dump({self._node: {"ros__parameters": parameters}}, default_flow_style=False)


def _change(graph: Any, transition: int) -> None:
    assert graph.ask(ChangeState, f"{NODE}/change_state", transition=Transition(id=transition)).success


def test_what_is_read_once_is_read_only(executor: ExecutorProcess, graph: Any) -> None:
    remote = Remote(graph)
    graph.ask(ListComponents, f"{NODE}/list_components")
    own = [*PARAMETERS, *OF_RCLPY]
    assert [name for name in remote.names() if "." not in name] == sorted(own), "and each has a value"
    before = remote.get(*own)
    assert None not in before
    for name, descriptor in zip(own, remote.describe(*own), strict=True):
        assert descriptor.read_only == (name not in CHANGEABLE), name
        assert descriptor.description, name
    for name in own:
        default = {**PARAMETERS, **OF_RCLPY}[name].default
        result = remote.set(name, not default if isinstance(default, bool) else OTHER_VALUES[type(default)])
        assert not result.successful, name
        expected = {
            "use_sim_time": "components run by the monotonic clock",
            **dict.fromkeys(FIXED, f"is read once, at the start: start the node again with -p {name}:="),
            **dict.fromkeys(CHANGEABLE, "is read when the executor is configured: clean it up first"),
        }.get(name, "is read once")
        assert expected in result.reason, name
        assert remote.set(name, remote.get(name)[0]).successful, "it has that value"
    assert remote.get(*own) == before
    refused = remote.set("qos_overrides./robot_1/count.publisher.depth", 5)
    assert "quality of service is in the architecture file" in refused.reason
    assert executor.process.poll() is None


def test_what_can_be_set_is_used(
    architecture: Path, start_executor: Callable[..., Any], graph: Any, tmp_path: Path
) -> None:
    start_executor("-p", f"architecture:={architecture}", "-p", "autostart:=false")
    remote = Remote(graph)
    assert remote.set("bag", str(tmp_path / "bag")).successful
    assert remote.set("record_topics", ["talk:std_msgs/msg/Float64"]).successful
    assert remote.set("record_topics", []).successful
    assert remote.set("record_topics", ["talk:std_msgs/msg/Float64"]).successful
    assert "out of range" in remote.set("bag_split_s", -1.0).reason
    assert remote.set("bag_split_bytes", 10_000).successful
    _change(graph, Transition.TRANSITION_CONFIGURE)
    graph.voice(Float64, "/robot_1/talk")  # somebody listens there
    assert not remote.set("bag", "elsewhere").successful
    _change(graph, Transition.TRANSITION_ACTIVATE)
    graph.spin_until(lambda: len([*(tmp_path / "bag").glob("*.mcap")]) > 1, "a second file of the bag")
    _change(graph, Transition.TRANSITION_DEACTIVATE)
    _change(graph, Transition.TRANSITION_CLEANUP)
    assert remote.set("bag", "").successful
    _change(graph, Transition.TRANSITION_CONFIGURE)
    assert remote.get("bag", "record_topics") == ["", ["talk:std_msgs/msg/Float64"]]


def test_a_dump_is_a_parameter_file(
    architecture: Path, start_executor: Callable[..., Any], graph: Any, tmp_path: Path
) -> None:
    text = architecture.read_text(encoding="utf-8")
    twins = "".join(f"  twin_{index}: {PARTS}\n" for index in range(3))
    architecture.write_text(text.replace("resources:\n", f"{twins}resources:\n"), encoding="utf-8")
    first = start_executor("-p", f"architecture:={architecture}", "-p", "bag_split_s:=1e-3")
    remote = Remote(graph)
    graph.ask(ListComponents, f"{NODE}/list_components")
    given = {
        "counter.step": 0.1,
        "counter.enabled": False,
        "counter.label": 'a: "b"\n\t\x7f\u2028é 😀 \\ ' + 30 * "folded at eighty columns ",
        "sleepy.label": "12.0",
        "twin_0.factor": math.inf,
        "twin_1.factor": -math.inf,
        "twin_2.factor": 2.5e-308,
    }
    for name, value in given.items():
        assert remote.set(name, value).successful, name
    names = remote.names()
    before = remote.get(*names)
    (tmp_path / "dump.yaml").write_text(remote.dump(), encoding="utf-8")
    assert "null" not in remote.dump()
    first.end(signal.SIGTERM)
    second = start_executor("--params-file", str(tmp_path / "dump.yaml"))
    graph.spin_until(
        lambda: second.process.poll() is not None or graph.node.count_services(f"{NODE}/get_parameters") > 0,
        "the second",
    )
    assert second.process.poll() is None, second.output
    graph.spin_until(lambda: remote.names() == names, "its parameters")
    assert remote.get(*names) == before
    assert dict(zip(names, before, strict=True)).items() >= given.items()
    assert "null" not in remote.dump()


def test_a_structural_property_is_set_beside_its_reader(executor: ExecutorProcess, graph: Any) -> None:
    remote = Remote(graph)
    listed = graph.ask(ListComponents, f"{NODE}/list_components").components
    assert {part.name: list(part.structural) for part in listed}["counter"] == ["period_ms"]
    (described,) = remote.describe("counter.period_ms")
    assert described.read_only
    assert "structural: read by the fsm when configured" in described.additional_constraints
    result = remote.set("counter.period_ms", 7)
    assert not result.successful
    assert "replace the fsm beside it" in result.reason
    assert remote.get("counter.period_ms") == [20]
    alone = ReconfigurationStep(kind="set_property", target="counter", name="period_ms", value="7")
    refused = graph.ask(Reconfigure, f"{NODE}/reconfigure", steps=[alone])
    assert (refused.success, refused.code) == (False, ReplyCode.NOT_RECONFIGURABLE)
    reader = ReconfigurationStep(kind="replace_fsm", target="counter", name="executor_tests/CounterFsm")
    done = graph.ask(Reconfigure, f"{NODE}/reconfigure", steps=[alone, reader])
    assert done.success, done.message
    counter = graph.ask(ListComponents, f"{NODE}/list_components").components[0]
    assert (counter.name, counter.period_ns) == ("counter", 7_000_000)
    assert remote.get("counter.period_ms") == [7]
    assert executor.process.poll() is None


def test_the_supervisor_s_parameters(domain: int, graph: Any, tmp_path: Path) -> None:
    (tmp_path / "rules.yaml").write_text(RULES, encoding="utf-8")
    words = [sys.executable, "-m", "mauve_rt.node.supervisor.main"]
    rules = ["--ros-args", "-p", f"rules:={tmp_path / 'rules.yaml'}"]
    file = tmp_path / "parameters.yaml"
    file.write_text("supervisor: {ros__parameters: {rulse: x}}\n", encoding="utf-8")
    for more, message in (
        (["-p", "rulse:=x"], "parameter rulse: a supervisor has none of that name; did you mean rules?"),
        (["--params-file", str(file)], "parameter rulse: a supervisor has none of that name"),
        (["-p", "qos_overrides./in.subscription.depth:=3"], "a supervisor takes no qos_overrides"),
        (["-p", "use_sim_time:=true"], "use_sim_time: expected false"),
    ):
        ended = subprocess.run(
            [*words, *rules, *more], capture_output=True, text=True, timeout=PATIENCE_S, check=False
        )
        assert (ended.returncode, ended.stdout) == (2, ""), more
        assert message in ended.stderr, more
    own = [*OF_SUPERVISOR, *OF_RCLPY]
    with subprocess.Popen([*words, *rules], env={**os.environ, "ROS_DOMAIN_ID": str(domain)}) as supervisor:
        remote = Remote(graph, "/supervisor")
        try:
            assert remote.names() == sorted(own)
            assert all(descriptor.read_only for descriptor in remote.describe(*own))
            before = remote.get(*own)
            for name in own:
                assert not remote.set(name, "x" if name == "rules" else True).successful, name
            assert remote.get(*own) == before
        finally:
            supervisor.terminate()


@pytest.mark.parametrize("program", ["executor", "supervisor"])
@pytest.mark.parametrize("word", ["--help", "-h"])
def test_help_starts_nothing(program: str, word: str) -> None:
    table = PARAMETERS if program == "executor" else OF_SUPERVISOR
    ended = subprocess.run(
        [sys.executable, "-m", f"mauve_rt.node.{program}.main", word],
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    assert (ended.returncode, ended.stderr) == (0, "")
    assert f"usage: ros2 run mauve_rt {program} --ros-args" in ended.stdout
    for name, setting in table.items():
        (line,) = [line for line in ended.stdout.splitlines() if f"-p {name}:=" in line]
        assert setting.description in line
        assert "(default: " in line
