"""Components in Python that set and look up frames of a transform_tree: on threads and in virtual time."""

from typing import Any

import numpy as np
import pytest
from controller_chains import Execution
from python_parts import ActFsm, IdleCore, Stage
from running_host import Running

from mauve_msgs.msg import TransformOutcome
from mauve_msgs.srv import LookupTransform, SetTransform
from mauve_rt.api import Core, MauveError, Shell, TransformTree, request_port


class OdometryShell(Shell):
    set_frame = request_port(SetTransform)


class OdometryCore(Core[OdometryShell]):
    """Moves the base by 1 m at each release."""

    def configure(self) -> None:
        self.moves = 0
        self.times_ns: list[int] = []  # of the moves
        self.outcomes: set[int] = set()

    def act(self) -> None:
        self.moves += 1
        request = SetTransform.Request(parent="map", child="base", time_ns=self.shell.clock_ns)
        request.transform.translation.x = float(self.moves)
        self.times_ns.append(request.time_ns)
        self.outcomes.add(self.shell.set_frame(request).outcome)


class LookShell(Shell):
    lookup = request_port(LookupTransform)


class LookCore(Core[LookShell]):
    """Looks where the base was 1 ms ago, between two moves."""

    def configure(self) -> None:
        self.found: list[Any] = []
        self.times_ns: list[int] = []  # that were asked for

    def act(self) -> None:
        request = LookupTransform.Request(
            target="map", source="base", time_ns=self.shell.clock_ns - 1_000_000
        )
        self.found.append(self.shell.lookup(request))
        self.times_ns.append(request.time_ns)


def test_a_component_looks_up_what_another_one_sets(running: Running, log: list[Execution]):
    del log
    stage = running.stage
    odometry = stage.add("odometry", OdometryShell, OdometryCore)
    look = stage.add("look", LookShell, LookCore)
    stage.share(
        "frames", TransformTree(frames=4, history=100), "odometry.set_frame.set", "look.lookup.lookup"
    )
    running.deploy()
    running.run_until(lambda: sum(each.outcome == TransformOutcome.DONE for each in look.core.found) >= 5)
    assert odometry.core.outcomes == {TransformOutcome.DONE}
    moves = odometry.core.times_ns  # a busy computer may leave some out
    for time_ns, each in zip(look.core.times_ns, look.core.found, strict=False):
        if each.outcome == TransformOutcome.DONE:
            expected = np.interp(time_ns, moves, range(1, len(moves) + 1))
            assert each.transform.translation.x == pytest.approx(expected, abs=1e-9)


def test_outcomes_are_those_of_the_message(running: Running, log: list[Execution]):
    del log
    asked: list[Any] = []

    class Ask(Core[LookShell]):
        def act(self) -> None:
            asked.append(self.shell.lookup(LookupTransform.Request(target="moon", source="base")))

    running.stage.add("ask", LookShell, Ask)
    running.stage.share("frames", TransformTree(), "ask.lookup.lookup")
    running.deploy()
    running.run_until(lambda: asked)
    assert (asked[0].outcome, asked[0].frame) == (TransformOutcome.UNKNOWN_FRAME, "moon")


def test_a_request_port_takes_the_name_of_a_service():
    assert request_port("mauve_msgs/srv/SetTransform").service is SetTransform
    with pytest.raises(TypeError, match="found 'mauve_msgs/srv/Nothing'"):
        request_port("mauve_msgs/srv/Nothing")


def test_a_request_port_takes_its_own_service_alone():
    with Stage() as stage:
        stage.add("look", LookShell, IdleCore, ActFsm)
        stage.architecture.add_resource("frames", TransformTree())
        with pytest.raises(MauveError, match="does not fit") as refused:
            stage.architecture.connect("look", "lookup", "frames", "set")
        assert refused.value.code == "type_mismatch"
    with pytest.raises(TypeError, match="expected a class of a ROS service"):
        request_port(LookupTransform.Request)


def test_sizes_are_checked():
    with Stage() as stage, pytest.raises(MauveError, match="frames") as refused:
        stage.architecture.add_resource("frames", TransformTree(frames=1))
    assert refused.value.code == "out_of_range"
