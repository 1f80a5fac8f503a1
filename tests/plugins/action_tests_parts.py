"""Parts that execute and send goals, as those of executor_tests.cpp do; listed in action_tests.txt."""

from typing import Any

from std_msgs.msg import Float64

from mauve_msgs.action import DriveTo
from mauve_rt.api import (
    Core,
    GoalState,
    PeriodicFsm,
    Shell,
    action_client,
    action_server,
    ms_to_ns,
    read_port,
    write_port,
)


class EveryPeriod(PeriodicFsm[Any, Any]):
    """Calls act() every 10 ms."""

    def define(self) -> None:
        """Declare the states."""
        self.period(ms_to_ns(10))
        self.set_initial(self.periodic_state("Act", "act"))


class DriverShell(Shell):
    """Receives goals."""

    drive = action_server(DriveTo)


class Driver(Core[DriverShell]):
    """Drives along x by 1 m in each release, and reports how far it is."""

    state_fields = {"goal": "uint32", "driven": "float64"}  # noqa: RUF012

    def configure(self) -> None:
        """Begin with no goal."""
        self.goal = 0
        self.driven = 0.0

    def act(self) -> None:
        """Drive."""
        drive = self.shell.drive
        state, number = drive.state(), drive.number()
        if number == 0:
            return
        if number != self.goal:
            self.goal, self.driven = number, 0.0
        left = drive.goal().value.pose.pose.position.x - self.driven
        if state == GoalState.CANCELING:
            drive.cancel(DriveTo.Result(distance_m=left))
        elif left < 0.0:
            drive.abort(DriveTo.Result(distance_m=left))
        elif left == 0.0:
            drive.succeed(DriveTo.Result(reached=True))
        else:
            self.driven += 1.0
            drive.feedback(DriveTo.Feedback(distance_m=left - 1.0, elapsed_s=self.driven))


class Asleep(Core[DriverShell]):
    """Does not look at its goals."""

    def act(self) -> None:
        """Do nothing."""


class PassengerShell(Shell):
    """Sends goals."""

    wish = read_port(Float64)
    drive = action_client(DriveTo)
    said = write_port(Float64)


class Passenger(Core[PassengerShell]):
    """Sends the goals that it reads, one after another; writes its number, state and reason."""

    def act(self) -> None:
        """Look for a goal."""
        drive, wish = self.shell.drive, self.shell.wish.read()
        if wish.is_new and wish.value.data >= 0.0:
            goal = DriveTo.Goal()
            goal.pose.pose.position.x = wish.value.data
            drive.send(goal)
        elif wish.is_new:
            drive.cancel()
        code = drive.number() * 1000.0 + int(drive.state()) * 100.0 + int(drive.reason())
        self.shell.said.write(Float64(data=code))


class CounterShell(Shell):
    """Has no ports."""


class Counter(Core[CounterShell]):
    """Runs next to the others."""

    def act(self) -> None:
        """Do nothing."""
