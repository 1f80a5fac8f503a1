"""A whole component in Python beside one in C++: a rover that the mission's Control drives.

    python -m mauve_examples.tutorials.python_component

The rover reads the command that Control writes, moves, and writes its pose, which Control reads; both know
the data by the type's name. Halfway its core is replaced by another one, while it runs.
"""

import math
import time

from geometry_msgs.msg import Point, Pose2D, Twist

from mauve_rt.api import (
    Architecture,
    Core,
    Deployer,
    Fsm,
    PluginRegistry,
    SharedData,
    Shell,
    ms_to_ns,
    property,  # noqa: A004 - a shell's, as in C++
    read_port,
    write_port,
)
from mauve_rt.model.plugins import PluginIndex, PluginLoader


class RoverShell(Shell):
    """Ports and properties: all that is seen from outside."""

    command = read_port(Twist)
    pose = write_port(Pose2D, on_stop="hold")
    target = write_port(Point, on_stop="hold")
    target_x = property(2.0, unit="m", description="where to go", minimum=-50.0, maximum=50.0)
    period_ms = property(10, unit="ms", description="of the motion", minimum=1, maximum=100, structural="fsm")


class RoverCore(Core[RoverShell]):
    """Data and algorithm: a unicycle without inertia."""

    def configure(self) -> None:
        """Stand at the origin."""
        self.x = self.y = self.heading = 0.0

    def adopt(self, old: object) -> bool:
        """Go on where the other core is; it must be one that knows."""
        if not isinstance(old, RoverCore):
            return False
        self.x, self.y, self.heading = old.x, old.y, old.heading
        return True

    def move(self) -> None:
        """One step of the motion."""
        step_s = self.shell.period_ns * 1e-9
        command = self.shell.command.read().value
        self.x += command.linear.x * math.cos(self.heading) * step_s
        self.y += command.linear.x * math.sin(self.heading) * step_s
        self.heading += command.angular.z * step_s

    def show(self) -> None:
        """Tell where the rover is and where it is to go."""
        self.shell.pose.write(Pose2D(x=self.x, y=self.y, theta=self.heading))
        self.shell.target.write(Point(x=self.shell.target_x.value))

    def is_there(self) -> bool:
        """Whether the target is near."""
        return abs(self.x - self.shell.target_x.value) < 0.1  # noqa: PLR2004 - of this one use


class SlipperyCore(RoverCore):
    """The same on wet ground: half of every step is lost."""

    def move(self) -> None:
        """One step of the motion."""
        x, y = self.x, self.y
        super().move()
        self.x, self.y = (self.x + x) / 2, (self.y + y) / 2


class RoverFsm(Fsm[RoverShell, RoverCore]):
    """Behaviour: move and show, period by period; at the target only show."""

    def define(self) -> None:
        """Declare the machine."""
        show = self.execution("Show", RoverCore.show)
        move = self.execution("Move", RoverCore.move, max_execution_ns=ms_to_ns(50))
        pause = self.wait("Pause", ms_to_ns(self.shell.period_ms.value))
        self.set_initial(show)
        self.transition(show, RoverCore.is_there, pause)
        self.next(show, move)
        self.next(move, pause)
        self.next(pause, show)


def make_architecture(registry: PluginRegistry) -> Architecture:
    """The rover in Python and Control in C++, connected by shared data of types that C++ registered."""
    loader = PluginLoader(registry, PluginIndex.installed())
    for kind, name in (("shell", "ControlShell"), ("core", "Control"), ("fsm", "ControlFsm")):
        loader.require(kind, f"mauve_examples/{name}")
    architecture = Architecture(registry)
    architecture.add_resource("pose", SharedData(Pose2D))
    architecture.add_resource("target", SharedData(Point))
    architecture.add_resource("command", SharedData(Twist))
    architecture.add_component("rover", RoverShell, RoverCore, RoverFsm, priority=40)
    architecture.add_component(
        "control",
        "mauve_examples/ControlShell",
        "mauve_examples/Control",
        "mauve_examples/ControlFsm",
        priority=50,
    )
    for port in ("pose", "target"):
        architecture.connect("rover", port, port, "write")
        architecture.connect("control", port, port, "read")
    architecture.connect("control", "command", "command", "write")
    architecture.connect("rover", "command", "command", "read")
    return architecture


def main() -> None:
    """Drive 2 m, on wet ground from the middle on."""
    architecture = make_architecture(PluginRegistry())
    architecture.configure()
    deployer = Deployer(architecture)
    deployer.deploy()
    try:
        while (x := architecture.component("rover").core.x) < 1.0:
            print(f"x = {x:.2f} m")
            time.sleep(0.2)
        report = deployer.replace_core("rover", SlipperyCore)
        print(f"wet ground from here: {report.missed_releases} releases missed")
        while not (core := architecture.component("rover").core).is_there():
            print(f"x = {core.x:.2f} m")
            time.sleep(0.2)
    finally:
        deployer.shutdown()


if __name__ == "__main__":
    main()
