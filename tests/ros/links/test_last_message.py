"""The last message of an output that ends, at a listener on the robot's computer and at a remote one."""

import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from last_message import (
    CAUSES,
    CUT,
    LOCAL,
    OUTPUTS,
    REMOTE,
    STALLED,
    TIMEOUT_S,
    Ending,
    Listener,
    Machines,
    Message,
)
from needed_hosts import hosts_or_skip
from waiting import wait_until

ROUNDS = 3
LASTS_S = 4.0  # several times as long as the buffer of a socket takes to fill
_READER = """\
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
rclpy.init()
node = rclpy.create_node("reader")
def hear(array):
    print(*(f"{one.name}: {one.message}" for one in array.status), sep="\\n", flush=True)
node.create_subscription(DiagnosticArray, "/diagnostics", hear, 10)
rclpy.spin(node)
"""


@pytest.fixture
def machines(tmp_path: Path, plugin_prefix: Path) -> Iterator[Machines]:
    with hosts_or_skip():
        made = Machines(tmp_path)
    yield made
    made.close()


def _await_safe(listener: Listener, topic: str, since_s: float) -> list[Message]:
    """Messages since an instant, once the last one is the safe one."""
    wait_until(lambda: [message.value for message in listener.received(topic, since_s)[-1:]] == [0.0])
    return listener.received(topic, since_s)


def _unsafe(endings: list[Ending], quality: str = "") -> list[Ending]:
    return [ending for ending in endings if quality in ending.quality and not ending.is_safe()]


def test_the_last_reliable_message_over_a_bad_cable_is_the_safe_one(machines: Machines) -> None:
    """Best effort: one message each would be at most one for each end; of three a third is lost."""
    endings = [ending for _ in range(ROUNDS) for ending in machines.trial("30 % lost").endings]
    assert not _unsafe(endings, "reliable")
    assert not _unsafe([ending for ending in endings if ending.host == LOCAL])
    remote = [ending for ending in endings if (ending.quality, ending.host) == ("best_effort", REMOTE)]
    zeros = sum(message.value == 0.0 for ending in remote for message in ending.messages)
    assert zeros > len(remote) == ROUNDS * len(CAUSES)


def test_a_stalled_interface_holds_up_nothing_on_the_machine_itself(
    machines: Machines, tmp_path: Path
) -> None:
    """Neither the topics, nor the safe outputs of a fault, a rule and the executor's end."""
    health = tmp_path / "health"
    with health.open("w", encoding="utf-8") as log:
        machines.run(LOCAL, "-c", _READER, stdout=log)
    machines.start()
    wait_until(lambda: "/executor: process: " in health.read_text("utf-8"))
    machines.impair(STALLED)
    late_s = time.monotonic() + LASTS_S / 2
    time.sleep(LASTS_S)
    local, remote = machines.listeners[LOCAL], machines.listeners[REMOTE]
    for output in OUTPUTS:
        wait_until(lambda: len(local.received(output, late_s)) > 100)  # noqa: B023
        assert len(remote.received(output, late_s)) < 20, "the interface stands still"
    warning = "/executor: process: a network interface stands still: "
    wait_until(lambda: warning in health.read_text("utf-8"))
    assert not _unsafe(machines.end(STALLED))


def test_behind_a_cut_cable_a_driver_is_safe_by_its_own_time(machines: Machines) -> None:
    machines.start()
    began_s = time.monotonic()
    machines.impair(CUT)
    local, remote = machines.listeners[LOCAL], machines.listeners[REMOTE]
    for cause in CAUSES:
        output = f"reliable/{cause}"
        commands = _await_safe(remote, f"watch/{output}", began_s)
        assert commands[-1].time_s - remote.received(output, 0.0)[-1].time_s >= TIMEOUT_S
        goes_on_s = commands[-1].time_s
        wait_until(lambda: len(local.received(output, goes_on_s)) > 20)  # noqa: B023
        assert local.received(output, goes_on_s)[-1].value > 0.0, "the robot itself goes on"
    assert not _unsafe(machines.end(CUT))
