"""What rules hear outside of their executor, from messages: topics, other executors, diagnostics."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Literal, Protocol

from mauve_rt._kernel import SignalSpec
from mauve_rt.fields import number_at
from mauve_rt.interfaces.decisions import STATES
from mauve_rt.supervision.peers import PEER_STATES, Peer, PeerState, executor_name
from mauve_rt.supervision.remote_rules import RemoteRules
from mauve_rt.supervision.rule_types import heard_type
from mauve_rt.supervision.rules import RulesFile
from mauve_rt.supervision.when_spec import OF_TOPICS

DIAGNOSTICS = "/diagnostics"
_FAULTED = next(number for number, name in STATES.items() if name == "FAULTED")


Kept = Literal["no", "some", "all"]  # which writers of a topic keep their last message for later readers


class Listen(Protocol):
    """How a topic is heard."""

    def __call__(
        self, topic: str, message: Any, heard: Callable[[Any], None], *, raw: bool, kept: Kept = "no"
    ) -> None:
        """`message`: its class; `raw`: it need not be read; `kept`: a message of before is received, too."""


class OutsideFeeds:
    """Of the rules of one supervisor. One thread."""

    def __init__(
        self, file: RulesFile, rules: RemoteRules, *, listen: Listen, now_ns: Callable[[], int]
    ) -> None:
        """Listen to all that the rules look at.

        Raises:
            ArchitectureFileError: a rule names a message type that is not installed.
        """
        self._rules = rules
        self._now_ns = now_ns
        self._listen = listen
        self._peers: dict[str, Peer] = {}  # by full name
        self._known: dict[str, PeerState] = {}  # what was told of each
        self._statuses: dict[str, list[int]] = {}  # by name: the signals
        self._peer_signals: dict[str, list[int]] = {}  # by full name
        self._levels: dict[str, float] = {}
        messages = {rule.name: rule for rule in file.rules.rules}
        self._types = {
            (str(leaf.parameters["topic"]), str(leaf.parameters.get("field") or "")): leaf
            for rule in messages.values()
            for leaf in rule.when.leaves()
            if leaf.parameters.get("topic") and leaf.parameters.get("type")
        }
        for number, spec in enumerate(rules.signals):
            self._open(file, number, spec)
        if self._statuses or self._peers:
            from diagnostic_msgs.msg import DiagnosticArray  # noqa: PLC0415 - only some rules look at them

            listen(DIAGNOSTICS, DiagnosticArray, self._hear_diagnostics, raw=False)

    def tick(self) -> int | None:
        """Tell whose silence is long enough by now; when to look again, None: when something is heard."""
        due = [due_ns for peer in self._peers.values() if (due_ns := peer.due_ns()) is not None]
        for name in self._peers:
            self._tell_peer(name)
        later = [due_ns for due_ns in due if due_ns > self._now_ns()]
        return min(later, default=None)

    def lost(self, executor: str) -> None:
        """The middleware says that an executor is there no more."""
        name = executor_name(executor)
        if name in self._peers:
            self._peers[name].lost()
            self._tell_peer(name)

    def peers(self) -> Mapping[str, Peer]:
        """By full name."""
        return self._peers

    def _open(self, file: RulesFile, number: int, spec: SignalSpec) -> None:
        if spec.kind in OF_TOPICS:
            leaf = self._types.get((spec.target, spec.detail))
            if leaf is not None:  # else it cannot be heard here, and the rules know that
                hear = partial(self._hear, number, spec.detail)
                kept: Kept = "some" if spec.detail else "no"
                self._listen(spec.target, heard_type(file, leaf), hear, raw=not spec.detail, kept=kept)
        elif spec.kind == "peer":
            self._open_peer(executor_name(spec.target), number)
        elif spec.kind == "diagnostic":
            self._statuses.setdefault(spec.target, []).append(number)

    def _open_peer(self, name: str, number: int) -> None:
        from mauve_msgs.msg import ArchitectureState  # noqa: PLC0415 - only some rules look at it

        self._peer_signals.setdefault(name, []).append(number)
        if name not in self._peers:
            self._peers[name] = Peer()
            hear = partial(self._hear_state, name)
            self._listen(f"{name}/state", ArchitectureState, hear, raw=False, kept="all")
            self._tell_peer(name)

    def _hear(self, number: int, field: str, message: Any) -> None:
        value = number_at(message, field) if field else 0.0
        self._rules.hear(number, self._now_ns(), value)

    def _hear_state(self, name: str, state: Any) -> None:
        faulted = any(component.state == _FAULTED for component in state.components)
        self._peers[name].tell(self._now_ns(), state.instance_id, faulted=faulted)
        self._tell_peer(name)

    def _hear_diagnostics(self, array: Any) -> None:
        for status in array.status:
            name = status.name.partition(":")[0]
            if name in self._peers:
                self._peers[name].alive(self._now_ns())
            level = float(status.level[0])
            if status.name in self._statuses and self._levels.get(status.name) != level:
                self._levels[status.name] = level
                for number in self._statuses[status.name]:
                    self._rules.hear(number, self._now_ns(), level)
        for name in self._peers:
            self._tell_peer(name)

    def _tell_peer(self, name: str) -> None:
        state = self._peers[name].state(self._now_ns())
        if self._known.get(name) == state:
            return
        self._known[name] = state
        for number in self._peer_signals[name]:
            self._rules.hear(number, self._now_ns(), float(PEER_STATES.index(state)))
