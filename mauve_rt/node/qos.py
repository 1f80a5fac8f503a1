"""Quality of service by the names that architecture files and parameters use."""

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from mauve_rt.trace.bag import TopicQos

QOS_NAMES = ("reliable", "best_effort", "transient_local", "sensor_data")


def qos_profile(name: str, *, capacity: int = 0) -> QoSProfile:
    """The profile that an architecture file names; `capacity` is that of the ring_buffer behind it."""
    reliable, best_effort = ReliabilityPolicy.RELIABLE, ReliabilityPolicy.BEST_EFFORT
    match name:
        case "best_effort":
            return QoSProfile(depth=max(10, capacity), reliability=best_effort)
        case "sensor_data":
            return QoSProfile(depth=max(5, capacity), reliability=best_effort)
        case "transient_local":
            latched = DurabilityPolicy.TRANSIENT_LOCAL
            return QoSProfile(depth=max(1, capacity), reliability=reliable, durability=latched)
        case _:
            return QoSProfile(depth=max(10, capacity), reliability=reliable)


def recorded_qos(qos: QoSProfile) -> TopicQos:
    """A profile as a bag keeps it."""
    return TopicQos(
        depth=qos.depth,
        reliable=qos.reliability == ReliabilityPolicy.RELIABLE,
        transient_local=qos.durability == DurabilityPolicy.TRANSIENT_LOCAL,
    )
