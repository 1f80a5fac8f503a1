"""Quality of service by the names that architecture files and parameters use."""

from rclpy.duration import Duration
from rclpy.qos import DurabilityPolicy, LivelinessPolicy, QoSProfile, ReliabilityPolicy

from mauve_rt._bridge import Qos
from mauve_rt.model.schema import QosModel
from mauve_rt.trace.bag.recorded import TopicQos

_PROFILES = {
    "reliable": QoSProfile(depth=10, reliability=ReliabilityPolicy.RELIABLE),
    "best_effort": QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT),
    "sensor_data": QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT),
    "transient_local": QoSProfile(
        depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL
    ),
}


def qos_profile(asked: str | QosModel, *, capacity: int = 0) -> QoSProfile:
    """The profile that an architecture file asks for; `capacity` is that of the ring_buffer behind it."""
    fields = QosModel(profile=asked) if isinstance(asked, str) else asked  # type: ignore[arg-type] # checked
    profile = _PROFILES[fields.profile]
    reliability = ReliabilityPolicy[(fields.reliability or profile.reliability.name).upper()]
    durability = DurabilityPolicy[(fields.durability or profile.durability.name).upper()]
    return QoSProfile(
        depth=fields.depth or max(profile.depth, capacity),
        reliability=reliability,
        durability=durability,
        deadline=_duration(fields.deadline_ms),
        lifespan=_duration(fields.lifespan_ms),
        liveliness=LivelinessPolicy[fields.liveliness.upper()],
        liveliness_lease_duration=_duration(fields.lease_ms),
    )


def _duration(ms: float) -> Duration:
    return Duration(nanoseconds=round(ms * 1e6))


def native_qos(qos: QoSProfile) -> Qos:
    """A profile as the bridge takes it."""
    return Qos(
        reliability=int(qos.reliability),
        durability=int(qos.durability),
        depth=qos.depth,
        deadline_ns=qos.deadline.nanoseconds,
        lifespan_ns=qos.lifespan.nanoseconds,
        liveliness=int(qos.liveliness),
        lease_ns=qos.liveliness_lease_duration.nanoseconds,
    )


def recorded_qos(qos: QoSProfile) -> TopicQos:
    """A profile as a bag keeps it."""
    return TopicQos(
        depth=qos.depth,
        reliable=qos.reliability == ReliabilityPolicy.RELIABLE,
        transient_local=qos.durability == DurabilityPolicy.TRANSIENT_LOCAL,
    )
