"""Response times while a change is made: each participant has old parts before one instant T, then new ones.

All participants take the change at their first releases at or after the same T. In a busy window that
begins at 0 the change is at x = T - 0, one number for all of them. So each asks for old jobs released
before x, then for new jobs; the worst x of all counts, not the worst one of each participant. The demands
change only where an old job is released, so these instants x are tried.

Before, a participant's new core adopts the state of the old one, and at x takes it: both together at most
`handover_ns`, at some instant of a window.

A change at an idle instant finds no job of a participant pending, nor one of a component above the lowest
participant. No busy window of these has T in it: it has the demand before the change or that after it, each
with the handover. Components below the lowest participant, or with its priority, may have any window; but
what participants did in it before the change is done at the change, so all of that is no longer than x.

Sources: Tindell, Burns, Wellings, "Mode changes in priority pre-emptively scheduled systems", RTSS 1992, for
one instant instead of a request for each task; Tindell, Alonso, "A very simple protocol for mode changes in
priority preemptive systems", 1996, for the idle instant.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import pairwise, takewhile

from mauve_rt.analysis.blocking import blocking_ns
from mauve_rt.analysis.critical_section import CriticalSection
from mauve_rt.analysis.demand import Demand, Path, Together, paths, utilization_of
from mauve_rt.analysis.digraph import DigraphTask, Job
from mauve_rt.analysis.digraph_times import (
    Component,
    Delay,
    DigraphTimes,
    JobTime,
    Work,
    level_of,
    overload,
    window_ns,
)
from mauve_rt.analysis.fixed_point import MOST_STEPS, UnboundedError
from mauve_rt.analysis.machines import FOREVER_NS
from mauve_rt.analysis.time_limit import check_time_limit

_NOTHING = DigraphTask("", ())
_INTERVALS = 32


@dataclass(frozen=True)
class Participant:
    """A component with other parts from T on. An added one has no old task, a removed one no new task."""

    old: Component | None
    new: Component | None
    handover_ns: int = 0
    """For its thread to adopt and to take the old core's state, together."""

    @property
    def any(self) -> Component:
        """The one that is there; name, CPU and priority do not change."""
        found = self.old or self.new
        if found is None:
            raise ValueError("a participant has an old task or a new one")
        return found

    @property
    def merged(self) -> Component:
        """With the locks of both."""
        longest: dict[str, int] = {}
        both = [one for one in (self.old, self.new) if one is not None]
        for one in both:
            for section in one.sections:
                longest[section.resource] = max(section.length_ns, longest.get(section.resource, 0))
        sections = tuple(CriticalSection(resource=name, length_ns=ns) for name, ns in longest.items())
        return replace(
            self.any,
            jitter_ns=max(one.jitter_ns for one in both),
            sections=sections,
            waits_for_services=any(one.waits_for_services for one in both),
        )


Member = Component | Participant


def times_during(members: Sequence[Member], *, is_idle: bool = False) -> dict[str, DigraphTimes]:
    """The bounds of all components of one CPU, by name, whenever the change comes.

    `is_idle`: at an instant at which no job of a participant is pending, nor one of a component above the
    lowest of them.

    The longest `jitter_ns` of all components counts for each of them.

    Raises:
        AnalysisError: as for `ceilings`.

    """
    merged = {_name(one): one.merged if isinstance(one, Participant) else one for one in members}
    jitter_ns = max((one.jitter_ns for one in merged.values()), default=0)
    mixes = {_name(one): _Mix(one, jitter_ns, is_idle=is_idle) for one in members}
    loads = {_name(one): _loads(one) for one in members}
    apart = _without_window_over_change(members) if is_idle else frozenset()

    def instants(name: str) -> _Instants:
        if name in apart:
            return lambda _changed, _window_ns: [0, FOREVER_NS]
        return _some_instants if is_idle else _instants

    return {name: _times(name, merged, mixes, loads, jitter_ns, instants=instants(name)) for name in merged}


_Instants = Callable[["Sequence[_Mix]", int], Iterable[int]]
"""Instants of the change to try: of those that change, and the longest window before the change."""


def _without_window_over_change(members: Sequence[Member]) -> frozenset[str]:
    """Components of whose busy windows none has an idle instant of the change in it."""
    lowest = min((one.any.priority for one in members if isinstance(one, Participant)), default=0)
    others = [one for one in members if isinstance(one, Component)]
    meets_equals = any(one.priority == lowest for one in others)
    above = [one for one in others if one.priority > lowest]
    participants = [one.any for one in members if isinstance(one, Participant)]
    return frozenset(one.name for one in (*above, *participants) if one.priority > lowest or not meets_equals)


def _name(member: Member) -> str:
    return member.any.name if isinstance(member, Participant) else member.name


def _times(
    name: str,
    merged: Mapping[str, Component],
    mixes: "Mapping[str, _Mix]",
    loads: Mapping[str, tuple[Fraction, Fraction]],
    jitter_ns: int,
    *,
    instants: "_Instants",
) -> DigraphTimes:
    check_time_limit()
    own, components = merged[name], [*merged.values()]
    higher, equal = ([each.name for each in rank] for rank in level_of(own, components))
    blocked_ns = blocking_ns(own, components)
    for each in zip(*(loads[one] for one in (name, *higher, *equal)), strict=True):
        load = sum(each, start=Fraction(0))
        if reason := overload(load, has_more=blocked_ns > 0 or jitter_ns > 0):
            return DigraphTimes(reason=reason, blocking_ns=blocked_ns)
    delay = Delay(
        _together([mixes[each] for each in higher]), _together([mixes[each] for each in equal]), blocked_ns
    )
    try:
        level = [mixes[each] for each in (name, *higher, *equal)]
        return _worst(level, delay, jitter_ns, instants)
    except UnboundedError as error:
        return DigraphTimes(reason=str(error), blocking_ns=blocked_ns)


def _loads(member: Member) -> tuple[Fraction, Fraction]:
    """Before and after the change."""
    before = utilization_of(_task(member, is_new=False))
    return before, utilization_of(_task(member, is_new=True)) if isinstance(member, Participant) else before


def _task(member: Member, *, is_new: bool) -> DigraphTask:
    if isinstance(member, Component):
        return member.task
    part = member.new if is_new else member.old
    return _NOTHING if part is None else part.task


def _worst(mixes: "Sequence[_Mix]", delay: Delay, jitter_ns: int, instants: "_Instants") -> DigraphTimes:
    """The longest of each job of the first one, over all instants of the change."""
    own, works = mixes[0], _together(mixes)

    def window_at_ns(change_ns: int, latest_ns: int = FOREVER_NS) -> int:
        for mix in mixes:
            mix.change_at(change_ns, latest_ns)
        return window_ns(works, delay.blocking_ns)

    before_ns = window_at_ns(FOREVER_NS)
    longest: dict[Job, int] = {}
    walls: dict[str, int] = {}
    changed = [mix for mix in mixes if mix.is_changed]
    for change_ns, next_ns in pairwise((*instants(changed, before_ns + jitter_ns), FOREVER_NS)):
        for path in own.jobs_until(window_at_ns(change_ns, next_ns - 1) + jitter_ns):
            response_ns = delay.finish_ns(path) - (path.release_ns - jitter_ns)
            longest[path.job] = max(response_ns, longest.get(path.job, 0))
        for name, cost_ns in own.states:
            walls[name] = max(delay.wall_ns(cost_ns), walls.get(name, 0))
    jobs = tuple(JobTime(job, response_ns) for job, response_ns in longest.items())
    return DigraphTimes(jobs, blocking_ns=delay.blocking_ns, walls_ns=walls)


def _together(mixes: "Sequence[_Mix]") -> list[Work]:
    """Those that change, and all others as one."""
    changed = [mix for mix in mixes if mix.is_changed]
    others = [mix.unchanged for mix in mixes if not mix.is_changed]
    return [*([_Changed(changed)] if changed else []), *([Together(others)] if others else [])]


class _Changed:
    """What those that change ask for, together."""

    def __init__(self, mixes: "Sequence[_Mix]") -> None:
        self._mixes = mixes

    def in_ns(self, length_ns: int) -> int:
        """The most work that is released in a half-open interval of this length."""
        most_ns = sum(mix.in_ns(length_ns) for mix in self._mixes)
        before_ns = self._mixes[0].most_before_ns
        if before_ns >= most_ns:
            return most_ns
        return min(most_ns, before_ns + sum(mix.after_ns(length_ns) for mix in self._mixes))

    def until_ns(self, instant_ns: int) -> int:
        """The same of the closed [0, instant]."""
        return self.in_ns(instant_ns + 1)


def _instants(changed: "Sequence[_Mix]", window_ns: int) -> Iterator[int]:
    """Of the change, after the begin of the window: at it, and right after each release of an old job."""
    yield 0
    last_ns, steps = 0, 0
    while last_ns <= window_ns:
        following = min((mix.old_release_from(last_ns) for mix in changed), default=FOREVER_NS)
        if following >= FOREVER_NS:
            return
        if (steps := steps + 1) > MOST_STEPS:
            raise UnboundedError(f"the busy window has more than {MOST_STEPS} steps")
        last_ns = following + 1
        yield last_ns


def _some_instants(changed: "Sequence[_Mix]", window_ns: int) -> list[int]:
    """Begins of intervals in which an idle instant may lie: the shorter, the less is too much."""
    parts = range(0, window_ns, max(1, window_ns // _INTERVALS))
    return sorted({*_instants(changed, window_ns), *parts})


class _Mix:
    """What a component asks for in a window, where the change is so long after the begin of the window.

    Instants are nominal, and the window begins `jitter_ns` after 0: releases come up to so late.
    """

    def __init__(self, member: Member, jitter_ns: int, *, is_idle: bool) -> None:
        self.change_ns = FOREVER_NS
        self.most_before_ns = FOREVER_NS
        """Of old jobs, of all that change together."""
        self._is_idle = is_idle
        self._jitter_ns = jitter_ns
        self.is_changed = isinstance(member, Participant)
        self._old_task = _task(member, is_new=False)
        self._new_task = _task(member, is_new=True)
        self._old, self._new = Demand(self._old_task), Demand(self._new_task)
        self.unchanged = Demand(self._old_task, jitter_ns=jitter_ns)
        """What it asks for if nothing of it changes."""
        self._handover_ns = member.handover_ns if isinstance(member, Participant) else 0
        self.states = _states(member)
        self._ahead = paths(self._old_task) if self.is_changed else iter(())
        self._found: list[Path] = []  # of the old task, by their releases
        self._switches: list[tuple[int, int]] = []
        self._switches_at: dict[int, list[tuple[int, int]]] = {}

    def change_at(self, change_ns: int, latest_ns: int) -> None:
        """From now on the answers are for this instant, of an idle one for all in between."""
        self.change_ns = change_ns
        self.most_before_ns = latest_ns if self._is_idle and self.is_changed else FOREVER_NS
        if not self.is_changed or change_ns == FOREVER_NS:
            self._switches = []
            return
        if change_ns not in self._switches_at:
            self._switches_at[change_ns] = [*_pareto(self._all_switches())]
        self._switches = self._switches_at[change_ns]

    def old_release_from(self, instant_ns: int) -> int:
        """The first release of an old job at or after an instant; FOREVER_NS: none, or nothing changes."""
        self._look_to(instant_ns)
        return next((path.release_ns for path in self._found if path.release_ns >= instant_ns), FOREVER_NS)

    def in_ns(self, length_ns: int) -> int:
        """The most work that is released in a half-open interval of this length."""
        if length_ns <= 0:
            return 0
        until_ns = length_ns + self._jitter_ns
        work_ns = min(self._old.in_ns(min(until_ns, self.change_ns)), self.most_before_ns)
        for release_ns, before_ns in self._switches:
            if release_ns >= until_ns:
                break
            done_ns = min(before_ns, self.most_before_ns)
            work_ns = max(work_ns, done_ns + self._new.in_ns(until_ns - release_ns))
        return work_ns + self._handover_ns

    def after_ns(self, length_ns: int) -> int:
        """The most of new jobs, and the handover."""
        return self._new.in_ns(length_ns + self._jitter_ns - self.change_ns) + self._handover_ns

    def jobs_until(self, end_ns: int) -> Iterator[Path]:
        """Jobs that are released before then, with the work up to their ends."""
        if not self.is_changed:
            yield from takewhile(lambda path: path.release_ns < end_ns, paths(self._old_task))
            return
        for path in self._old_before(min(end_ns, self.change_ns)):
            yield path._replace(work_ns=path.work_ns + self._handover_ns)
        for release_ns, before_ns in self._switches:
            work_ns = min(before_ns, self.most_before_ns) + self._handover_ns
            for path in paths(self._new_task):
                if release_ns + path.release_ns >= end_ns:
                    break
                yield Path(release_ns + path.release_ns, work_ns + path.work_ns, path.job)

    def _all_switches(self) -> Iterator[tuple[int, int]]:
        """The first release with the new parts, and the work of old jobs before it."""
        yield self.change_ns, 0
        for path in self._old_before(self.change_ns):
            if path.job.separation_ns != FOREVER_NS:
                yield max(self.change_ns, path.release_ns + path.job.separation_ns), path.work_ns

    def _old_before(self, instant_ns: int) -> Iterator[Path]:
        self._look_to(instant_ns)
        return takewhile(lambda path: path.release_ns < instant_ns, self._found)

    def _look_to(self, instant_ns: int) -> None:
        while not self._found or self._found[-1].release_ns < instant_ns:
            path = next(self._ahead, None)
            if path is None:
                return
            self._found.append(path)


def _states(member: Member) -> tuple[tuple[str, int], ...]:
    if isinstance(member, Component):
        return member.states
    return tuple(state for one in (member.old, member.new) if one is not None for state in one.states)


def _pareto(switches: Iterator[tuple[int, int]]) -> Iterator[tuple[int, int]]:
    """Without those that come no earlier than another one with as much work before."""
    most_ns = -1
    for release_ns, before_ns in sorted(switches, key=lambda one: (one[0], -one[1])):
        if before_ns > most_ns:
            most_ns = before_ns
            yield release_ns, before_ns
