"""Resources on ROS topics, natively, on a node of rclpy's. C++: mauve_rt/bridge."""

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
    def troubles(self) -> TopicTroubles: ...

class Bridge:
    """The topics of an architecture. One thread of its own sends, another receives."""

    def __init__(self, node: int, architecture: int) -> None:
        """Take addresses: `node.handle.pointer`, `architecture.pointer`; both outlive the bridge."""
    def publish(self, resource: str, topic: str, type: str, qos: Qos) -> int:
        """Bind a resource to a topic; returns the topic's number in the log.

        Raises:
            MauveError: the type is not installed, or the middleware refuses; nothing is bound then.
        """
    def subscribe(self, resource: str, topic: str, type: str, qos: Qos) -> int:
        """As publish(), the other way."""
    def start(self) -> None:
        """Let messages flow, both ways."""
    def stop(self) -> None:
        """End the flow when what was written before is sent. May be called again."""
    def close(self) -> None:
        """stop(), and no topic is bound any more."""
    def reports(self) -> list[TopicReport]: ...
    def log(self, on: bool) -> None:
        """Keep messages for take_log() from now on, or do not."""
    def take_log(self) -> list[tuple[int, int, bytes]]:
        """(topic's number, CLOCK_MONOTONIC ns, CDR) of each message since the last call."""
    @property
    def log_dropped(self) -> int:
        """Messages that found no room in the log."""
