"""The ports of a component that executes or sends the goals of an action, as one member of its shell."""

from typing import Any, Generic, Protocol, Self, TypeVar

from mauve_rt._kernel import GoalReason, GoalState, ShellBuilder, ShellView
from mauve_rt.parts import messages
from mauve_rt.parts.ports import Member, ReadPort, Sample, WritePort

__all__ = ["ActionClientPorts", "ActionServerPorts", "ActionType"]

G = TypeVar("G")
R = TypeVar("R")
F = TypeVar("F")
G_co = TypeVar("G_co", covariant=True)
R_co = TypeVar("R_co", covariant=True)
F_co = TypeVar("F_co", covariant=True)
_GOAL = "mauve_msgs/msg/ActionGoal"


class ActionType(Protocol[G_co, R_co, F_co]):
    """A class of a ROS action."""

    @property
    def Goal(self) -> type[G_co]:  # noqa: N802 - its name in ROS
        """The class of goals."""

    @property
    def Result(self) -> type[R_co]:  # noqa: N802
        """The class of results."""

    @property
    def Feedback(self) -> type[F_co]:  # noqa: N802
        """The class of feedback."""


class _ActionPorts(Member, Generic[G, R, F]):
    """Ports named after the member: NAME_status, NAME_goal, NAME_decide, NAME_feedback, NAME_result."""

    def __init__(self, action: ActionType[G, R, F]) -> None:
        super().__init__()
        messages.action_name(action)
        self.action = action
        self._status = ReadPort[Any](_GOAL)
        self._decide = WritePort[Any](_GOAL)

    def __copy__(self) -> Self:
        """One of another component: with ports of its own."""
        made = type(self)(self.action)
        made.name = self.name
        return made

    @property
    def ports(self) -> dict[str, ReadPort[Any] | WritePort[Any]]:
        """The ports by the names of the services that they connect to."""
        own = {name: port for name, port in vars(self).items() if isinstance(port, ReadPort | WritePort)}
        return {name.removeprefix("_"): port for name, port in own.items()}

    def declare(self, builder: ShellBuilder) -> None:
        """Tell the kernel."""
        for service, port in self.ports.items():
            port.name = f"{self.name}_{service}"
            port.declare(builder)

    def bind(self, view: ShellView) -> None:
        """Take the component's shell."""
        super().bind(view)
        for port in self.ports.values():
            port.bind(view)

    def state(self) -> GoalState:
        """The state of the goal; UNKNOWN: there is none, or it is not answered."""
        return GoalState(self._status.read().value.state)

    def number(self) -> int:
        """The number of the goal, from 1 on; 0: there is none."""
        return int(self._status.read().value.number)

    def _decided(self, state: GoalState) -> bool:
        return self._decide.write(self._decide.message_class(state=int(state)))


class ActionServerPorts(_ActionPorts[G, R, F]):
    """Ports to an `ActionServer`, and what a core does with its current goal.

    A replaced core goes on with the goal. A stop aborts all goals. `state()` and `number()` accept the goals
    that wait for an answer.
    """

    def __init__(self, action: ActionType[G, R, F]) -> None:
        super().__init__(action)
        self._goal = ReadPort[G](action.Goal)
        self._feedback = WritePort[F](action.Feedback)
        self._result = WritePort[R](action.Result)

    def goal(self) -> Sample[G]:
        """The current goal; status "none": there is none."""
        return self._goal.read()

    def feedback(self, value: F) -> bool:
        """Report how far the current goal is; False: the message is larger than `max_bytes`."""
        return self._feedback.write(value)

    def succeed(self, result: R | None = None) -> bool:
        """End the current goal as reached; False: there is none, or the result is larger than `max_bytes`."""
        return self._end(GoalState.SUCCEEDED, result)

    def abort(self, result: R | None = None) -> bool:
        """End the current goal as not reached; False as of `succeed`."""
        return self._end(GoalState.ABORTED, result)

    def cancel(self, result: R | None = None) -> bool:
        """End the current goal, whose state is CANCELING; False as of `succeed`."""
        return self._end(GoalState.CANCELED, result)

    def _end(self, state: GoalState, result: R | None) -> bool:
        reached = self._result.message_class() if result is None else result
        return self._result.write(reached) and self._decided(state)


class ActionClientPorts(_ActionPorts[G, R, F]):
    """Ports to an `ActionClient`, and what a core does with them."""

    def __init__(self, action: ActionType[G, R, F]) -> None:
        super().__init__(action)
        self._goal = WritePort[G](action.Goal)
        self._feedback = ReadPort[F](action.Feedback)
        self._result = ReadPort[R](action.Result)

    def send(self, goal: G) -> bool:
        """Send a goal; False: the one before has not ended, or the goal is larger than `max_bytes`."""
        return self._goal.write(goal)

    def cancel(self) -> None:
        """Ask to cancel the goal."""
        self._decided(GoalState.CANCELING)

    def reason(self) -> GoalReason:
        """Why the goal ended without a decision of the server."""
        return GoalReason(self._status.read().value.reason)

    def feedback(self) -> Sample[F]:
        """The latest feedback about the goal."""
        return self._feedback.read()

    def result(self) -> Sample[R]:
        """The result; status "none": the goal has not ended, or has no result."""
        return self._result.read()
