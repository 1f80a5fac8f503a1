"""Goals of an `ActionServer` without ROS, for tests and programs: asked for, canceled and followed."""

from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from mauve_rt._kernel import GoalReason, GoalState, Host
from mauve_rt.parts import messages
from mauve_rt.parts.action_ports import ActionType

__all__ = ["GoalEvent", "GoalSender"]

G = TypeVar("G")
R = TypeVar("R")
F = TypeVar("F")


@dataclass(frozen=True)
class GoalEvent(Generic[R, F]):
    """Another state of a goal, or feedback about the goal."""

    goal: int  # as GoalSender.ask() returned it
    state: GoalState
    reason: GoalReason
    feedback: F | None = None  # None: it is another state
    result: R | None = None  # None: the goal has not ended


class GoalSender(Generic[G, R, F]):
    """Sends goals to an `ActionServer` of a host, as a client of the action does; one for each resource.

        drive = GoalSender(host, "drive", DriveTo)
        goal = drive.ask(DriveTo.Goal())
        simulation.run_until(...)
        assert drive.events()[-1].state == GoalState.SUCCEEDED

    In virtual time, or on threads where no ROS action is bound to the resource.
    """

    def __init__(self, host: Host, resource: str, action: ActionType[G, R, F]) -> None:
        """Of a resource of the host.

        Raises:
            TypeError: no class of a ROS action.
        """
        messages.action_name(action)
        self._host, self._resource, self._action = host, resource, action
        self._rejected: list[GoalEvent[R, F]] = []

    def ask(self, goal: G) -> int:
        """Ask for a goal; its number, for `events` and `cancel`.

        Raises:
            TypeError: a goal of another type.
            MauveError: there is no such resource, or it is of another kind.
        """
        if not isinstance(goal, self._action.Goal):
            expected = messages.type_name(self._action.Goal)
            raise TypeError(f"resource '{self._resource}': expected {expected}, found {goal!r}")
        number, reason = self._host.ask_goal(self._resource, messages.serialize(goal))
        if reason != GoalReason.NONE:
            self._rejected.append(GoalEvent(number, GoalState.REJECTED, reason))
        return number

    def cancel(self, goal: int) -> bool:
        """Ask to cancel a goal; False: the goal is not accepted, or has ended."""
        return self._host.cancel_goal(self._resource, goal)

    def events(self) -> list[GoalEvent[R, F]]:
        """What became of the goals since the last call; states in between may be missing."""
        found, self._rejected = self._rejected, []
        while (data := self._host.next_event(self._resource)) is not None:
            feedback, result = (
                _read(data.feedback, self._action.Feedback),
                _read(data.result, self._action.Result),
            )
            found.append(GoalEvent(data.goal, data.state, data.reason, feedback, result))
        return found


def _read(data: bytes | None, of_class: Any) -> Any:
    return None if data is None else messages.deserialize(data, of_class)
