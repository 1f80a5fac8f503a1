"""Whether one sequential order of requests explains the answers that several clients received.

The search is that of Wing and Gong (1993), with a memory of the states that it has left. Where one call ended
before another one began, each order that is tried keeps these two so.

A call has two instants between its begin and its end. Its decision changes the architecture or not. Its
answer counts the change. The executor counts revisions when it looks at the architecture: a start or stop
happens before it is counted, and one look may count several changes.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from mauve_rt._kernel import ComponentDescription
from mauve_rt.control.requests import Code, Outcome, Request, Step


class Part(NamedTuple):
    """What requests change of a component."""

    running: bool
    core: str
    step: float
    wire: str


Facts = tuple[tuple[str, Part], ...]


@dataclass(frozen=True)
class Call:
    """A request of a client and its outcome; without a request the client read the architecture."""

    begin: int
    end: int
    outcome: Outcome
    request: Request | None = None
    facts: Facts = ()
    contested: frozenset[str] = frozenset()
    """Components that another call starts or stops at the same time. Two stops may wait for one end, and of a
    transaction on threads one component starts after the other."""

    def commands(self) -> frozenset[str]:
        """The components that the call starts or stops."""
        steps = self.request.steps if self.request is not None and self.outcome.success else ()
        return frozenset(step.target for step in steps if step.kind in ("start", "stop"))

    def __str__(self) -> str:
        asked = self.request
        words = str(self.facts) if asked is None else str(asked)
        if asked is not None and asked.expected_revision:
            words += f" at {asked.expected_revision}"
        if asked is not None and asked.request_id:
            words += f" as {asked.request_id}"
        code = self.outcome.code.name
        return f"{self.begin}-{self.end}: {words} -> {code} {self.outcome.revision} {self.outcome.message}"


class State(NamedTuple):
    """An architecture in the order that is tried."""

    facts: Facts
    revision: int
    """The last one that an answer has shown."""
    claimed: int
    """The last one that an answer to a change has shown: no two changes have the same."""
    uncounted: int = 0
    """Changes since `revision`."""
    is_seen: bool = False
    """Whether one of them shows: a core that replaces its like is counted by its own answer only."""

    def shows(self, revision: int) -> bool:
        """Whether a look may find this revision. It counts what shows; others may have looked before."""
        return self.revision + self.is_seen <= revision <= self.revision + self.uncounted

    def seen_at(self, revision: int) -> "State":
        return self._replace(revision=revision, uncounted=0, is_seen=False)

    def changed(self, facts: Facts) -> "State":
        is_seen = self.is_seen or facts != self.facts
        return self._replace(facts=facts, uncounted=self.uncounted + 1, is_seen=is_seen)


def facts_of(components: Iterable[ComponentDescription]) -> Facts:
    """The facts that an executor describes."""
    return tuple(
        (
            part.name,
            Part(
                running=part.state in ("RUNNING", "STOPPING"),  # a stop is a change when it has ended
                core=part.core,
                step=next(float(item.value) for item in part.properties if item.name == "step"),
                wire=next(port.resource for port in part.ports if port.name == "set"),
            ),
        )
        for part in components
    )


def is_linearizable(start: State, calls: Sequence[Call]) -> bool:
    """Whether an order of the calls explains every answer."""
    once = _merge_repeated(calls)
    if once is None or not all(_has_reason(call, calls) for call in once):
        return False
    return _has_order(start, [replace(call, contested=_contested(call, once)) for call in once])


def _merge_repeated(calls: Sequence[Call]) -> list[Call] | None:
    """Each request with an id once; None: it was answered in two ways."""
    merged: dict[object, Call] = {}
    for number, call in enumerate(calls):
        has_id = call.request is not None and call.request.request_id
        key = call.request if has_id and call.outcome.code is not Code.REQUEST_ID_REUSED else number
        first = merged.setdefault(key, call)
        if first.outcome != call.outcome:
            return None
        merged[key] = replace(first, begin=min(first.begin, call.begin), end=min(first.end, call.end))
    return list(merged.values())


def _has_reason(call: Call, calls: Iterable[Call]) -> bool:
    """Whether another call is the reason of a refusal that its own answer does not explain."""
    asked, code = call.request, call.outcome.code
    if asked is None:
        return True
    earlier = [other for other in calls if other.request not in (None, asked) and other.begin < call.end]
    if code is Code.REQUEST_ID_REUSED:
        return any(other.request.request_id == asked.request_id for other in earlier if other.request)
    if code is Code.WRONG_REVISION and call.outcome.revision == asked.expected_revision:
        return any(other.outcome.success and other.end > call.begin for other in earlier)  # it is being made
    return True


def _contested(call: Call, calls: Iterable[Call]) -> frozenset[str]:
    others = (each for each in calls if each is not call and each.begin < call.end and call.begin < each.end)
    return frozenset(target for each in others for target in each.commands())


def _has_order(start: State, calls: Sequence[Call]) -> bool:
    decided_and_answered = (1 << 2 * len(calls)) - 1
    left = {(0, start)}
    pending = [(0, start)]
    while pending:
        done, state = pending.pop()
        if done == decided_and_answered:
            return True
        open_calls = [(n, call) for n, call in enumerate(calls) if not done >> 2 * n & 2]
        first_end = min(call.end for _, call in open_calls)
        for n, call in open_calls:
            if call.begin > first_end:
                continue
            is_decided = done >> 2 * n & 1
            after = _answer(state, call) if is_decided else _decide(state, call)
            node = (done | (2 if is_decided else 1) << 2 * n, after)
            if after is not None and node not in left:
                left.add(node)
                pending.append((node[0], after))
    return False


def _decide(state: State, call: Call) -> State | None:
    asked, outcome = call.request, call.outcome
    if asked is None:
        is_seen = call.facts == state.facts and state.shows(outcome.revision)
        return state.seen_at(outcome.revision) if is_seen else None
    if not outcome.success:
        return state if _may_refuse(state, asked, call) else None
    if asked.expected_revision:
        if not state.shows(asked.expected_revision):
            return None
        state = state.seen_at(asked.expected_revision)
    facts = _after(dict(state.facts), asked.steps, contested=call.contested)
    if facts is None or asked.dry_run:
        return None if facts is None else state
    if any(part.core == "executor_tests/Reluctant" for part in facts.values()):
        return None  # its adopt() refuses, which a dry run does not call
    return state.changed(tuple(facts.items()))


def _may_refuse(state: State, asked: Request, call: Call) -> bool:
    """A refusal is always allowed, but not for a reason that is not true."""
    code, expected = call.outcome.code, asked.expected_revision
    if code is Code.WRONG_REVISION and expected != call.outcome.revision:
        return not expected or state.uncounted > 0 or state.revision != expected
    if code in (Code.NOT_RUNNING, Code.ALREADY_RUNNING) and len(asked.steps) == 1:
        target = asked.steps[0].target
        is_so = dict(state.facts)[target].running is (code is Code.ALREADY_RUNNING)
        return is_so or target in call.contested
    return True


def _answer(state: State, call: Call) -> State | None:
    asked, outcome = call.request, call.outcome
    revision = outcome.revision
    if asked is None:
        return state
    if outcome.code is Code.REQUEST_ID_REUSED:  # without a look at the architecture
        return state if state.revision <= revision <= state.revision + state.uncounted else None
    if asked.dry_run or not outcome.success:
        return state.seen_at(revision) if state.shows(revision) else None
    # Where others have counted the change, its own answer may count once more, to be unlike theirs.
    if revision <= state.claimed or not (state.shows(revision) or state.shows(revision - 1)):
        return None
    return state.seen_at(revision)._replace(claimed=revision)


def _after(
    parts: dict[str, Part], steps: Iterable[Step], *, contested: frozenset[str]
) -> Mapping[str, Part] | None:
    """The parts after these steps; None: a step is impossible."""
    for step in steps:
        part = parts[step.target]
        match step.kind:
            case "start" if not part.running:
                part = part._replace(running=True)
            case "stop" if part.running or step.target in contested:
                part = part._replace(running=False)
            case "set_property" if float(step.value) <= 10.0:
                part = part._replace(step=float(step.value))
            case "replace_core" if step.name != "executor_tests/Undeclared":
                part = part._replace(core=step.name)
            case "connect" if not part.wire:
                part = part._replace(wire=step.value.partition(".")[0])
            case "disconnect" if part.wire:
                part = part._replace(wire="")
            case _:
                return None
        parts[step.target] = part
    return parts
