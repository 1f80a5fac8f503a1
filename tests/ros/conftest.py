"""Real executor processes, and a node of the test's own to talk with them."""

import subprocess
import sys
import time
import uuid
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import pytest
import rclpy
from domains import draw_domain
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile

sys.path.insert(0, str(Path(__file__).parent))  # for ros_processes
sys.path.append(str(Path(__file__).parents[1] / "python"))  # for pages

from ros_processes import PATIENCE_S, ExecutorProcess, keep_interpreter

from mauve_msgs.msg import ReconfigurationEvent
from mauve_msgs.srv import Stop

ARCHITECTURE = """\
mauve: 1
executor: {namespace: /robot_1}
components:
  counter: {shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm,
            alternatives: [executor_tests/Backwards, executor_tests/Reluctant, executor_tests/Unready,
                           executor_tests/PyCounter, executor_tests/Held],
            priority: 40, properties: {period_ms: 20}}
  guard: {shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm,
          reconfigurable: false}
  sleepy: {shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm,
           alternatives: [executor_tests/Backwards], properties: {period_ms: 5000}}
resources:
  count: {kind: shared_data, type: std_msgs/msg/Float64, topic: {name: count, direction: publish}}
  set: {kind: shared_data, type: std_msgs/msg/Float64, topic: {name: set, direction: subscribe}}
connections:
  - [counter.count, count.write]
  - [counter.set, set.read]
"""


class Graph:
    """A node of the test's own, spun by the test."""

    def __init__(self, context: Context) -> None:
        self.node = Node("test", context=context, start_parameter_services=False)
        self._executor = SingleThreadedExecutor(context=context)
        self._executor.add_node(self.node)
        self._clients: dict[str, Any] = {}

    def spin_until(self, condition: Callable[[], bool], what: str, timeout_s: float = PATIENCE_S) -> None:
        """Spin until the condition holds; fails after `timeout_s`."""
        deadline = time.monotonic() + timeout_s
        while not condition():
            assert time.monotonic() < deadline, f"gave up waiting for: {what}"
            self._executor.spin_once(timeout_sec=0.05)

    def ask_later(self, service_type: Any, service: str, **fields: Any) -> Any:
        """A future for the reply of a service, once it is there."""
        client = self._clients.get(service)
        if client is None:
            client = self._clients[service] = self.node.create_client(service_type, service)
        self.spin_until(client.service_is_ready, f"service {service}")
        return client.call_async(service_type.Request(**fields))

    def ask(self, service_type: Any, service: str, **fields: Any) -> Any:
        """The reply of a service; asked again by the same id while none comes, as `mauve` does."""
        if "request_id" in service_type.Request.get_fields_and_field_types():
            fields.setdefault("request_id", str(uuid.uuid4()))
        futures = [self.ask_later(service_type, service, **fields)]
        deadline = time.monotonic() + 4.0

        def replied() -> bool:
            if len(futures) == 1 and time.monotonic() > deadline:
                futures.append(self.ask_later(service_type, service, **fields))
            return any(future.done() for future in futures)

        self.spin_until(replied, f"a reply of {service}")
        return next(future.result() for future in futures if future.done())

    def hear(self, message_type: Any, topic: str, qos: QoSProfile | int = 100) -> list[Any]:
        """A list that fills with a topic's messages; returns when a publisher was found."""
        heard: list[Any] = []
        subscription = self.node.create_subscription(message_type, topic, heard.append, qos)
        self.spin_until(lambda: self.node.count_publishers(topic) > 0, f"a publisher of {topic}")
        assert subscription is not None
        return heard

    def hear_events(self, node: str) -> list[Any]:
        """An executor's events, from now on: it sends to us for certain, as refused requests have shown."""
        events = self.hear(ReconfigurationEvent, f"{node}/events")
        deadline = time.monotonic() + PATIENCE_S
        while not any(event.cause == "heard?" for event in events):
            assert time.monotonic() < deadline, "gave up waiting for: events"
            self.ask(Stop, f"{node}/stop", component="nobody", cause="heard?")
        self.ask(Stop, f"{node}/stop", component="nobody", cause="the last")
        self.spin_until(lambda: events[-1].cause == "the last", "the last of them")
        events.clear()
        return events

    def voice(self, message_type: Any, topic: str, qos: QoSProfile | int = 10) -> Any:
        """A publisher that already has a subscriber."""
        publisher = self.node.create_publisher(message_type, topic, qos)
        self.spin_until(lambda: publisher.get_subscription_count() > 0, f"a subscriber of {topic}")
        return publisher


@pytest.fixture(scope="module")
def domain() -> int:
    """A ROS domain of this module's own; the stage `system`, which runs in parallel, has 51 to 100."""
    return draw_domain()


@pytest.fixture
def graph(domain: int) -> Iterator[Graph]:
    context = Context()
    rclpy.init(context=context, domain_id=domain)
    graph = Graph(context)
    yield graph
    graph.node.destroy_node()
    context.try_shutdown()


@pytest.fixture
def architecture(tmp_path: Path, plugin_prefix: Path) -> Path:
    path = tmp_path / "robot.yaml"
    path.write_text(ARCHITECTURE, encoding="utf-8")
    return path


@pytest.fixture
def start_executor(
    tmp_path: Path, domain: int, plugin_prefix: Path
) -> Iterator[Callable[..., ExecutorProcess]]:
    """start_executor("-p", "architecture:=FILE", ...): ended with the test, which fails where one hangs."""
    started: list[ExecutorProcess] = []

    def start(
        *arguments: str, environment: Mapping[str, str] = MappingProxyType({}), **options: Any
    ) -> ExecutorProcess:
        variables = {"ROS_DOMAIN_ID": str(domain), **environment}
        started.append(ExecutorProcess(tmp_path, variables, arguments, **options))
        return started[-1]

    yield start
    hung = []
    for executor in started:
        if executor.process.poll() is None:
            executor.process.terminate()
            try:
                executor.process.wait(PATIENCE_S)
            except subprocess.TimeoutExpired:
                executor.process.kill()
                executor.process.wait()
                hung.append(executor.process.args)
    assert not hung, "these had to be killed"


@pytest.fixture
def kept(architecture: Path) -> Callable[..., Path]:
    """`keep_interpreter`, once component sleepy may keep it."""
    text = architecture.read_text(encoding="utf-8").replace("period_ms: 5000", "period_ms: 20")
    before, after = "sleepy: {shell: executor_tests/CounterShell, core: executor_tests/", "PyKeeping,"
    architecture.write_text(text.replace(f"{before}Counter,", f"{before}{after}", 1), encoding="utf-8")

    return keep_interpreter


@pytest.fixture
def executor(start_executor: Callable[..., ExecutorProcess], architecture: Path) -> ExecutorProcess:
    """An executor that runs `ARCHITECTURE` as /robot_1/executor."""
    return start_executor("-p", f"architecture:={architecture}")
