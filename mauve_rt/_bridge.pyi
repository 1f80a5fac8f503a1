"""Resources on ROS topics and services, natively, on a node of rclpy's. C++: mauve_rt/bridge."""

from collections.abc import Mapping, Sequence
from typing import Any, overload

def start_console() -> None:
    """From here on a thread of its own writes the process's log lines to the console.

    Once, after rclpy.init(), which was told `--disable-stdout-logs`.
    """

def flush_console(timeout_ns: int) -> bool:
    """Wait until all lines are written; False: the console is not read."""

def parameters_of(words: Sequence[str]) -> list[tuple[str, dict[str, Any]]]:
    """What `--ros-args` says to nodes, in rcl's order: their name or pattern, and values by parameter.

    Raises:
        MauveError: rcl refuses the words, or a parameter file.
    """

class NodeWatch:
    """Reports, without Python, that Python is silent: an ERROR in the log, no WATCHDOG=1 for systemd."""

    def __init__(self, logger: str, *, silent_after_ns: int) -> None:
        """Watch from now on."""
    def beat(self) -> None:
        """Say that Python works."""
    def stop(self) -> None:
        """End the watch; may be called again."""
    @staticmethod
    def notify(state: str) -> None:
        """Report a state, such as READY=1, to the service manager that NOTIFY_SOCKET names, if it does."""

class StopGuard:
    """Takes requests to stop, deactivate or shut down that the node leaves unread for 200 ms.

    A stop is carried out and answered; for a transition outputs are made safe, and the node answers it.
    """

    def __init__(
        self,
        node: int,
        *,
        stop: int,
        change_state: int,
        news: int,
        logger: str,
        instance_id: str,
        codes: Mapping[str, int],
    ) -> None:
        """Guard from now on. Addresses of the node, the two services and a guard condition outlive it.

        `news` is triggered when there is something to take; `codes` are the constants of ReplyCode.
        """
    def set_architecture(self, architecture: int) -> None:
        """Stop components of this one, by its address, from now on; 0: of none."""
    def take_answered(self) -> list[tuple[bytes, bytes]]:
        """(request, response) of each stop that was answered here since the last call, as CDR."""
    def take_transitions(self) -> list[tuple[int, bytes]]:
        """(number, request) of each transition that is to be made and answered, as CDR."""
    def answer(self, number: int, response: bytes) -> None:
        """Send the response, CDR, to a transition of take_transitions()."""
    def stop(self) -> None:
        """End the guard; may be called again."""

class Qos:
    """Quality of service; policies as rclpy's enumerations number them, durations in ns, 0: none."""

    def __init__(
        self,
        *,
        reliability: int,
        durability: int,
        depth: int,
        deadline_ns: int = 0,
        lifespan_ns: int = 0,
        liveliness: int = 0,
        lease_ns: int = 0,
    ) -> None: ...

class TopicTroubles:
    """What the middleware tells of a topic besides its messages. Counts since it was opened."""

    @property
    def deadlines_missed(self) -> int: ...
    @property
    def liveliness_lost(self) -> int:
        """By us as a publisher, or by a publisher that we heard of."""
    @property
    def incompatible_qos(self) -> int: ...
    @property
    def policy(self) -> int:
        """The last quality of service that did not fit, as rclpy's QoSPolicyKind."""

class FlatNumbers:
    """Reads the numbers of messages of one type; a sequence has one number, its length; a text has none."""

    def __init__(self, fields: Sequence[tuple[str, str, str, int, Any]]) -> None:
        """Fields: (name, type as in .msg files, "" or "fixed" or "sequence", size, fields of a message).

        Raises:
            MauveError: there is no number, or more than 1,000, or a field cannot be read.
        """
    @property
    def names(self) -> list[str]:
        """What the numbers are, in their order: position.x, ranges[3], path.length."""

class TopicReport:
    """A bound topic: its name, expanded and remapped, and counts of messages."""

    @property
    def resource(self) -> str: ...
    @property
    def topic(self) -> str: ...
    @property
    def passed(self) -> int:
        """Sent, or received and written."""
    @property
    def refused(self) -> int:
        """By the middleware or by the resource: full, malformed, or larger than it declares."""
    @property
    def refusal(self) -> str:
        """Why the resource refused a message lately; empty: none."""
    @property
    def troubles(self) -> TopicTroubles: ...

class CallCounts:
    """How calls ended so far."""

    @property
    def answered(self) -> int: ...
    @property
    def no_server(self) -> int: ...
    @property
    def timed_out(self) -> int: ...
    @property
    def other(self) -> int:
        """Busy, malformed, or given up for a stop; of an offered call: refused by the resource."""
    @property
    def longest_ns(self) -> int:
        """The longest of those answered."""

class CallReport:
    """A ROS service that a resource calls or offers: its name, expanded and remapped, and counts."""

    @property
    def resource(self) -> str: ...
    @property
    def service(self) -> str: ...
    @property
    def is_offered(self) -> bool: ...
    @property
    def counts(self) -> CallCounts: ...

class Bridge:
    """The topics and services of an architecture, by threads of its own: one sends, the others receive.

    What is opened can be found on the network; it serves its resource from attach() on.
    """

    def __init__(self, node: int, architecture: int, *, priority: int = 1, cpus: Sequence[int] = ()) -> None:
        """Take addresses: `node.handle.pointer`, `architecture.pointer`; both outlive the bridge.

        Priority (SCHED_FIFO) and CPUs (none: any) are the sending thread's.
        """
    def publish(self, resource: str, topic: str, type: str, qos: Qos) -> int:
        """Open a topic for a resource; returns the number of what was opened, also in the log.

        Raises:
            MauveError: the type is not installed, or the middleware refuses; nothing is open then.
        """
    def subscribe(self, resource: str, topic: str, type: str, qos: Qos) -> int:
        """As publish(), the other way."""
    def mirror(
        self,
        resource: str,
        topic: str,
        type: str,
        qos: Qos,
        *,
        period_ns: int,
        numbers: FlatNumbers | None = None,
        number: int | None = None,
    ) -> int:
        """Open a topic on which the polled value is published, at most once in `period_ns`; as publish().

        With `numbers`: all of them as mauve_msgs/msg/Values, their names on another topic, with
        `/names` behind it; with `number`, too: that one as std_msgs/msg/Float64.
        """
    def call(self, resource: str, service: str, type: str) -> int:
        """Open a ROS service that answers a client's calls; as publish()."""
    def offer(self, resource: str, service: str, type: str, offered: str) -> int:
        """Open a ROS service that a resource's call `offered` answers; as publish()."""
    def attach(self, numbers: list[int]) -> None:
        """Let these serve the resources of their names in the architecture.

        Raises:
            MauveError: there is no such resource, or it is none to serve.
        """
    def listen_for_silence(self, resources: set[str]) -> None:
        """Report arrivals for these resources by a best-effort subscription too, and that there are none.

        Raises:
            MauveError: the middleware refuses.
        """
    @overload
    def close(self, numbers: list[int]) -> None:
        """End these; what was written before is sent."""
    @overload
    def close(self) -> None:
        """stop(), and end all."""
    def start(self) -> None:
        """Let messages flow, both ways."""
    def stop(self) -> None:
        """End the flow when what was written before is sent. May be called again."""
    def topics(self) -> list[TopicReport]: ...
    def calls(self) -> list[CallReport]: ...
    def log(self, on: bool) -> None:
        """Keep messages for take_log() from now on, or do not."""
    def take_log(self) -> list[tuple[int, int, bytes]]:
        """(topic's number, CLOCK_MONOTONIC ns, CDR) of each message since the last call."""
    @property
    def log_dropped(self) -> int:
        """Messages that found no room in the log."""
