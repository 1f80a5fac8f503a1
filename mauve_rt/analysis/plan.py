"""Bounds while a change is made, of components as an architecture has them before and after it."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from mauve_rt.analysis.bounds import Bound, Subject, bound_of, by_cpu, component_of, delaying
from mauve_rt.analysis.change import Member, Participant, times_during
from mauve_rt.analysis.digraph import DigraphTask
from mauve_rt.analysis.digraph_times import DigraphTimes

Handovers = Mapping[str, int | None]
"""For how long the threads of participants adopt and take the state of old cores, in ns; None: not known."""


def subjects_during(
    before: Sequence[Subject], after: Sequence[Subject], handovers: Handovers
) -> list[Subject]:
    """All that is there before or after the change; a participant with the states and the jobs of both."""
    olds, news = _by_name(before), _by_name(after)
    return [
        _joined(name, olds.get(name), news.get(name), handovers) for name in dict.fromkeys((*olds, *news))
    ]


def bounds_during(
    subjects: Sequence[Subject],
    before: Sequence[Subject],
    after: Sequence[Subject],
    handovers: Handovers,
    *,
    known: Mapping[str, Bound] | None = None,
    wakeup_ns: int = 0,
    is_idle: bool = False,
) -> dict[str, Bound]:
    """The bound of each of `subjects_during`, whenever the change comes.

    `known`: bounds before the change; those on CPUs that it does not touch stay.
    `wakeup_ns`: how long after its instant a thread begins at the latest, on this computer.
    `is_idle`: as for `times_during`.
    """
    olds, news = _by_name(before), _by_name(after)
    times: dict[str, DigraphTimes] = {}
    bounds: dict[str, Bound] = {}
    for here in by_cpu(subjects):
        if known is not None and all(
            one.name not in handovers and olds.get(one.name) == one == news.get(one.name) for one in here
        ):
            bounds |= {
                one.name: known[one.name]
                for one in here
                if one.machine.is_component and not delaying(one, subjects)
            }
            continue
        members = [
            _member(
                olds.get(subject.name),
                news.get(subject.name),
                handovers.get(subject.name),
                jitter_ns=wakeup_ns,
            )
            for subject in here
        ]
        found = times_during(members, is_idle=is_idle)
        times |= {subject.name: found[subject.name] for subject in here if subject.machine.is_component}
    for subject in subjects:
        if subject.machine.is_component and subject.name not in bounds:
            bounds[subject.name] = bound_of(subject, subjects, times)
    return bounds


def _by_name(subjects: Sequence[Subject]) -> dict[str, Subject]:
    return {subject.name: subject for subject in subjects}


def _joined(name: str, old: Subject | None, new: Subject | None, handovers: Handovers) -> Subject:
    one = old or new
    if one is None:
        raise ValueError("a component is there before a change or after it")
    if old is None or new is None:
        return one
    obstacles = dict.fromkeys((*old.obstacles, *new.obstacles, *_changing(name, old, new, handovers)))
    if is_same(old, new, is_handed_over=name in handovers):
        return replace(old, obstacles=tuple(obstacles))
    holds = {hold.resource: hold for hold in (*old.machine.holds, *new.machine.holds)}
    machine = replace(
        new.machine,
        states=(*old.machine.states, *new.machine.states),
        holds=tuple(holds.values()),
        clients=tuple(sorted({*old.machine.clients, *new.machine.clients})),
    )
    task = DigraphTask(name, tuple(dict.fromkeys((*old.task.jobs, *new.task.jobs))))
    return Subject(machine, task, tuple(obstacles))


def is_same(old: Subject | None, new: Subject | None, *, is_handed_over: bool) -> bool:
    """Whether nothing of a component changes."""
    if old is None or new is None or is_handed_over:
        return False
    return old.machine == new.machine


def _changing(name: str, old: Subject, new: Subject, handovers: Handovers) -> Iterator[str]:
    if name in handovers and handovers[name] is None:
        yield "its new core declares no budget_ns of adopt and take: declare it"
    before, after = old.machine, new.machine
    if (before.cpus, before.priority) != (after.cpus, after.priority):
        yield "its CPU or its priority changes: make two changes of it, and ask for each"


def _member(old: Subject | None, new: Subject | None, handover_ns: int | None, *, jitter_ns: int) -> Member:
    if old is not None and is_same(old, new, is_handed_over=handover_ns is not None):
        return component_of(old, jitter_ns=jitter_ns)
    parts = [component_of(one, jitter_ns=jitter_ns) if one is not None else None for one in (old, new)]
    return Participant(parts[0], parts[1], handover_ns or 0)
