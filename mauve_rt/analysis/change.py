"""Response times while a change is made: each participant has old parts before one instant T, then new ones.

All participants take the change at their first releases at or after the same T. In a busy window that
begins at 0 the change is at x = T - 0, one number for all of them. So each asks for old jobs released
before x, then for new jobs; the worst x of all counts, not the worst one of each participant. The demands
change only where an old job is released, so these instants x are tried.

Before, a participant's new core adopts the state of the old one, and at x takes it: both together at most
`handover_ns`, at some instant of a window.

Source: Tindell, Burns, Wellings, "Mode changes in priority pre-emptively scheduled systems", RTSS 1992, for
one instant instead of a request for each task.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import takewhile

from mauve_rt.analysis.blocking import blocking_ns, shares_a_resource
from mauve_rt.analysis.demand import Demand, Path, cost_of, paths, utilization_of
from mauve_rt.analysis.digraph import DigraphTask, Job
from mauve_rt.analysis.digraph_times import Component, DigraphTimes, JobTime
from mauve_rt.analysis.machines import FOREVER_NS
from mauve_rt.analysis.task import CriticalSection
from mauve_rt.analysis.window import MOST_STEPS, UnboundedError, least_time_ns

_NOTHING = DigraphTask("", ())


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
        for one in (self.old, self.new):
            for section in one.sections if one is not None else ():
                longest[section.resource] = max(section.length_ns, longest.get(section.resource, 0))
        sections = tuple(CriticalSection(resource=name, length_ns=ns) for name, ns in longest.items())
        waits = any(one is not None and one.waits_for_services for one in (self.old, self.new))
        return replace(self.any, sections=sections, waits_for_services=waits)


Member = Component | Participant


def times_during(members: Sequence[Member], *, jitter_ns: int = 0) -> dict[str, DigraphTimes]:
    """The bounds of all components of one CPU, by name, whenever the change comes.

    `jitter_ns`: how long after its instant a thread begins at the latest.

    Raises:
        AnalysisError: as for `ceilings`.

    """
    merged = {_name(one): one.merged if isinstance(one, Participant) else one for one in members}
    return {_name(one): _times(one, members, merged, jitter_ns) for one in members}


def _name(member: Member) -> str:
    return member.any.name if isinstance(member, Participant) else member.name


def _times(
    one: Member, members: Sequence[Member], merged: dict[str, Component], jitter_ns: int
) -> DigraphTimes:
    own = merged[_name(one)]
    others = [each for each in members if each is not one]
    higher = [each for each in others if merged[_name(each)].priority > own.priority]
    equal = [each for each in others if merged[_name(each)].priority == own.priority]
    if own.waits_for_services or shares_a_resource(own, merged.values()):
        higher, equal = [*higher, *equal], []
    blocked_ns = blocking_ns(own, [*merged.values()])
    for load in _loads((one, *higher, *equal)):
        if load > 1 or (load == 1 and (blocked_ns or jitter_ns)):
            reason = f"the utilization at this priority is {float(load):.4g}: nothing is left"
            return DigraphTimes(reason=reason, blocking_ns=blocked_ns)
    try:
        return _worst(one, higher, equal, blocked_ns, jitter_ns)
    except UnboundedError as reason:
        return DigraphTimes(reason=str(reason), blocking_ns=blocked_ns)


def _loads(level: Sequence[Member]) -> Iterator[Fraction]:
    """Before and after the change."""
    for is_new in (False, True):
        tasks = [_task(one, is_new=is_new) for one in level]
        yield sum(map(utilization_of, tasks), start=Fraction(0))


def _task(member: Member, *, is_new: bool) -> DigraphTask:
    if isinstance(member, Component):
        return member.task
    part = member.new if is_new else member.old
    return _NOTHING if part is None else part.task


def _worst(
    one: Member, higher: Sequence[Member], equal: Sequence[Member], blocking: int, jitter_ns: int
) -> DigraphTimes:
    """The longest of each job, over all instants of the change."""
    mixes = {id(each): _Mix(each, jitter_ns) for each in (one, *higher, *equal)}
    ranks = ([mixes[id(each)] for each in higher], [mixes[id(each)] for each in equal])
    own = mixes[id(one)]
    longest: dict[Job, int] = {}
    walls: dict[str, int] = {}
    after_ns = 0  # the end of the window in which nothing has changed yet
    for change_ns in _instants([*mixes.values()]):
        for mix in mixes.values():
            mix.change_at(change_ns)
        level = _Level(own, *ranks, blocking)
        for path in own.jobs_until(level.window_ns + jitter_ns):
            response_ns = level.finish_ns(path) - (path.release_ns - jitter_ns)
            longest[path.job] = max(response_ns, longest.get(path.job, 0))
        for name, cost_ns in own.states:
            walls[name] = max(level.wall_ns(cost_ns), walls.get(name, 0))
        after_ns = after_ns or _window_before(mixes, own, ranks, blocking)
        if change_ns > after_ns + jitter_ns:
            break
    jobs = tuple(JobTime(job, response_ns) for job, response_ns in longest.items())
    return DigraphTimes(jobs, blocking_ns=blocking, walls_ns=walls)


def _window_before(
    mixes: dict[int, "_Mix"], own: "_Mix", ranks: "tuple[list[_Mix], list[_Mix]]", blocking: int
) -> int:
    """The longest busy window that ends before the change; the mixes are of no instant afterwards."""
    before = [mix.change_ns for mix in mixes.values()]
    for mix in mixes.values():
        mix.change_at(FOREVER_NS)
    window_ns = _Level(own, *ranks, blocking).window_ns
    for mix, change_ns in zip(mixes.values(), before, strict=True):
        mix.change_at(change_ns)
    return window_ns


def _instants(mixes: "Sequence[_Mix]") -> Iterator[int]:
    """Of the change, after the begin of the window: at it, and right after each release of an old job."""
    yield 0
    last_ns, steps = 0, 0
    while True:
        following = min((mix.old_release_from(last_ns) for mix in mixes), default=FOREVER_NS)
        if following >= FOREVER_NS:
            return
        if (steps := steps + 1) > MOST_STEPS:
            raise UnboundedError(f"the busy window has more than {MOST_STEPS} steps")
        last_ns = following + 1
        yield last_ns


class _Mix:
    """What a component asks for in a window, where the change is so long after the begin of the window.

    Instants are nominal, and the window begins `jitter_ns` after 0: releases come up to so late.
    """

    def __init__(self, member: Member, jitter_ns: int) -> None:
        self.change_ns = FOREVER_NS
        self._jitter_ns = jitter_ns
        self._is_changed = isinstance(member, Participant)
        self._old_task = _task(member, is_new=False)
        self._new_task = _task(member, is_new=True)
        self._old, self._new = Demand(self._old_task), Demand(self._new_task)
        self._handover_ns = member.handover_ns if isinstance(member, Participant) else 0
        self.states = _states(member)
        self._ahead = paths(self._old_task) if self._is_changed else iter(())
        self._found: list[Path] = []  # of the old task, by their releases
        self._switches: list[tuple[int, int]] = []

    def change_at(self, change_ns: int) -> None:
        """From now on the answers are for this instant."""
        self.change_ns = change_ns
        self._switches = (
            [*_pareto(self._all_switches())] if self._is_changed and change_ns < FOREVER_NS else []
        )

    def old_release_from(self, instant_ns: int) -> int:
        """The first release of an old job at or after an instant; FOREVER_NS: none, or nothing changes."""
        self._look_to(instant_ns)
        return next((path.release_ns for path in self._found if path.release_ns >= instant_ns), FOREVER_NS)

    def in_ns(self, length_ns: int) -> int:
        """The most work that is released in a half-open interval of this length."""
        if length_ns <= 0:
            return 0
        until_ns = length_ns + self._jitter_ns
        if not self._is_changed:
            return self._old.in_ns(until_ns)
        work_ns = self._old.in_ns(min(until_ns, self.change_ns))
        for release_ns, before_ns in self._switches:
            if release_ns >= until_ns:
                break
            work_ns = max(work_ns, before_ns + self._new.in_ns(until_ns - release_ns))
        return work_ns + self._handover_ns

    def until_ns(self, instant_ns: int) -> int:
        """The same of the closed [0, instant]."""
        return self.in_ns(instant_ns + 1)

    def jobs_until(self, end_ns: int) -> Iterator[Path]:
        """Jobs that are released before then, with the work up to their ends."""
        if not self._is_changed:
            yield from takewhile(lambda path: path.release_ns < end_ns, paths(self._old_task))
            return
        for path in self._old_before(min(end_ns, self.change_ns)):
            yield path._replace(work_ns=path.work_ns + self._handover_ns)
        for release_ns, before_ns in self._switches:
            for path in takewhile(lambda one: one.release_ns < end_ns, paths(self._new_task)):
                at_ns = release_ns + path.release_ns
                if at_ns >= end_ns:
                    break
                yield Path(at_ns, before_ns + path.work_ns + self._handover_ns, path.job)

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


class _Level:
    """What can delay the jobs of a component, for one instant of the change."""

    def __init__(self, own: _Mix, higher: Sequence[_Mix], equal: Sequence[_Mix], blocking: int) -> None:
        self._higher, self._equal, self._blocking_ns = higher, equal, blocking
        everything = (own, *higher, *equal)
        self.window_ns = least_time_ns(
            lambda length_ns: blocking + sum(one.in_ns(length_ns) for one in everything), 1
        )

    def finish_ns(self, path: Path) -> int:
        """When the last job of a path is done at the latest, from the window's start on."""
        equal_ns = 0
        if self._equal:
            before_ns = self._blocking_ns + path.work_ns - cost_of(path.job)
            others = (*self._higher, *self._equal)
            start_ns = least_time_ns(
                lambda time_ns: before_ns + sum(one.until_ns(time_ns) for one in others), before_ns
            )
            equal_ns = sum(one.until_ns(start_ns) for one in self._equal)
        return self._least_ns(self._blocking_ns + path.work_ns + equal_ns)

    def wall_ns(self, cost_ns: int) -> int:
        """How long an execution can last."""
        return self._least_ns(self._blocking_ns + cost_ns)

    def _least_ns(self, fixed_ns: int) -> int:
        return least_time_ns(
            lambda time_ns: fixed_ns + sum(one.in_ns(time_ns) for one in self._higher), fixed_ns
        )
