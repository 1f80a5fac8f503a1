"""What rules decided according to a bag: the story, and how each rule stood at an instant. Knows no ROS.

Decisions of an executor are in its trace and, as those of a supervisor, recorded as messages. Where there are
both, the record has the instant and the message the words.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

from mauve_rt.trace.reading.decisions import (
    DECISION_TYPE,
    TOLD_AS,
    ExplainedDecision,
    executors,
    joined,
    stamp_ns,
)
from mauve_rt.trace.reading.facts import Message
from mauve_rt.trace.reading.trace import Trace

_NOT_ARMED = "not armed"
# What a message says of why nothing was done, by words of its reason: a record has a number for it.
_CHANGED = "changed by another requester"
_WHY = {
    "watching again once": _NOT_ARMED,
    "by another requester": _CHANGED,
    "by another hand": _CHANGED,  # in bags of before
    "already": "in effect already",
    "outranked": "outranked",
}
_ACT = re.compile(r"(?:no |nothing to )?(do|undo|otherwise)\b")
_LOST = (_CHANGED, "changed by another hand", "outranked")


class StoryEntry(NamedTuple):
    """A decision, in words."""

    time_ns: int
    """CLOCK_MONOTONIC"""
    who: str
    """Whose rule it is: the node's full name."""
    rule: str
    decision: str
    """As in SupervisorDecision.msg."""
    act: str
    """do or undo, of the decisions about one; else empty."""
    why: str
    reason: str


@dataclass
class Standing:
    """How a rule stands after its decisions so far."""

    who: str
    rule: str
    armed: bool = False
    condition: str = "false"
    """true, false or unknown."""
    in_effect: bool = False
    since_ns: int = 0
    """When it began to be in effect, or ceased to."""
    last: StoryEntry | None = None
    hindered: StoryEntry | None = field(default=None)
    """Why it does not do what its condition asks for; None when it does, or nothing is asked."""

    def follow(self, entry: StoryEntry) -> None:
        """Take the next decision into account."""
        self.last = entry
        match entry.decision:
            case "armed":
                self.armed, self.condition, self.hindered = True, "false", None
            case "condition_true" | "condition_false" | "condition_unknown":
                self.condition = entry.decision.removeprefix("condition_")
                self.armed, self.hindered = True, None
            case "do" | "undo":
                self.armed, self.hindered = True, None
            case "otherwise":
                self.armed, self.hindered = True, entry
            case "done" if entry.act == "otherwise":
                self.hindered = entry
            case "adopted" | "done":
                self._set_in_effect(entry.act != "undo", entry)
                self.hindered = None
            case "failed" | "suppressed":
                self._hinder(entry)

    def _hinder(self, entry: StoryEntry) -> None:
        self.hindered = entry
        if entry.why == _NOT_ARMED:
            self.armed = False
        elif entry.why == "in effect already":
            self._set_in_effect(entry.act != "undo", entry)
        elif entry.why in _LOST and entry.act != "undo":
            self._set_in_effect(False, entry)

    def _set_in_effect(self, in_effect: bool, entry: StoryEntry) -> None:  # noqa: FBT001
        if in_effect != self.in_effect:
            self.in_effect, self.since_ns = in_effect, entry.time_ns


def story(trace: Trace) -> list[StoryEntry]:
    """Return all decisions in a bag, by time: of the executor's rules and of supervisors'.

    Raises:
        TraceError: the bag's messages cannot be read.

    """
    messages = list(trace.messages(DECISION_TYPE))
    traced = joined(trace, messages)
    executor = next(iter(executors(trace)), "")
    known = {id(one.message) for one in traced}
    found = [_of_record(one, executor) for one in traced]
    found += [_of_message(one, stamp_ns(one, trace.clock_pairs)) for one in messages if id(one) not in known]
    return sorted(found, key=lambda entry: entry.time_ns)


def standings(entries: list[StoryEntry], time_ns: int) -> list[Standing]:
    """Return how each rule of a story stood at an instant, in the order of their first decisions."""
    found: dict[tuple[str, str], Standing] = {}
    for entry in entries:
        standing = found.setdefault((entry.who, entry.rule), Standing(entry.who, entry.rule))
        if entry.time_ns <= time_ns:
            standing.follow(entry)
    return list(found.values())


def story_lines(entries: list[StoryEntry], begin_ns: int) -> Iterator[str]:
    """Tell a story, a line for each decision: s from the begin, rule, decision, reason."""
    several = len({entry.who for entry in entries}) > 1
    for entry in entries:
        yield f"{_seconds(entry.time_ns, begin_ns)}  {_named(entry, several=several)}: {_said(entry)}"


def standing_lines(found: list[Standing], begin_ns: int) -> Iterator[str]:
    """Tell how rules stand: whether in effect, the last decision, why it did not act."""
    several = len({one.who for one in found}) > 1
    for one in found:
        yield f"{_named(one, several=several)}: {_how(one, begin_ns)}"
        if one.last is not None:
            yield f"  last: {_seconds(one.last.time_ns, begin_ns).strip()}: {_said(one.last)}"
        if one.hindered is not None and one.hindered is not one.last:
            yield f"  why not: {_seconds(one.hindered.time_ns, begin_ns).strip()}: {_said(one.hindered)}"


def _how(one: Standing, begin_ns: int) -> str:
    if one.last is None:
        return "nothing told of it yet"
    effect = "not in effect"
    if one.in_effect:
        effect = f"in effect since {_seconds(one.since_ns, begin_ns).strip()}"
    if not one.armed:
        return f"{effect}, does not watch"
    return f"{effect}, its condition is {one.condition}{_wanting(one)}"


def _wanting(one: Standing) -> str:
    """Why that is not what its condition asks for."""
    as_asked = one.condition == "unknown" or (one.condition == "true") == one.in_effect
    if as_asked or one.hindered is None:
        return ""
    return f"; it did not act: {one.hindered.reason or one.hindered.why or one.hindered.decision}"


def _of_record(one: ExplainedDecision, executor: str) -> StoryEntry:
    said = one.traced
    decision, act = TOLD_AS.get(said.decision, (said.decision, ""))
    why = _NOT_ARMED if said.decision == _NOT_ARMED else said.why
    return StoryEntry(said.time_ns, executor, said.rule, decision, act, why, one.reason)


def _of_message(message: Message, time_ns: int) -> StoryEntry:
    said = message.msg
    decision, reason = str(said.decision), str(said.reason)
    why = ""
    if decision == "suppressed":
        why = next((meant for words, meant in _WHY.items() if words in reason), "")
    act = str(getattr(said, "act", ""))
    if not act and decision not in ("armed", "adopted"):  # a supervisor's: its reason begins with it
        begins = _ACT.match(decision) or _ACT.match(reason)
        act = begins[1] if begins else ""
    return StoryEntry(time_ns, _node(message.topic), str(said.rule), decision, act, why, reason)


def _node(topic: str) -> str:
    return topic.rpartition("/")[0] or topic


def _named(one: StoryEntry | Standing, *, several: bool) -> str:
    return f"{one.rule} ({one.who})" if several else one.rule


def _said(entry: StoryEntry) -> str:
    what = entry.decision
    if entry.reason:
        return f"{what}: {entry.reason}"
    about = f"{what} {entry.act}" if entry.act and entry.act != what else what
    return f"{about}: {entry.why}" if entry.why else about


def _seconds(time_ns: int, begin_ns: int) -> str:
    return f"{(time_ns - begin_ns) / 1e9:9.3f} s"
