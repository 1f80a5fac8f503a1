"""The shadows of an executor's components as messages for its bag."""

from collections.abc import Callable, Sequence
from copy import copy
from typing import Any, NamedTuple

from mauve_msgs.msg import Shadow
from mauve_rt.control.runtime import Runtime
from mauve_rt.interfaces.descriptions import shadow_message
from mauve_rt.trace.bag.recorded import SentMessage

_PERIOD_NS = 1_000_000_000
_PERIOD_AFTER_END_NS = 200_000_000


class _Recorded(NamedTuple):
    message: Any
    data: bytes
    time_ns: int


class RecordedShadows:
    """A source of messages for a recorder. All but `finish` for one thread.

    A shadow that runs has a message once a second, and one more after its end. While the curves of its
    outputs go on after that, it has five a second at most. A shadow that ends and is replaced between two
    calls of take_messages() has no message after its end.
    """

    def __init__(self, runtime: Runtime, node_name: str, serialize: Callable[[Any], bytes]) -> None:
        """`node_name`: the executor's; `serialize`: makes CDR of a message."""
        self._runtime = runtime
        self._topic = f"{node_name}/shadow"
        self._serialize = serialize
        self._seen: dict[str, Any] = {}  # by component, as of the last call
        self._recorded: dict[str, _Recorded] = {}  # by component
        self._is_finishing = False

    def keep_messages(self, *, on: bool) -> None:
        """Begin with the shadows that run now: a shadow that has ended is not of this bag."""
        if on:
            ended = {name: one for name, one in self._found().items() if one.verdict != Shadow.RUNNING}
            self._recorded = {
                name: _Recorded(message, self._serialize(message), 0) for name, message in ended.items()
            }

    def finish(self) -> None:
        """Give the present figures with each take_messages() from now on: the recording ends. Any thread."""
        self._is_finishing = True

    def take_messages(self) -> Sequence[SentMessage]:
        """What is due since the last call."""
        found = self._found()
        if not found and not self._seen:
            return ()
        now_ns = self._runtime.host.now_ns()
        for name, message in self._seen.items():
            if name not in found and message.verdict == Shadow.RUNNING:
                found[name] = ended = copy(message)
                ended.verdict, ended.end_ns, ended.reason = Shadow.ENDED, now_ns, "the component was removed"
        self._seen = found
        due = [
            one for name, message in found.items() if (one := self._due(name, message, now_ns)) is not None
        ]
        return [SentMessage(self._topic, "mauve_msgs/msg/Shadow", data, now_ns, None) for data in due]

    def dropped_messages(self) -> int:
        """None: they are made when they are taken."""
        return 0

    def _found(self) -> dict[str, Any]:
        """By component."""
        return {record.component: shadow_message(record, curves=True) for record in self._runtime.shadows()}

    def _due(self, component: str, message: Any, now_ns: int) -> bytes | None:
        """What is to be recorded now; None: nothing."""
        before = self._recorded.get(component)
        is_same = before is not None and (message.begin_ns, message.verdict) == (
            before.message.begin_ns,
            before.message.verdict,
        )
        goes_on = is_same and not self._is_finishing
        is_running = message.verdict == Shadow.RUNNING
        period_ns = _PERIOD_NS if is_running else _PERIOD_AFTER_END_NS
        if before is not None and goes_on and now_ns < before.time_ns + period_ns:
            return None
        data = self._serialize(message)
        self._recorded[component] = _Recorded(message, data, now_ns)
        # After the end its thread may complete a release, and the curves go on. As bytes: NaN equals NaN.
        is_new = before is None or (goes_on and is_running) or data != before.data
        return data if is_new else None
