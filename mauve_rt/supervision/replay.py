"""Rules replayed: what they would have decided on the day of a bag. In virtual time; knows no ROS.

They are at work on a simulated executor, with stand-ins for what they name. The bag tells what conditions
hear, when components ran, and which rules were active already. What persons changed then is not replayed.
"""

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from functools import partial
from itertools import groupby
from typing import NamedTuple

from mauve_rt._kernel import Simulation
from mauve_rt.supervision.decisions import Decision
from mauve_rt.supervision.explanation import StoryEntry
from mauve_rt.supervision.recorded_signals import RecordedSignals
from mauve_rt.supervision.rehearsed_rules import RehearsedRules
from mauve_rt.supervision.rules import Rule, RulesFile
from mauve_rt.supervision.stand_ins import StandInRuntime
from mauve_rt.supervision.view_signals import COMPONENT_STATES
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
    happens: Callable[[], None]


def replayed(
    file: RulesFile, trace: Trace, story: Iterable[StoryEntry], *, left_out: Collection[str] = ()
) -> list[Acted]:
    """Return the actions that the rules of a file would have begun, by time. `story`: what was decided then.

    Raises:
        TraceError: the bag's messages cannot be read.
        ArchitectureFileError: an executor would refuse a step.
        MauveError: the engine refuses a rule.

    """
    simulation = Simulation(trace=False)
    try:
        return _Replay(simulation, file, trace, left_out).acted(story)
    finally:
        simulation.shutdown()


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


class _Replay:
    """One run, in a simulation of its own."""

    def __init__(
        self, simulation: Simulation, file: RulesFile, trace: Trace, left_out: Collection[str]
    ) -> None:
        self._trace = trace
        self._recorded = RecordedSignals(trace)
        self._names = {rule.name for rule in file.rules.rules} - set(left_out)
        self._found: list[Acted] = []
        runtime = StandInRuntime(simulation, file)
        runtime.configure()
        runtime.activate()
        self._components = [part.name for part in runtime.components() if part.name in trace.records]
        for name in self._components:
            if not self._runs_first(name):
                runtime.host.stop(name)
        self._later_ns = simulation.now_ns() - trace.span_ns[0]  # than in the bag
        self._rules = RehearsedRules(
            simulation, runtime, file, self._note, left_out=left_out, hears_states=False
        )

    def acted(self, story: Iterable[StoryEntry]) -> list[Acted]:
        """What the rules begin."""
        events = [*self._runs(), *self._adopted(story), *self._heard()]
        events.sort(key=lambda event: event.time_ns)
        for time_ns, together in groupby(events, key=lambda event: event.time_ns):
            self._rules.run_until(time_ns + self._later_ns)
            for event in together:
                event.happens()
            self._rules.look()
        self._rules.run_until(self._trace.span_ns[1] + self._later_ns)
        self._rules.look()
        return sorted(self._found)

    def _note(self, decision: Decision) -> None:
        if decision.decision in _ACTS:
            self._found.append(Acted(decision.time_ns - self._later_ns, decision.rule, decision.decision))

    def _runs_first(self, component: str) -> bool:
        return self._recorded.states(component)[0][1] == COMPONENT_STATES["RUNNING"]

    def _runs(self) -> Iterator[_Event]:
        """Of the components, when they ran."""
        words = {float(number): word for word, number in COMPONENT_STATES.items()}
        for name in self._components:
            for time_ns, state in self._recorded.states(name):
                yield _Event(time_ns, partial(self._rules.set_state, name, words[state]))

    def _adopted(self, story: Iterable[StoryEntry]) -> Iterator[_Event]:
        for one in story:
            if one.decision == "adopted" and one.rule in self._names:
                yield _Event(one.time_ns, partial(self._rules.adopt, one.rule))

    def _heard(self) -> Iterator[_Event]:
        for one in self._recorded.told(self._rules.signals):
            yield _Event(one.time_ns, partial(self._rules.tell, one.signal, one.value))


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
