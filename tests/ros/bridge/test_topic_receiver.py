"""The native receiver of a recorder: every message is received, or counted as lost before it or by it."""

import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from rclpy.lifecycle import LifecycleNode
from rclpy.qos import QoSPolicyKind, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from std_msgs.msg import UInt8MultiArray, UInt64

from mauve_rt._bridge import SequenceGaps, TopicReceiver
from mauve_rt.errors import MauveError
from mauve_rt.interfaces.qos import native_qos

BEST_EFFORT, RELIABLE = ReliabilityPolicy.BEST_EFFORT, ReliabilityPolicy.RELIABLE
LARGE = 4_000_000
NUMBER, BYTES = "std_msgs/msg/UInt64", "std_msgs/msg/UInt8MultiArray"
Make = Callable[..., TopicReceiver]


@pytest.fixture
def make(graph: Any) -> Iterator[Make]:
    """make([(topic, type, reliability, depth)], limit_bytes=...): a receiver that runs."""
    node = LifecycleNode("recorder", context=graph.node.context)
    made: list[TopicReceiver] = []

    def receiver(topics: list[tuple[str, str, Any, int]], limit_bytes: int = 1 << 28) -> TopicReceiver:
        one = TopicReceiver(node.handle.pointer, limit_bytes=limit_bytes)
        made.append(one)
        for topic, type_name, reliability, depth in topics:
            qos = native_qos(QoSProfile(depth=depth, reliability=reliability))
            one.subscribe(topic, type_name, qos)
        one.start()
        return one

    yield receiver
    for one in made:
        one.close()
    node.destroy_node()


class Taken:
    """What a receiver of one topic gave."""

    def __init__(self, receiver: TopicReceiver) -> None:
        self._receiver = receiver
        self.numbers: list[int] = []
        self.counts = (0, 0, 0)

    def take(self, number_of: Callable[[bytes], int]) -> int:
        """Takes what came; returns how many came ever."""
        batch = self._receiver.take()
        self.numbers += [number_of(data) for _, data in batch.messages(0)]
        self.counts = batch.counts[0]
        return len(self.numbers)

    def must_add_up(self) -> None:
        received, lost_before, lost = self.counts
        assert received - lost == len(self.numbers)
        assert received + lost_before == self.numbers[-1] - self.numbers[0] + 1
        assert self.numbers == sorted(set(self.numbers))


def small(data: bytes) -> int:
    return int(deserialize_message(data, UInt64).data)


def large(data: bytes) -> int:
    return data[-1]


@pytest.mark.parametrize("reliability", [BEST_EFFORT, RELIABLE])
def test_a_burst_at_1_khz_is_received_or_counted(graph: Any, make: Make, reliability: Any) -> None:
    receiver = make([("/burst", NUMBER, reliability, 5000)])
    voice = graph.voice(UInt64, "/burst", QoSProfile(depth=1000, reliability=RELIABLE))
    taken = Taken(receiver)
    for number in range(3000):
        voice.publish(UInt64(data=number))
        time.sleep(0.001)
    graph.spin_until(lambda: taken.take(small) and taken.numbers[-1] == 2999, "the last message")
    taken.must_add_up()
    assert taken.counts[2] == 0, "none was lost here"
    if reliability == RELIABLE:
        assert taken.counts == (3000, 0, 0)


@pytest.mark.parametrize("reliability", [BEST_EFFORT, RELIABLE])
def test_messages_of_4_mb_are_received_or_counted(graph: Any, make: Make, reliability: Any) -> None:
    receiver = make([("/large", BYTES, reliability, 5000)])
    voice = graph.voice(UInt8MultiArray, "/large", QoSProfile(depth=40, reliability=RELIABLE))
    taken = Taken(receiver)
    for number in range(30):
        voice.publish(UInt8MultiArray(data=bytes(LARGE) + bytes([number])))
        time.sleep(0.02)
    ended = time.monotonic() + 1
    enough = 30 if reliability == RELIABLE else 0  # best effort: the last ones may be lost
    graph.spin_until(lambda: taken.take(large) >= enough and time.monotonic() > ended, "the messages")
    if taken.numbers:
        taken.must_add_up()
    assert taken.counts[2] == 0
    if reliability == RELIABLE:
        assert taken.counts == (30, 0, 0)


def test_a_topic_may_come_later(graph: Any, make: Make) -> None:
    receiver = make([("/first", NUMBER, RELIABLE, 100)])
    first = graph.voice(UInt64, "/first", QoSProfile(depth=1000, reliability=RELIABLE))
    second = graph.node.create_publisher(UInt64, "/second", QoSProfile(depth=1000, reliability=RELIABLE))
    graph.spin_until(lambda: first.get_subscription_count() == 1, "the first subscription")
    first.publish(UInt64(data=0))  # waits in the queue, or in the middleware
    qos = native_qos(QoSProfile(depth=100, reliability=RELIABLE))
    assert receiver.subscribe("/second", NUMBER, qos) == 1
    graph.spin_until(lambda: second.get_subscription_count() == 1, "the second subscription")
    first.publish(UInt64(data=1))
    second.publish(UInt64(data=7))
    found: dict[int, list[int]] = {0: [], 1: []}

    def take() -> bool:
        batch = receiver.take()
        for number, size in enumerate(batch.sizes):
            found[number] += [small(data) for _, data in batch.messages(number)][:size]
        return found == {0: [0, 1], 1: [7]}

    graph.spin_until(take, "all messages")
    assert receiver.take().counts == [(2, 0, 0), (1, 0, 0)]
    with pytest.raises(MauveError):
        receiver.subscribe("/third", "no_such/msg/Type", qos)
    second.publish(UInt64(data=8))
    found[1].clear()
    graph.spin_until(lambda: take() or found[1] == [8], "a message after a refusal")


def test_messages_that_the_middleware_overwrites_are_lost_before(graph: Any, make: Make) -> None:
    receiver = make([("/burst", NUMBER, RELIABLE, 1)])
    voice = graph.voice(UInt64, "/burst", QoSProfile(depth=1000, reliability=RELIABLE))
    taken = Taken(receiver)
    voice.publish(UInt64(data=0))
    graph.spin_until(lambda: taken.take(small) == 1, "the first message")
    for number in range(1, 1000):  # it takes one at a time, with pauses
        voice.publish(UInt64(data=number))
    graph.spin_until(lambda: taken.take(small) and taken.numbers[-1] == 999, "the last message")
    taken.must_add_up()
    assert taken.counts[1] > 0


def test_messages_beyond_the_limit_are_lost_here(graph: Any, make: Make) -> None:
    receiver = make([("/burst", NUMBER, RELIABLE, 5000)], limit_bytes=10_000)
    voice = graph.voice(UInt64, "/burst", QoSProfile(depth=1000, reliability=RELIABLE))
    for number in range(1000):
        voice.publish(UInt64(data=number))
    graph.spin_until(voice.wait_for_all_acked, "all messages to arrive")
    receiver.stop()
    batch = receiver.take()
    kept = 10_000 // (31 + 12)  # the head of an MCAP record; CDR of a number
    assert batch.sizes == [kept]
    assert batch.counts == [(1000, 0, 1000 - kept)]


def test_writers_are_counted_each_by_itself(graph: Any, make: Make) -> None:
    receiver = make([("/burst", NUMBER, RELIABLE, 5000)])
    qos = QoSProfile(depth=1000, reliability=RELIABLE)
    voices = [graph.voice(UInt64, "/burst", qos) for _ in range(2)]
    for number in range(300):
        voices[number % 3 == 0].publish(UInt64(data=number))
    taken = Taken(receiver)
    graph.spin_until(lambda: taken.take(small) == 300, "all messages")
    assert taken.counts == (300, 0, 0)


def test_a_message_that_was_overtaken_is_not_lost() -> None:
    gaps = SequenceGaps()
    assert [gaps.follow("a", sequence) for sequence in (10, 11, 14)] == [0, 0, 2]
    assert gaps.follow("b", 700) == 2, "what a writer sent before its first message is not known"
    assert [gaps.follow("a", sequence) for sequence in (12, 15)] == [1, 1]


def test_a_writer_that_sent_last_is_forgotten_last() -> None:
    gaps = SequenceGaps()
    for number in range(1000):
        assert gaps.follow(str(number), 1) == gaps.follow("a", number) == 0
    assert gaps.follow("999", 3) == 1
    assert gaps.follow("0", 9) == 1, "forgotten: it counts from here"


def test_a_batch_becomes_records_without_those_of_channel_0(graph: Any, make: Make) -> None:
    receiver = make([("/a", NUMBER, RELIABLE, 100), ("/b", NUMBER, RELIABLE, 100)])
    before_ns = time.monotonic_ns()
    for topic in ("/a", "/b", "/a", "/b"):
        voice = graph.voice(UInt64, topic)
        voice.publish(UInt64(data=7))
        graph.spin_until(voice.wait_for_all_acked, "the message to arrive")
    receiver.stop()
    batch = receiver.take()
    assert batch.sizes == [2, 2]
    times = [time_ns for time_ns, _ in batch.messages(1)]
    assert before_ns <= min(times)
    assert max(times) <= time.monotonic_ns()
    (records, parts) = batch.pack(
        [0, 5], log_ahead_ns=1000, publish_ahead_ns=2000, earliest_log_ns=times[0] + 1001, offset=60
    )
    size = 31 + 12
    assert len(records) == 2 * size
    ((channel, first_ns, last_ns, entries),) = parts
    assert (channel, first_ns, last_ns) == (5, times[0] + 1001, max(times[1] + 1000, times[0] + 1001))
    offsets = [int.from_bytes(entries[at : at + 8], "little") for at in (8, 24)]
    assert offsets == [60, 60 + size]
    assert records[0] == 5
    assert int.from_bytes(records[9:11], "little") == 5
    assert int.from_bytes(records[23:31], "little") == times[0] + 2000


def test_a_topic_that_is_ignored_is_not_counted(graph: Any, make: Make) -> None:
    receiver = make([("/burst", NUMBER, RELIABLE, 100)])
    receiver.ignore(0, on=True)
    voice = graph.voice(UInt64, "/burst")
    voice.publish(UInt64(data=1))
    graph.spin_until(voice.wait_for_all_acked, "the message to arrive")
    receiver.stop()
    assert receiver.take().counts == [(0, 0, 0)]


def test_a_publisher_that_does_not_fit_is_told_once(graph: Any, make: Make) -> None:
    receiver = make([("/burst", NUMBER, RELIABLE, 100)])
    graph.node.create_publisher(UInt64, "/burst", QoSProfile(depth=1, reliability=BEST_EFFORT))
    found: list[int] = []

    def misfits() -> bool:
        found.extend(receiver.take_misfits())
        return any(found)

    graph.spin_until(misfits, "the event")
    assert found[-1] == QoSPolicyKind.RELIABILITY
    assert receiver.take_misfits() == [0]


def test_a_type_that_is_not_installed_is_refused(make: Make) -> None:
    with pytest.raises(MauveError, match="nowhere/msg/Number"):
        make([("/burst", "nowhere/msg/Number", RELIABLE, 1)])


def test_after_its_end_it_gives_what_came(graph: Any, make: Make) -> None:
    receiver = make([("/burst", NUMBER, RELIABLE, 100)])
    voice = graph.voice(UInt64, "/burst")
    voice.publish(UInt64(data=1))
    graph.spin_until(voice.wait_for_all_acked, "the message to arrive")
    receiver.close()
    receiver.close()
    batch = receiver.take()
    assert (batch.sizes, batch.counts) == ([1], [(1, 0, 0)])
    assert receiver.take_misfits() == []
