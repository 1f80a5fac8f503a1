"""Open changes as messages of mauve_msgs."""

from collections.abc import Iterable
from typing import Any

from mauve_msgs.msg import LateComponent, OpenChange
from mauve_rt._kernel import OpenChange as OpenChangeFacts
from mauve_rt.control.checks import MAX_TEXT
from mauve_rt.control.runtime import Runtime
from mauve_rt.file_schema.words import cut

PHASES = {OpenChange.PREPARING: "preparing", OpenChange.WAITING: "waiting", OpenChange.MADE: "made"}
_NUMBERS = {name: number for number, name in PHASES.items()}


def open_change_messages(changes: Iterable[OpenChangeFacts], runtime: Runtime) -> list[Any]:
    """OpenChange of each; there is a host where there is a change."""
    return [open_change_message(change, runtime.host.now_ns()) for change in changes]


def open_change_message(change: OpenChangeFacts, now_ns: int) -> Any:
    """OpenChange, as of that time of the host."""
    return OpenChange(
        author=cut(change.author, MAX_TEXT),
        steps=[cut(step, MAX_TEXT) for step in change.steps],
        begun_ns=change.begun_ns,
        age_ns=max(now_ns - change.begun_ns, 0),
        phase=_NUMBERS[change.phase],
        instant_ns=change.instant_ns,
        hook=cut(change.hook, MAX_TEXT),
        hook_age_ns=change.hook_age_ns,
        late=[
            LateComponent(
                name=late.name,
                state=late.state,
                state_age_ns=late.state_age_ns,
                waiting=late.waiting,
                left_behind=late.left_behind,
            )
            for late in change.late
        ],
    )
