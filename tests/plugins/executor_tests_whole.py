"""A whole component in Python, and a resource, for architecture files."""

from std_msgs.msg import Float64

from mauve_rt.api import (
    Core,
    Fsm,
    Resource,
    Shell,
    call_port,
    ms_to_ns,
    parameter,
    property,  # noqa: A004 - a shell's, as in C++
    service,
    write_port,
)


class Meter(Resource):
    """Keeps the last numbers that it is told."""

    length = parameter(3, description="how many it keeps", minimum=1)

    def configure(self) -> None:
        """None yet."""
        self.kept: list[float] = []

    @service("executor_tests/Meter.note")
    def note(self, number: float) -> float:
        """Keep one, and tell the sum of those that are kept."""
        self.kept = [*self.kept, number][-self.length :]
        return sum(self.kept)


class LadderShell(Shell):
    """Ports and properties."""

    note = call_port("executor_tests/Meter.note")
    height = write_port(Float64)
    step = property(1.0)
    period_ms = property(10, minimum=1, structural="fsm")


class Ladder(Core[LadderShell]):
    """Goes up, step by step."""

    sign = 1.0

    def configure(self) -> None:
        """On the ground."""
        self.height = 0.0

    def adopt(self, old: object) -> bool:
        """Go on where the other one is."""
        if isinstance(old, Ladder):
            self.height = old.height
        return True

    def climb(self) -> None:
        """One step."""
        self.height += self.sign * self.shell.step.value
        self.shell.note(self.height)
        self.shell.height.write(Float64(data=self.height))


class DownLadder(Ladder):
    """Goes down."""

    sign = -1.0


class LadderFsm(Fsm[LadderShell, Ladder]):
    """A step a period."""

    def define(self) -> None:
        """Declare the machine."""
        climb = self.execution("Climb", Ladder.climb)
        rest = self.wait("Rest", ms_to_ns(self.shell.period_ms.value))
        self.set_initial(climb)
        self.next(climb, rest)
        self.next(rest, climb)


class RestlessFsm(LadderFsm):
    """The same, under another name."""


class NoPart:
    """Derived from nothing."""
