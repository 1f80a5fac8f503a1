"""Values of messages in another frame, beside scipy and the definitions of twists and wrenches."""

from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import (
    Point,
    PointStamped,
    Pose,
    PoseStamped,
    PoseWithCovarianceStamped,
    Quaternion,
    Transform,
    Twist,
    TwistWithCovariance,
    Vector3,
    Vector3Stamped,
    Wrench,
    WrenchStamped,
)
from scipy.spatial.transform import Rotation
from std_msgs.msg import String

from mauve_rt.parts.transformed_ports import transformed

NUMBERS = np.random.default_rng(4711)


def drawn(count: int = 3) -> Any:
    return NUMBERS.uniform(-5.0, 5.0, count)


@pytest.fixture
def by() -> tuple[Any, Any, Transform]:
    rotation, shift = Rotation.random(random_state=17), drawn()
    message = Transform()
    message.translation.x, message.translation.y, message.translation.z = shift
    message.rotation.x, message.rotation.y, message.rotation.z, message.rotation.w = rotation.as_quat()
    return rotation, shift, message


def filled(message: Any, numbers: Any) -> Any:
    message.x, message.y, message.z = numbers
    return message


def xyz(message: Any) -> list[float]:
    return [message.x, message.y, message.z]


def adjoint(rotation: Any, shift: Any) -> Any:
    """As KDL has it: of (linear, angular)."""
    r, (x, y, z) = rotation.as_matrix(), shift
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.block([[r, cross @ r], [np.zeros((3, 3)), r]])


def test_points_move_and_vectors_turn(by: Any):
    rotation, shift, message = by
    numbers = drawn()
    moved = rotation.apply(numbers) + shift
    assert xyz(transformed(message, filled(Point(), numbers))) == pytest.approx(moved, abs=1e-12)
    stamped = PointStamped(point=filled(Point(), numbers))
    assert xyz(transformed(message, stamped).point) == pytest.approx(moved, abs=1e-12)
    turned = rotation.apply(numbers)
    assert xyz(transformed(message, filled(Vector3(), numbers))) == pytest.approx(turned, abs=1e-12)
    vector = Vector3Stamped(vector=filled(Vector3(), numbers))
    assert xyz(transformed(message, vector).vector) == pytest.approx(turned, abs=1e-12)
    assert xyz(vector.vector) == pytest.approx(numbers), "the sample itself is as it was"


def test_poses_and_their_covariance(by: Any):
    rotation, shift, message = by
    numbers, own = drawn(), Rotation.random(random_state=3)
    pose = Pose(position=filled(Point(), numbers))
    pose.orientation = Quaternion(**dict(zip("xyzw", own.as_quat(), strict=True)))
    half = NUMBERS.uniform(-1.0, 1.0, (6, 6))
    covariance = half @ half.T
    stamped = PoseWithCovarianceStamped()
    stamped.pose.pose, stamped.pose.covariance = pose, covariance.ravel()
    found = transformed(message, stamped).pose
    assert xyz(found.pose.position) == pytest.approx(rotation.apply(numbers) + shift, abs=1e-12)
    found_rotation = Rotation.from_quat([*xyz(found.pose.orientation), found.pose.orientation.w])
    assert (found_rotation.inv() * rotation * own).magnitude() == pytest.approx(0.0, abs=1e-12)
    blocks = np.kron(np.eye(2), rotation.as_matrix())
    assert found.covariance == pytest.approx((blocks @ covariance @ blocks.T).ravel(), abs=1e-12)
    assert transformed(message, PoseStamped(pose=pose)).pose.position == found.pose.position


def test_twists_and_wrenches_are_those_of_the_same_body(by: Any):
    rotation, shift, message = by
    first, second = drawn(), drawn()
    twist = Twist(linear=filled(Vector3(), first), angular=filled(Vector3(), second))
    wanted = adjoint(rotation, shift) @ [*first, *second]
    found = transformed(message, twist)
    assert [*xyz(found.linear), *xyz(found.angular)] == pytest.approx(wanted, abs=1e-11)
    half = NUMBERS.uniform(-1.0, 1.0, (6, 6))
    covariance = half @ half.T
    with_covariance = TwistWithCovariance(twist=twist, covariance=covariance.ravel())
    matrix = adjoint(rotation, shift)
    moved = transformed(message, with_covariance).covariance
    assert moved == pytest.approx((matrix @ covariance @ matrix.T).ravel(), abs=1e-10)

    wrench = Wrench(force=filled(Vector3(), first), torque=filled(Vector3(), second))
    pushed = transformed(message, WrenchStamped(wrench=wrench)).wrench
    power = float(first @ drawn())
    assert xyz(pushed.force) == pytest.approx(rotation.apply(first), abs=1e-12)
    assert xyz(pushed.torque) == pytest.approx(
        rotation.apply(second) + np.cross(shift, rotation.apply(first)), abs=1e-11
    )
    power = np.dot([*first, *second], [*xyz(twist.linear), *xyz(twist.angular)])
    after = np.dot([*xyz(pushed.force), *xyz(pushed.torque)], [*xyz(found.linear), *xyz(found.angular)])
    assert after == pytest.approx(power), "force times velocity is the same in every frame"


def test_what_is_none_of_these_is_refused(by: Any):
    with pytest.raises(TypeError, match="String: no pose, point, vector"):
        transformed(by[2], String())
