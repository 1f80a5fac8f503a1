"""The elements of joints, in virtual time: a differential drive, and the interpolation of a trajectory."""

import math
import time
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import Twist, Vector3
from nav_msgs.msg import Odometry
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint
from waiting import wait_until

from mauve_rt._kernel import (
    Architecture,
    Deployer,
    MauveError,
    PluginRegistry,
    Simulation,
    Transaction,
    allocation_counting,
)
from mauve_rt.model import build, configure, load_architecture
from mauve_rt.trace.format.records import RECORD, Kind

MS = 1_000_000
PERIOD_S = 0.01
JOINTS = ["shoulder", "elbow"]
TEXT = """\
mauve: 1
components:
  element:
    shell: mauve_rt/{element}Shell
    core: mauve_rt/{element}
    fsm: mauve_rt/{element}Fsm
    alternatives: [mauve_rt/{element}]
    properties: {{{properties}}}
resources:
  before: {{kind: shared_data, type: {before}}}
  after: {{kind: shared_data, type: {after}}}
connections:
  - [element.input, before.read]
  - [element.output, after.write]
"""
STATE = "sensor_msgs/msg/JointState, capacity: {name: 2, position: 2, velocity: 2, effort: 1}"
TRAJECTORY = (
    "trajectory_msgs/msg/JointTrajectory, capacity: {joint_names: 2, points: 4, points.positions: 2,"
    " points.velocities: 2, points.accelerations: 2, points.effort: 1}"
)


def configured(folder: Path, element: str, before: str, after: str, properties: str = "") -> Architecture:
    """Make an architecture of one element, with a resource at each port."""
    file = folder / "robot.yaml"
    text = TEXT.format(element=element, before=before, after=after, properties=properties)
    file.write_text(text, encoding="utf-8")
    model = load_architecture(file)
    architecture = build(model, PluginRegistry())
    configure(model, architecture)
    return architecture


class Running:
    """One element of a period of 10 ms in a simulation, with a resource at each port."""

    def __init__(self, folder: Path, element: str, before: str, after: str, properties: str = "") -> None:
        self.simulation = Simulation()
        self.host = self.simulation.add(configured(folder, element, before, after, properties))
        self.simulation.deploy()
        self.simulation.run_until(self.simulation.epoch_ns())

    def write(self, message: Any) -> None:
        assert self.host.write_resource("before", serialize_message(message))

    def run(self, periods: int = 1) -> None:
        self.simulation.run_until(self.simulation.now_ns() + periods * 10 * MS)

    def read(self, message_type: type) -> tuple[Any, int]:
        """Return the newest output, and how many there were."""
        data, count, _ = self.host.read_resource("after")
        return deserialize_message(data, message_type), count

    def replace_core(self, element: str) -> None:
        change = Transaction().replace_core("element", f"mauve_rt/{element}")
        self.simulation.at(self.simulation.now_ns() + 5 * MS, lambda: self.host.commit(change))


def test_a_twist_is_turned_into_velocities_of_the_wheels_until_it_is_too_old(tmp_path: Path) -> None:
    properties = "wheel_radius_m: 0.2, wheel_separation_m: 0.6, left_joint: l, right_joint: r, max_age_ms: 50"
    running = Running(tmp_path, "DifferentialDriveCommand", "geometry_msgs/msg/Twist", STATE, properties)
    running.run(3)
    assert running.read(JointState)[1] == 0
    running.write(Twist(linear=Vector3(x=0.5), angular=Vector3(z=1.0)))
    running.run(4)
    state, count = running.read(JointState)
    assert (state.name, count) == (["l", "r"], 4)
    assert list(state.velocity) == pytest.approx([(0.5 - 0.3) / 0.2, (0.5 + 0.3) / 0.2])
    running.run(20)
    state, count = running.read(JointState)
    assert (state.name, list(state.velocity), count) == (["l", "r"], [0.0, 0.0], 6)


def wheels(left: float, right: float, velocity: Sequence[float] = ()) -> JointState:
    state = JointState(name=["r", "l"], position=[right, left], velocity=list(velocity))
    state.header.stamp.sec = 7
    return state


def pose_of(odometry: Odometry) -> tuple[float, float, float]:
    pose = odometry.pose.pose
    assert pose.orientation.x == pose.orientation.y == pose.position.z == 0.0
    return (pose.position.x, pose.position.y, 2 * math.atan2(pose.orientation.z, pose.orientation.w))


def test_the_odometry_follows_arcs_and_goes_on_with_another_core(tmp_path: Path) -> None:
    properties = "wheel_radius_m: 0.2, wheel_separation_m: 0.5, left_joint: l, right_joint: r, frame_id: o"
    after = "nav_msgs/msg/Odometry"
    running = Running(tmp_path, "DifferentialDriveOdometry", STATE, after, properties)
    running.write(wheels(100.0, -50.0))
    running.run()
    odometry, count = running.read(Odometry)
    assert (pose_of(odometry), count) == ((0.0, 0.0, 0.0), 1)
    assert (odometry.header.frame_id, odometry.child_frame_id) == ("o", "base_link")
    assert odometry.header.stamp.sec == 7
    # A quarter of a circle of 1 m to the left: 0.75 m and 1.25 m of the wheels.
    left, right = 100.0 + 0.75 * math.pi / 2 / 0.2, -50.0 + 1.25 * math.pi / 2 / 0.2
    running.write(wheels(left, right))
    running.run(5)
    odometry, count = running.read(Odometry)
    assert pose_of(odometry) == pytest.approx((1.0, 1.0, math.pi / 2))
    assert count == 2, "one for each input"
    assert odometry.twist.twist.linear.x == pytest.approx(math.pi / 2 / PERIOD_S)
    assert odometry.twist.twist.angular.z == pytest.approx(math.pi / 2 / PERIOD_S)
    running.replace_core("DifferentialDriveOdometry")
    running.run(3)
    running.write(wheels(left + 5.0, right + 5.0, velocity=[2.0, 1.0]))
    running.run()
    odometry, count = running.read(Odometry)
    assert pose_of(odometry) == pytest.approx((1.0, 2.0, math.pi / 2))
    assert odometry.twist.twist.linear.x == pytest.approx(0.2 * 1.5)
    assert odometry.twist.twist.angular.z == pytest.approx(0.2 * 1.0 / 0.5)
    running.write(JointState(name=["l"], position=[1.0]))
    running.run(3)
    assert running.read(Odometry)[1] == count, "a message without both wheels is none"


def trajectory(points: Iterable[tuple[Any, ...]], names: Sequence[str] = JOINTS) -> JointTrajectory:
    """Of points (time in s, positions, velocities, accelerations), of which the last ones may be left out."""
    message = JointTrajectory(joint_names=list(names))
    for time_s, *values in points:
        point = JointTrajectoryPoint(
            **dict(zip(("positions", "velocities", "accelerations"), values, strict=False))
        )
        point.time_from_start.nanosec = round(time_s % 1 * 1e9)
        point.time_from_start.sec = int(time_s)
        message.points.append(point)
    return message


class Arm(Running):
    """The interpolation of a trajectory of two joints."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder, "JointTrajectory", TRAJECTORY, STATE)

    def start(self, *points: tuple[Any, ...], names: Sequence[str] = JOINTS, stamp_ns: int = 0) -> None:
        """Write a trajectory, and let its first period pass."""
        message = trajectory(points, names)
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp_ns, 1_000_000_000)
        self.write(message)
        self.run()

    def motion(self) -> list[float]:
        """Positions, then velocities."""
        state, _ = self.read(JointState)
        assert state.name == JOINTS
        return [*state.position, *state.velocity]

    def written(self) -> int:
        return self.read(JointState)[1]


@pytest.fixture
def arm(tmp_path: Path) -> Arm:
    return Arm(tmp_path)


# Of x(t) = t^n and 2 - x(t) the spline of the order n - 1 or more is exact.
@pytest.mark.parametrize(("derivatives", "power"), [(0, 1), (1, 3), (2, 5)])
def test_points_are_joined_by_the_spline_of_what_they_carry(arm: Arm, derivatives: int, power: int) -> None:
    def point(time_s: float) -> tuple[Any, ...]:
        x = time_s**power
        v = power * time_s ** (power - 1)
        a = power * (power - 1) * time_s ** max(power - 2, 0)
        return (time_s, *([[x, 2 - x], [v, -v], [a, -a]][: derivatives + 1]))

    arm.start(point(0.0), point(0.5), point(1.0))
    for n in range(100):
        at_s = n * PERIOD_S
        x, v = at_s**power, power * at_s ** (power - 1)
        assert arm.motion() == pytest.approx([x, 2 - x, v, -v], abs=1e-9), at_s
        arm.run()
    arm.run(5)
    assert arm.motion() == pytest.approx([1.0, 1.0, 0.0, 0.0]), "it holds the last point"


def test_a_new_trajectory_begins_where_the_joints_are(arm: Arm) -> None:
    arm.start((0.0, [0.0, 0.0], [0.0, 0.0]), (1.0, [1.0, -1.0], [0.0, 0.0]))
    arm.run(30)
    s = 0.3
    before = 3 * s**2 - 2 * s**3
    assert arm.motion()[:2] == pytest.approx([before, -before])
    # Its points are of the other order of joints; that at 0 lies elsewhere, and is passed over.
    arm.start((0.0, [5.0, 6.0], [0.0, 0.0]), (1.0, [2.0, 3.0], [0.0, 0.0]), names=JOINTS[::-1])
    s = 0.31
    begin, velocity = 3 * s**2 - 2 * s**3, 6 * s - 6 * s**2
    assert arm.motion() == pytest.approx([begin, -begin, velocity, -velocity])
    arm.run(50)
    # The cubic from (begin, velocity) to (end, 0) at its middle.
    middle = [(p + end) / 2 + v / 8 for p, end, v in ((begin, 3.0, velocity), (-begin, 2.0, -velocity))]
    assert arm.motion()[:2] == pytest.approx(middle)
    arm.run(60)
    assert arm.motion() == pytest.approx([3.0, 2.0, 0.0, 0.0])


def test_another_core_goes_on_with_the_trajectory(arm: Arm) -> None:
    arm.start((0.0, [0.0, 1.0]), (1.0, [1.0, 0.0]))
    arm.run(20)
    arm.replace_core("JointTrajectory")
    arm.run(10)
    assert arm.motion()[:2] == pytest.approx([0.3, 0.7])


def test_a_trajectory_begins_at_its_stamp(arm: Arm) -> None:
    arm.start((0.0, [1.0, 1.0]), (0.1, [2.0, 2.0]))
    arm.run(20)
    hour_ns = 3600 * 1_000_000_000
    arm.start((0.0, [5.0, 5.0]), (0.1, [9.0, 9.0]), stamp_ns=time.time_ns() + hour_ns)
    arm.run(50)
    assert arm.motion()[:2] == [2.0, 2.0]
    # One of an hour ago that lasts two is about at its middle, and begins where the joints are.
    arm.start((7200.0, [4.0, 4.0]), stamp_ns=time.time_ns() - hour_ns)
    assert arm.motion()[:2] == pytest.approx([2.0, 2.0], abs=1e-3)
    arm.run(100)
    assert arm.motion()[2] == pytest.approx(2.0 / 3600, rel=0.1)


@pytest.mark.parametrize(
    ("reason", "bad"),
    [
        ("joints", trajectory([(0.5, [1.0])], ["shoulder"])),
        ("joints", trajectory([(0.5, [1.0, 2.0])], ["shoulder", "wrist"])),
        ("joints", trajectory([(0.5, [1.0, 2.0])], ["shoulder", "shoulder"])),
        ("points", trajectory([])),
        ("points", trajectory([(0.5, [1.0])])),
        ("points", trajectory([(0.5, [1.0, math.nan])])),
        ("points", trajectory([(0.5, [1.0, 2.0], [1.0])])),
        ("points", trajectory([(0.5, [1.0, 2.0]), (0.5, [2.0, 1.0])])),
        ("points", trajectory([(-1.5, [1.0, 2.0]), (0.5, [2.0, 1.0])])),
        ("it is over", trajectory([(0.0, [1.0, 2.0])])),
    ],
)
def test_a_bad_trajectory_is_refused_and_the_one_before_goes_on(
    arm: Arm, reason: str, bad: JointTrajectory
) -> None:
    arm.start((0.0, [0.0, 1.0]), (1.0, [1.0, 0.0]))
    arm.write(bad)
    arm.run(50)
    assert arm.motion()[:2] == pytest.approx([0.5, 0.5])
    records = np.frombuffer(arm.host.drain_trace().records, RECORD)
    marks = [arm.host.trace_names()[name] for name in records["name"][records["kind"] == Kind.MARK]]
    assert marks == [f"refused trajectory: {reason}"]


def test_a_first_trajectory_may_not_name_a_joint_twice(arm: Arm) -> None:
    arm.start((0.5, [1.0, 2.0]), names=["elbow", "elbow"])
    arm.run(10)
    assert arm.written() == 0


def test_a_first_trajectory_begins_at_its_first_point(arm: Arm) -> None:
    arm.start((0.05, [1.0, 2.0]), (0.1, [2.0, 2.0]))
    assert arm.motion() == [1.0, 2.0, 0.0, 0.0]
    arm.run(5)
    assert arm.motion() == [1.0, 2.0, 20.0, 0.0]


def test_an_output_with_too_little_room_is_refused(tmp_path: Path) -> None:
    small = STATE.replace("velocity: 2", "velocity: 1")
    with pytest.raises(MauveError, match=r"too little room.*expected a capacity of at least 2.*found 1"):
        Running(tmp_path, "JointTrajectory", TRAJECTORY, small)


@pytest.mark.skipif(allocation_counting() == "none", reason="built with a sanitizer")
@pytest.mark.parametrize(
    ("element", "before", "after", "message"),
    [
        ("DifferentialDriveCommand", "geometry_msgs/msg/Twist", STATE, Twist(linear=Vector3(x=0.5))),
        (
            "DifferentialDriveOdometry",
            STATE,
            "nav_msgs/msg/Odometry",
            JointState(name=["left_wheel_joint", "right_wheel_joint"], position=[1.0, 2.0]),
        ),
        ("JointTrajectory", TRAJECTORY, STATE, trajectory([(0.02, [1.0, 2.0]), (0.05, [2.0, 1.0])])),
    ],
)
def test_the_elements_allocate_nothing_on_their_threads(
    tmp_path: Path, element: str, before: str, after: str, message: Any
) -> None:
    architecture = configured(tmp_path, element, before, after, "period_us: 1000")
    deployer = Deployer(architecture)
    deployer.deploy()
    try:
        for count in range(1, 4):
            assert deployer.write_resource("before", serialize_message(message))
            wait_until(lambda count=count: deployer.read_resource("after")[1] >= count)
        deployer.replace_core("element", f"mauve_rt/{element}")
        releases = architecture.components()[0].releases
        wait_until(lambda: architecture.components()[0].releases > releases + 2)
        deployer.stop("element")
        assert architecture.components()[0].allocations == 0
    finally:
        deployer.shutdown()
