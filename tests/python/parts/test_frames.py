"""Frames of ports and resources from Python, on threads and in virtual time."""

from collections.abc import Callable, Iterator
from typing import Any

import pytest
from geometry_msgs.msg import Point, PoseStamped
from nav_msgs.msg import Odometry
from python_parts import ActFsm, IdleCore, Stage

from mauve_rt.api import Core, MauveError, SharedData, Shell, Simulation, Transaction, read_port, write_port
from mauve_rt.parts.messages import serialize


class OdometryShell(Shell):
    out = write_port(Odometry, frame="odom", child_frame="base", optional=True)


class OdometryCore(Core[OdometryShell]):
    """Writes one message without a frame, then others in a wrong one."""

    def configure(self) -> None:
        self.message = Odometry()
        self.written: list[bool] = []

    def act(self) -> None:
        self.written.append(self.shell.out.write(self.message))
        self.message.child_frame_id = "laser"


class MapShell(Shell):
    heard = read_port(Odometry, frame="map", optional=True)
    plain = read_port(Odometry, optional=True)


class MapCore(Core[MapShell]):
    def configure(self) -> None:
        self.values: list[Any] = []

    def act(self) -> None:
        sample = self.shell.plain.read()
        if sample.is_new:
            self.values.append(sample.value)


@pytest.fixture
def framed(built: Stage) -> Stage:
    built.add("source", OdometryShell, OdometryCore)
    built.add("sink", MapShell, MapCore)
    built.architecture.add_resource("odometry", SharedData(Odometry))
    built.architecture.add_resource("pose", SharedData(PoseStamped), frame="map")
    return built


@pytest.fixture(params=["threads", "virtual time"])
def host(request: pytest.FixtureRequest, framed: Stage) -> Iterator[Callable[[], Any]]:
    """Deploys at the first call, and lets the components run for at least 5 releases."""
    if request.param == "threads":

        def run() -> Any:
            deployer = framed.deployer or framed.deploy()
            core = framed.architecture.component("source").core
            count = len(core.written) + 5
            framed.until(lambda: len(core.written) > count)
            return deployer

        yield run
        return
    simulation = Simulation()
    hosts: list[Any] = []

    def advance() -> Any:
        if not hosts:
            framed.architecture.configure()
            hosts.append(simulation.add(framed.architecture))
            simulation.deploy()
        simulation.run_until(simulation.now_ns() + 30_000_000)
        return hosts[0]

    yield advance
    simulation.shutdown()


def connect(framed: Stage, *places: str) -> None:
    for place in places:
        framed.architecture.connect(*place.split())


def test_a_message_gets_the_declared_frames_and_another_one_is_refused(
    framed: Stage, host: Callable[[], Any]
) -> None:
    connect(framed, "source out odometry write", "sink plain odometry read")
    host()
    host()
    source, sink = (framed.architecture.component(name).core for name in ("source", "sink"))
    assert source.written[0]
    assert not any(source.written[1:])
    assert (source.message.header.frame_id, source.message.child_frame_id) == ("", "laser")
    assert [(value.header.frame_id, value.child_frame_id) for value in sink.values] == [("odom", "base")]
    resource = next(each for each in framed.architecture.resources() if each.name == "odometry")
    assert resource.refused_values >= 1
    assert resource.why_refused_value == "child_frame_id is 'laser', expected 'base'"


def test_a_transaction_between_different_frames_is_refused(framed: Stage, host: Callable[[], Any]) -> None:
    connect(framed, "source out odometry write")
    deployed = host()
    with pytest.raises(MauveError, match=r"port heard: .*found frame odom of port source\.out") as caught:
        deployed.commit(Transaction().connect("sink", "heard", "odometry", "read"))
    assert caught.value.code == "frame_mismatch"
    deployed.commit(Transaction().connect("sink", "plain", "odometry", "read"))


def test_a_resource_in_another_frame_is_not_connected(framed: Stage) -> None:
    framed.architecture.add_resource("raw", SharedData(Odometry), frame="odom", child_frame="laser")
    with pytest.raises(MauveError, match="expected child_frame base") as caught:
        connect(framed, "source out raw write")
    assert caught.value.code == "frame_mismatch"


def test_of_a_type_without_a_header_connections_are_checked(framed: Stage) -> None:
    class PointShell(Shell):
        out = write_port(Point, frame="odom", optional=True)

    framed.add("point", PointShell, IdleCore)
    framed.architecture.add_resource("in_map", SharedData(Point), frame="map")
    framed.architecture.add_resource("in_odom", SharedData(Point), frame="odom")
    with pytest.raises(MauveError, match="different frames"):
        connect(framed, "point out in_map write")
    connect(framed, "point out in_odom write")
    assert framed.deploy().write_resource("in_odom", serialize(Point(x=1.0)))


def test_frames_are_described(framed: Stage) -> None:
    ports = framed.describe("source").ports
    assert [(port.frame, port.child_frame) for port in ports] == [("odom", "base")]
    resources = {each.name: (each.frame, each.child_frame) for each in framed.architecture.resources()}
    assert resources == {"odometry": ("", ""), "pose": ("map", "")}


def test_a_bad_name_is_refused(built: Stage) -> None:
    class BadShell(Shell):
        out = write_port(Odometry, frame="/odom", optional=True)

    with pytest.raises(MauveError, match="no slash at the begin, found '/odom'"):
        built.add("source", BadShell, OdometryCore, ActFsm)
