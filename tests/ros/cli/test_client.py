"""What a short-lived client does against the accidents of discovery and of Ctrl-C."""

import contextlib
import signal
import threading
import time
from collections import Counter
from collections.abc import Iterator
from typing import Any

import pytest
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import Float64

from mauve_msgs.srv import ListComponents, Stop
from mauve_rt.cli import client as client_module
from mauve_rt.cli.client import NoExecutorError, connected
from mauve_rt.cli.discovery import Discovery
from mauve_rt.errors import ParameterError


class Peer:
    """A node in a thread of its own, on the test's domain."""

    def __init__(self, domain: int) -> None:
        self._context = Context()
        rclpy.init(context=self._context, domain_id=domain)
        self.node = Node("peer", context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._spin)

    def start(self) -> None:
        self._thread.start()

    def _spin(self) -> None:
        while not self._ending.is_set():
            try:
                self._executor.spin_once(timeout_sec=0.05)
            except TypeError:  # a service's callback that gave no response: the client hears nothing
                continue

    def end(self) -> None:
        self._ending.set()
        self._thread.join()
        self.node.destroy_node()
        self._context.try_shutdown()


@pytest.fixture
def peer(domain: int, monkeypatch: pytest.MonkeyPatch) -> Iterator[Peer]:
    monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))
    made = Peer(domain)
    yield made
    made.end()


def test_a_lost_reply_is_asked_for_again_by_the_same_id(peer: Peer) -> None:
    heard: list[str] = []

    def answer(request: Any, response: Any) -> Any:
        heard.append(request.request_id)
        if len(heard) == 1:
            return None
        response.success = True
        return response

    peer.node.create_service(Stop, "/peer/stop", answer)
    peer.start()
    with connected() as client:
        reply = client.call(Stop, "/peer/stop", Stop.Request(component="c"))
    assert reply.success
    assert len(heard) == 2
    assert heard[0] == heard[1] != ""


def test_an_interrupt_inside_of_rclpy_is_not_lost(peer: Peer) -> None:
    publisher = peer.node.create_publisher(Float64, "/peer/number", 10)
    peer.node.create_timer(0.05, lambda: publisher.publish(Float64(data=1.0)))
    peer.start()
    before = signal.getsignal(signal.SIGINT)

    def swallow(_message: Any) -> None:
        with contextlib.suppress(KeyboardInterrupt):  # as happens to one in a destructor, or where C++ called
            signal.raise_signal(signal.SIGINT)

    with connected() as client, pytest.raises(KeyboardInterrupt):
        client.listen(Float64, "/peer/number", swallow)
    assert signal.getsignal(signal.SIGINT) is before


LONG_S = 1000.0  # far beyond this test's own time-out
STEADY = 100  # polls, each 10 ms at least: far beyond the time for which a complete graph must be steady


def _list(peer: Peer, name: str) -> None:
    peer.node.create_service(ListComponents, f"{name}/list_components", lambda _request, response: response)


def test_a_wrong_name_is_told_as_soon_as_all_that_is_there_is_known(
    peer: Peer, domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    monkeypatch.setattr(client_module, "DISCOVERY_TIMEOUT_S", LONG_S)
    for name in ("/robot_1/executor", "/arm/boss"):
        _list(peer, name)
    peer.start()
    with connected() as client, pytest.raises(NoExecutorError) as error:
        client.call(ListComponents, "/robot_2/executor/list_components", ListComponents.Request())
    expected = f"no executor /robot_2/executor in ROS_DOMAIN_ID {domain}; did you mean /robot_1/executor?"
    assert str(error.value) == expected


def test_an_executor_that_is_seen_between_two_looks_is_no_wrong_name(
    peer: Peer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    monkeypatch.setattr(client_module, "OTHERS_S", 0.0)
    peer.start()
    look = Discovery.offered
    looks: list[bool] = []

    def look_and_then_begin(discovery: Discovery) -> Any:
        seen = look(discovery)
        if discovery.is_complete() and not looks:
            looks.append(True)
            _list(peer, "/late/executor")
            while "/late/executor/list_components" not in look(discovery):
                time.sleep(0.01)
        return seen

    monkeypatch.setattr(Discovery, "offered", look_and_then_begin)
    with connected() as client:
        client.call(ListComponents, "/late/executor/list_components", ListComponents.Request())
    assert looks


def test_a_node_whose_services_arrive_late_is_no_wrong_name(
    peer: Peer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    monkeypatch.setattr(client_module, "STARTING_S", 0.0)
    monkeypatch.setattr(client_module, "OTHERS_S", 0.0)
    polls = _begin_at_the_fifth_poll(peer, "/peer", monkeypatch)
    with connected() as client:
        client.call(ListComponents, "/peer/list_components", ListComponents.Request())
    assert polls.count(True) >= 5


def test_a_node_whose_name_arrives_after_others_is_no_wrong_name(
    peer: Peer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    monkeypatch.setattr(client_module, "OTHERS_S", LONG_S)
    polls = _begin_at_the_fifth_poll(peer, "/late/executor", monkeypatch)
    with connected() as client:
        client.call(ListComponents, "/late/executor/list_components", ListComponents.Request())
    assert polls.count(True) >= 5


def _begin_at_the_fifth_poll(peer: Peer, name: str, monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    """Offer the services when all seems to be known; another executor is there from the beginning."""
    _list(peer, "/other/executor")
    peer.start()
    poll = Discovery.is_complete
    polls: list[bool] = []

    def poll_and_begin(discovery: Discovery) -> bool:
        is_complete = poll(discovery)
        polls.append(is_complete)
        if polls.count(True) == 5:
            _list(peer, name)
        return is_complete

    monkeypatch.setattr(Discovery, "is_complete", poll_and_begin)
    return polls


def test_a_participant_is_known_when_its_nodes_are(peer: Peer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    peer.start()
    nodes = Discovery.nodes
    polls: list[int] = []

    def nodes_much_later(discovery: Discovery) -> Counter[str]:
        polls.append(1)
        known = nodes(discovery)
        return known if len(polls) >= STEADY else Counter(list(known)[:1])

    monkeypatch.setattr(Discovery, "nodes", nodes_much_later)
    with connected() as client:
        assert client.find_executors(wait_s=LONG_S) == []
    assert len(polls) >= STEADY


def test_executors_are_told_as_soon_as_all_are_known(
    peer: Peer, domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    _list(peer, "/robot_1/executor")
    peer.start()
    other = Peer(domain)
    _list(other, "/robot_2/executor")
    other.start()
    try:
        with connected() as client:
            assert client.find_executors(wait_s=LONG_S) == ["/robot_1/executor", "/robot_2/executor"]
    finally:
        other.end()


def test_an_empty_domain_is_known_to_be_empty(domain: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    with connected() as client:
        assert client.find_executors(wait_s=LONG_S) == []


def test_beyond_this_machine_nobody_can_be_counted(domain: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET")
    monkeypatch.delenv("ROS_LOCALHOST_ONLY", raising=False)
    began_s = time.monotonic()
    with connected() as client:
        assert client.find_executors(wait_s=1.0) == []
    assert time.monotonic() - began_s >= 1.0


def test_a_middleware_that_cannot_be_bound_to_loopback_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    monkeypatch.setenv("RMW_IMPLEMENTATION", "rmw_cyclonedds_cpp")  # the one that is loaded stays
    with (
        pytest.raises(ParameterError, match="Set RMW_IMPLEMENTATION=rmw_fastrtps_cpp"),
        connected(first=True),
    ):
        pass
