"""A component in Python that reads values in its own frame: on threads and in virtual time."""

from typing import Any

from controller_chains import Execution
from geometry_msgs.msg import PointStamped
from python_parts import Stage
from running_host import Running

from mauve_msgs.srv import LookupTransform, SetTransform
from mauve_rt.api import (
    Core,
    SharedData,
    Shell,
    TransformTree,
    request_port,
    transformed_read_port,
    write_port,
)


class SensorShell(Shell):
    set_frame = request_port(SetTransform)
    seen = write_port(PointStamped)


class SensorCore(Core[SensorShell]):
    """Moves by 1 m at each release, and sees a thing that stands at x = 100 in the map."""

    def configure(self) -> None:
        self.moves = 0

    def act(self) -> None:
        self.moves += 1
        request = SetTransform.Request(parent="map", child="base", time_ns=self.shell.clock_ns)
        request.transform.translation.x = float(self.moves)
        self.shell.set_frame(request)
        seen = PointStamped()
        seen.header.frame_id = "base"
        seen.point.x = 100.0 - self.moves
        self.shell.seen.write(seen)


class MapShell(Shell):
    lookup = request_port(LookupTransform)
    thing = transformed_read_port(PointStamped, to="map", lookup=lookup)
    elsewhere = transformed_read_port(PointStamped, to="moon", lookup=lookup)
    same = transformed_read_port(PointStamped, to="base", lookup=lookup)


class MapCore(Core[MapShell]):
    def configure(self) -> None:
        self.found: list[Any] = []

    def act(self) -> None:
        self.found.append((self.shell.thing.read(), self.shell.elsewhere.read(), self.shell.same.read()))


def test_a_port_yields_values_in_its_own_frame_at_their_time(running: Running, log: list[Execution]):
    del log
    stage: Stage = running.stage
    stage.add("sensor", SensorShell, SensorCore)
    look = stage.add("look", MapShell, MapCore)
    stage.share("frames", TransformTree(frames=4, history=100), "sensor.set_frame.set", "look.lookup.lookup")
    stage.share(
        "seen",
        SharedData(PointStamped),
        *("sensor.seen.write", "look.thing.read", "look.elsewhere.read", "look.same.read"),
    )
    running.deploy()
    running.run_until(lambda: sum(bool(thing) for thing, _, _ in look.core.found) >= 5)
    for thing, elsewhere, same in look.core.found:
        if thing.status == "none":
            assert not thing
            continue
        assert (thing.outcome, thing.value.point.x, thing.value.header.frame_id) == ("done", 100.0, "map")
        assert not elsewhere
        assert (elsewhere.outcome, elsewhere.frame) == ("unknown frame", "moon")
        assert elsewhere.value == PointStamped()
        assert same
        assert same.value.header.frame_id == "base"
