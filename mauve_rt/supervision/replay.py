"""Rules replayed: what they would have decided on the day of a bag. In virtual time; knows no ROS.

Each action takes effect at once. An executor's rules and a supervisor's are decided apart, as they were. That
something was in effect already when a rule was armed is taken from the bag.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import chain, groupby
from operator import methodcaller
from typing import NamedTuple

from mauve_rt._kernel import ActionStep, Overlays, OverlaySpec, RuleEngine, SignalSpec
from mauve_rt.control.wishes import assignment_of
from mauve_rt.supervision.engine_rules import rule_specs
from mauve_rt.supervision.explanation import StoryEntry
from mauve_rt.supervision.recorded_signals import RecordedSignals
from mauve_rt.supervision.rules import Rule
from mauve_rt.trace.reading.trace import Trace

TOLERANCE_NS = 100_000_000
"""Actions farther apart than this are not the same."""
_ACTS = ("do", "undo")
_COLUMNS = ("rule", "act", "then", "replayed", "difference")


class Acted(NamedTuple):
    """An action that a rule began. ns of CLOCK_MONOTONIC."""

    time_ns: int
    rule: str
    act: str


class Compared(NamedTuple):
    """An action as it was begun then and as the replay begins it; None where it is not."""

    rule: str
    act: str
    then_ns: int | None
    replayed_ns: int | None

    @property
    def matches(self) -> bool:
        """Whether both began it at about the same time."""
        if self.then_ns is None or self.replayed_ns is None:
            return False
        return abs(self.replayed_ns - self.then_ns) <= TOLERANCE_NS


class _Event(NamedTuple):
    time_ns: int
    happens: Callable[[RuleEngine], None]


def replayed(rules: Sequence[Rule], trace: Trace, story: Iterable[StoryEntry]) -> list[Acted]:
    """Return the actions that rules would have begun, by time. `story`: what was decided then.

    Raises:
        TraceError: the bag's messages cannot be read.
        MauveError: the engine refuses a rule.

    """
    entries = list(story)
    signals = RecordedSignals(trace)
    found: list[Acted] = []
    for where in ("executor", "supervisor"):
        own = [rule for rule in rules if rule.where == where]
        if own:
            found += _run(own, signals, entries, trace.span_ns)
    return sorted(found)


def acted_then(rules: Iterable[Rule], story: Iterable[StoryEntry]) -> list[Acted]:
    """Return the actions of these rules that a story tells of."""
    names = {rule.name for rule in rules}
    return [
        Acted(one.time_ns, one.rule, one.decision)
        for one in story
        if one.decision in _ACTS and one.rule in names
    ]


def compared(rules: Iterable[Rule], then: Iterable[Acted], now: Iterable[Acted]) -> list[Compared]:
    """Return the actions of then and those replayed side by side, rule by rule, each by time."""
    before, after = list(then), list(now)
    found: list[Compared] = []
    for rule in rules:
        of_rule = ([one for one in each if one.rule == rule.name] for each in (before, after))
        found += _side_by_side(*of_rule)
    return found


def comparison_lines(found: Sequence[Compared], begin_ns: int) -> Iterator[str]:
    """Tell a comparison as a table, s from the bag's begin; rows that differ are marked."""
    rows = [_COLUMNS, *(_row(one, begin_ns) for one in found)]
    widths = [max(len(row[column]) for row in rows) for column in range(len(_COLUMNS))]
    for row, one in zip(rows, (None, *found), strict=True):
        words = [f"{text:<{width}}" for text, width in zip(row[:2], widths[:2], strict=True)]
        times = [f"{text:>{width}}" for text, width in zip(row[2:], widths[2:], strict=True)]
        mark = "" if one is None or one.matches else "  differs"
        yield "  ".join(words + times) + mark


class _Replayed:
    """An engine and what its rules want of each element, without an executor: all is done at once."""

    def __init__(self, rules: Sequence[Rule]) -> None:
        self.engine = RuleEngine(rule_specs(rules))
        self._rules = rules
        self._overlays = Overlays()
        assigns = [[assignment_of(step) for step in rule.do] for rule in rules]
        self._each = self._overlays.load(
            "",
            [
                OverlaySpec(rule.name, steps, priority=rule.priority, safety=rule.safety, whole=rule.whole)
                for rule, steps in zip(rules, assigns, strict=True)
            ],
        )
        for step in chain.from_iterable(assigns):
            self._overlays.set_base(_before(step), "")
        self.found: list[Acted] = []

    def until(self, next_ns: int, time_ns: int) -> int:
        """Step as often as the engine asks for before an instant; returns when it asks for the next one."""
        while next_ns < time_ns:
            next_ns = max(self.step(next_ns), next_ns + 1)
        return next_ns

    def step(self, now_ns: int) -> int:
        """Decide at an instant until nothing more is wanted."""
        while True:
            self._follow()
            next_ns = self.engine.step(now_ns)
            self._follow()
            pending = self.engine.pending
            if pending is not None:
                self.found.append(Acted(now_ns, self._rules[pending.rule].name, pending.act))
                self.engine.begun(now_ns)
                self.engine.ended(pending.rule, pending.act, "done", now_ns)
            while self.engine.take() is not None:
                pass  # what it tells of them is of no interest
            if pending is None:
                return next_ns

    def _follow(self) -> None:
        """A rule has nothing to do where others hold all that it wants."""
        for number, overlay in enumerate(self._each):
            self._overlays.set_active(overlay, is_active=self.engine.status(number).active)
        self._overlays.settle_ended()
        for number, overlay in enumerate(self._each):
            for act, is_active in (("do", True), ("undo", False)):
                left = self._overlays.steps_if(overlay, is_active)
                if not left:
                    self.engine.set_in_place(number, act, in_place=True)


def _before(step: ActionStep) -> ActionStep:
    """Another value of what a step sets."""
    match step.kind:
        case "start" | "stop":
            return ActionStep("start" if step.kind == "stop" else "stop", step.target)
        case "set_property":
            return ActionStep(step.kind, step.target, step.name, "before")
        case "connect" | "disconnect":
            return ActionStep("connect", step.target, step.name, "what was.before")
        case _:
            return ActionStep(step.kind, step.target, "before")


def _run(
    rules: list[Rule], signals: RecordedSignals, story: list[StoryEntry], span_ns: tuple[int, int]
) -> list[Acted]:
    replayed = _Replayed(rules)
    engine = replayed.engine
    events = [*_present(rules, signals), *_adopted(rules, story), *_heard(engine.signals, signals)]
    events.sort(key=lambda event: event.time_ns)
    begin_ns, end_ns = span_ns
    next_ns = begin_ns
    for time_ns, together in groupby(events, key=lambda event: event.time_ns):
        next_ns = replayed.until(next_ns, time_ns)
        for event in together:
            event.happens(engine)
        next_ns = replayed.step(time_ns)
    replayed.until(next_ns, end_ns + 1)
    return replayed.found


def _present(rules: list[Rule], signals: RecordedSignals) -> Iterator[_Event]:
    for index, rule in enumerate(rules):
        for time_ns, present in signals.presence(rule):
            yield _Event(time_ns, methodcaller("set_present", index, present, time_ns))


def _adopted(rules: list[Rule], story: list[StoryEntry]) -> Iterator[_Event]:
    places = {rule.name: index for index, rule in enumerate(rules)}
    for one in story:
        if one.decision == "adopted" and one.rule in places:
            yield _Event(one.time_ns, methodcaller("adopt", places[one.rule], True, one.time_ns))


def _heard(heard: Sequence[SignalSpec], signals: RecordedSignals) -> Iterator[_Event]:
    for one in signals.told(heard):
        yield _Event(one.time_ns, methodcaller("tell", one.signal, one.time_ns, one.value))


def _side_by_side(then: list[Acted], now: list[Acted]) -> list[Compared]:
    if [one.act for one in then] == [one.act for one in now]:
        return [
            Compared(one.rule, one.act, one.time_ns, other.time_ns)
            for one, other in zip(then, now, strict=True)
        ]
    found: list[Compared] = []
    while then or now:
        if then and now:
            both = Compared(then[0].rule, then[0].act, then[0].time_ns, now[0].time_ns)
            if then[0].act == now[0].act and both.matches:
                found.append(both)
                then, now = then[1:], now[1:]
                continue
        if then and (not now or then[0].time_ns <= now[0].time_ns):
            first, *then = then
            found.append(Compared(first.rule, first.act, first.time_ns, None))
        else:
            first, *now = now
            found.append(Compared(first.rule, first.act, None, first.time_ns))
    return found


def _row(one: Compared, begin_ns: int) -> tuple[str, ...]:
    difference = ""
    if one.then_ns is not None and one.replayed_ns is not None:
        difference = f"{(one.replayed_ns - one.then_ns) / 1e9:+.3f}"
    times = ("-" if at is None else f"{(at - begin_ns) / 1e9:.3f}" for at in (one.then_ns, one.replayed_ns))
    return (one.rule, one.act, *times, difference)
