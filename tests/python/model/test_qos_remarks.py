"""Subscriptions that ordinary publishers do not match are remarked upon, no others: rclpy is the judge."""

import json
from pathlib import Path

import pytest
from rclpy.qos import (
    DurabilityPolicy,
    LivelinessPolicy,
    QoSCompatibility,
    QoSProfile,
    ReliabilityPolicy,
    qos_check_compatible,
)

from mauve_rt.interfaces.qos import qos_profile
from mauve_rt.model import load_architecture
from mauve_rt.model.qos_remarks import qos_remarks, remark_text
from mauve_rt.model.schema import TopicModel

# What create_publisher(type, topic, 10) offers, with nothing left to the middleware to say.
ORDINARY = QoSProfile(
    depth=10,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.VOLATILE,
    liveliness=LivelinessPolicy.AUTOMATIC,
)


FILE = """\
mauve: 1
components: {{one: {{shell: a/A, core: a/A, fsm: a/A}}}}
resources:
  laser: {{kind: shared_data, type: sensor_msgs/msg/LaserScan,
          topic: {{name: scan, direction: {direction}, qos: {qos}}}}}
"""


def _topic(folder: Path, qos: object, *, direction: str = "subscribe") -> TopicModel:
    file = folder / "robot.yaml"
    file.write_text(FILE.format(direction=direction, qos=json.dumps(qos)), encoding="utf-8")
    topic = load_architecture(file).resources["laser"].topic
    assert topic is not None
    return topic


@pytest.mark.parametrize(
    ("qos", "fields"),
    [
        ("reliable", []),
        ("sensor_data", []),
        ("best_effort", []),
        ({"profile": "sensor_data", "depth": 1}, []),  # README's example
        ({"lifespan_ms": 100}, []),
        ({"profile": "transient_local", "durability": "volatile"}, []),
        ("transient_local", ["profile"]),
        ({"durability": "transient_local"}, ["durability"]),
        ({"profile": "sensor_data", "deadline_ms": 200}, ["deadline_ms"]),
        ({"lease_ms": 1000}, ["lease_ms"]),
        ({"liveliness": "manual_by_topic"}, ["liveliness"]),
        ({"liveliness": "manual_by_topic", "lease_ms": 2000}, ["lease_ms", "liveliness"]),
    ],
)
def test_a_remark_wherever_an_ordinary_publisher_would_not_be_heard(
    qos: object, fields: list[str], tmp_path: Path
) -> None:
    topic = _topic(tmp_path, qos)
    remarks = [*qos_remarks(topic)]
    assert [field for field, _, _ in remarks] == fields
    verdict, reason = qos_check_compatible(ORDINARY, qos_profile(topic.qos))
    assert verdict == (QoSCompatibility.ERROR if fields else QoSCompatibility.OK), reason
    for remark in remarks:
        text = remark_text("laser", topic, remark)
        assert text.startswith(
            f"topic 'scan' of resource 'laser' will not receive, by its {remark[0]}, a publisher"
        )
        assert "; " in text  # the remedy


def test_what_a_publisher_offers_needs_none(tmp_path: Path) -> None:
    everything = {"durability": "transient_local", "deadline_ms": 5, "lease_ms": 9}
    assert [*qos_remarks(_topic(tmp_path, everything, direction="publish"))] == []
