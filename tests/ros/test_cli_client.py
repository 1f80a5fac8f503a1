"""What a short-lived client does against the accidents of discovery and of Ctrl-C."""

import contextlib
import signal
import threading
from collections.abc import Iterator
from typing import Any

import pytest
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import Float64

from mauve_msgs.srv import Stop
from mauve_rt.cli.client import connected


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
