"""A component in Python over the message that leg.hpp declares: writes how far the foot is."""

from mauve_downstream.msg import Leg
from std_msgs.msg import Float64

from mauve_rt.api import Core, Fsm, Shell, ms_to_ns, read_port, write_port


class Watch(Shell):
    """Reads the leg."""

    leg = read_port(Leg)
    distance = write_port(Float64)


class Watching(Core[Watch]):
    """Writes the distance at each new leg."""

    def act(self) -> None:
        """Once."""
        sample = self.shell.leg.read()
        if sample.is_new:
            self.shell.distance.write(Float64(data=sample.value.foot.x))


class WatchFsm(Fsm[Watch, Watching]):
    """Every 10 ms."""

    def define(self) -> None:
        """Declare the two states."""
        act = self.execution("Watch", Watching.act)
        pause = self.wait("Pause", ms_to_ns(10))
        self.set_initial(act)
        self.next(act, pause)
        self.next(pause, act)
