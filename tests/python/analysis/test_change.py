"""Bounds while a change is made: exact by hand, sound against runs, one instant for all participants."""

from random import Random

import pytest
from analysis_machines import MS, execution, machine, wait
from random_digraphs import random_digraph
from schedule_simulation import RUN, Release, simulate, simulated_jobs

from mauve_rt.analysis import change as module
from mauve_rt.analysis.change import Member, Participant, times_during
from mauve_rt.analysis.change_witness import change_witness
from mauve_rt.analysis.digraph import DigraphTask, Job
from mauve_rt.analysis.digraph_times import Component, digraph_times
from mauve_rt.analysis.machines import Machine
from mauve_rt.analysis.study import Study, Surroundings, study, study_of_change
from mauve_rt.analysis.verdict import Outcome
from mauve_rt.model.threads import ThreadList


def loop(name: str, cost: int, separation: int, priority: int, *, part: str = "") -> Component:
    job = Job("W", (part,), cost, "W", separation, 10**6)
    return Component(DigraphTask(name, (job,)), priority)


def responses(members: list[Member]) -> dict[str, int | None]:
    return {name: one.response_ns for name, one in times_during(members).items()}


def test_without_a_participant_the_bounds_are_those_of_the_architecture() -> None:
    for seed in range(200):
        random = Random(seed)  # noqa: S311 - not for secrets
        jitter_ns = random.choice((0, 2))
        tasks = [random_digraph(random, f"T{number}", share=0.25, most_waits=2) for number in range(3)]
        members = [Component(task, random.randint(1, 3), jitter_ns=jitter_ns) for task in tasks]
        exact = digraph_times(members)
        for name, found in times_during(members).items():
            if exact[name].response_ns is not None:
                assert found.response_ns is not None
                assert found.response_ns >= exact[name].response_ns, (seed, name)


def test_both_ends_are_schedulable_and_the_one_below_misses_in_the_change() -> None:
    """The change lets the long job of a before it and the long job of b after it meet in one window."""
    a = Participant(loop("a", 6, 16, 80), loop("a", 2, 16, 80))
    b = Participant(loop("b", 2, 16, 70), loop("b", 6, 16, 70))
    c = loop("c", 6, 48, 60)
    assert digraph_times([a.old, b.old, c])["c"].response_ns == 14
    assert digraph_times([a.new, b.new, c])["c"].response_ns == 14
    found = responses([a, b, c])
    assert found == {"a": 6, "b": 11, "c": 26}, "b comes 1 after the job of a that began before the change"


def test_all_participants_change_at_one_instant() -> None:
    """Each by itself could ask for its two long jobs in a window, but not both: one is long before T only."""
    a = Participant(loop("a", 4, 10, 80), loop("a", 1, 10, 80))
    b = Participant(loop("b", 1, 10, 70), loop("b", 4, 10, 70))
    found = responses([a, b, loop("c", 2, 100, 60)])
    assert found["c"] == 4 + 4 + 2, "not 4 + 4 + 2 of each job that there can be"


def test_the_handover_counts_once() -> None:
    a = Participant(loop("a", 3, 20, 80), loop("a", 3, 20, 80), handover_ns=2)
    found = responses([a, loop("c", 4, 100, 60)])
    assert found == {"a": 5, "c": 9}


def test_one_that_is_added_or_removed_delays_those_below() -> None:
    c = loop("c", 4, 100, 60)
    assert responses([Participant(None, loop("new", 3, 20, 80)), c]) == {"new": 3, "c": 7}
    assert responses([Participant(loop("old", 3, 20, 80), None), c]) == {"old": 3, "c": 7}


def test_an_overload_after_the_change_is_said() -> None:
    a = Participant(loop("a", 3, 10, 80), loop("a", 9, 10, 80))
    found = times_during([a, loop("c", 2, 10, 60)])["c"]
    assert found.reason == "the utilization at this priority is 1.1: nothing is left"


# ---- at an idle instant


def test_at_an_idle_instant_no_window_has_both() -> None:
    """But for those of the component below the participants, whose own job may be under way then."""
    a = Participant(loop("a", 6, 16, 80), loop("a", 2, 16, 80), handover_ns=1)
    b = Participant(loop("b", 2, 16, 70), loop("b", 6, 16, 70))
    c, high = loop("c", 6, 48, 60), loop("high", 1, 48, 90)
    found = {name: one.response_ns for name, one in times_during([a, b, c, high], is_idle=True).items()}
    always = responses([a, b, c, high])
    assert found == {"high": 1, "a": 8, "b": 10, "c": 24}
    assert (always["b"], always["c"]) == (13, 28)


def test_what_participants_did_before_an_idle_instant_is_done() -> None:
    a = Participant(loop("a", 6, 16, 80), loop("a", 2, 16, 80))
    b = Participant(loop("b", 2, 16, 70), loop("b", 6, 16, 70))
    members = [a, b, loop("c", 6, 48, 60)]
    assert responses(members)["c"] == 26
    idle = times_during(members, is_idle=True)["c"].response_ns
    assert idle == 22, "not 20, the long job of each and the next one of a: b may have been short before"


def test_one_with_the_priority_of_the_lowest_participant_may_be_under_way() -> None:
    members = [Participant(loop("a", 4, 16, 70), loop("a", 1, 16, 70)), loop("same", 5, 40, 70)]
    members.append(Participant(loop("b", 1, 16, 80), loop("b", 4, 16, 80)))
    idle = {name: one.response_ns for name, one in times_during(members, is_idle=True).items()}
    always = responses(members)
    assert idle["b"] == 4
    assert {name: idle[name] for name in ("a", "same")} == {name: always[name] for name in ("a", "same")}


# ---- against runs


def random_members(random: Random, *, jitter: int) -> list[Member]:
    """Two to four, one of them at least with other parts after the change."""
    members: list[Member] = []
    count = random.randint(2, 4)
    share = random.uniform(0.3, 0.8) / count
    for number in range(count):
        name, priority = f"T{number}", random.randint(1, 3)
        old, new = (
            Component(random_digraph(random, name, share=share, most_waits=2), priority, jitter_ns=jitter)
            for _ in range(2)
        )
        if number == 0 or random.random() < 0.5:
            kind = random.random()
            handover_ns = random.choice((0, 0, 2))
            if kind < 0.1:
                members.append(Participant(None, new))
            elif kind < 0.2:
                members.append(Participant(old, None))
            else:
                members.append(Participant(old, new, handover_ns))
        else:
            members.append(old)
    return members


def one_run(
    random: Random, member: Member, change_ns: int, *, until: int, jitter: int, is_short: bool = False
) -> list[Release]:
    """Old jobs released before the change, then new ones; the handover is part of the first new one.

    `is_short`: some old jobs take less than they may.
    """
    is_changed = isinstance(member, Participant)
    old = member.old if is_changed else member
    new = member.new if is_changed else None
    found: list[Release] = []
    nominal, last = random.choice((0, 0, random.randint(0, 20))), 0
    is_dense = random.random() < 0.7

    def release(job: Job, more_ns: int) -> None:
        nonlocal nominal, last
        last = max(last, nominal + random.choice((0, random.randint(0, jitter))))
        found.append(Release(nominal, last, [(RUN, (job.cost_ns or 0) + more_ns)]))
        nominal += job.separation_ns + (0 if is_dense else random.choice((0, random.randint(0, 9))))

    if old is not None:
        job = random.choice(old.task.jobs)
        while nominal < (change_ns if is_changed else until):
            cost_ns = job.cost_ns or 0
            release(job, random.randint(min(1 - cost_ns, 0), 0) if is_short and random.random() < 0.5 else 0)
            job = random.choice(old.task.after(job))
    if new is not None:
        nominal = max(nominal, change_ns)
        job, more_ns = random.choice(new.task.jobs), member.handover_ns if is_changed else 0
        while nominal < until:
            release(job, more_ns)
            job, more_ns = random.choice(new.task.after(job)), 0
    return found


def test_runs_find_that_only_the_begin_of_a_window_is_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_instants", lambda *_: iter([0]))
    with pytest.raises(AssertionError, match="seed"):
        test_no_run_with_a_change_is_above_its_bound(0)


@pytest.mark.parametrize("jitter", [0, 3])
def test_no_run_with_a_change_is_above_its_bound(jitter: int) -> None:
    bounded = reached = 0
    for seed in range(400):
        random = Random(seed)  # noqa: S311 - not for secrets
        members = random_members(random, jitter=jitter)
        found = times_during(members)
        parts = dict(zip(found, members, strict=True))
        components = [one.any if isinstance(one, Participant) else one for one in members]
        longest = dict.fromkeys(parts, 0)
        for _ in range(8):
            change_ns = random.randint(0, 120)
            runs = {
                name: one_run(random, one, change_ns, until=240, jitter=jitter) for name, one in parts.items()
            }
            for name, response_ns in simulate(components, runs).items():
                longest[name] = max(longest[name], response_ns)
        for name, one in found.items():
            if one.response_ns is not None:
                assert longest[name] <= one.response_ns, f"seed {seed}, {name}"
                bounded += 1
                reached += longest[name] == one.response_ns
    assert bounded > 400
    assert reached > bounded / 10


def seeded_runs(
    seed: str, parts: dict[str, Member], change_ns: int, *, jitter: int
) -> dict[str, list[Release]]:
    """Of one seed the same until the change, whenever that is."""
    return {
        name: one_run(
            Random(f"{seed} {name}"),  # noqa: S311 - not for secrets
            one,
            change_ns,
            until=240,
            jitter=jitter,
            is_short=True,
        )
        for name, one in parts.items()
    }


def idle_instant(
    members: list[Member],
    olds: dict[str, list[Release]],
    finished: dict[str, list[tuple[int, int]]],
    since_ns: int,
) -> int | None:
    """The first one at which no participant has a job pending and none above the lowest one is ready."""
    lowest = min(one.any.priority for one in members if isinstance(one, Participant))
    spans: list[tuple[int, int]] = []
    for one in members:
        is_participant = isinstance(one, Participant)
        own = one.any if is_participant else one
        if is_participant or own.priority > lowest:
            begins = [each.arrival_ns if is_participant else each.release_ns for each in olds[own.name]]
            spans += zip(begins, (end for _, end in finished[own.name]), strict=True)
    return next(
        (at for at in range(since_ns, 200) if not any(begin < at < end for begin, end in spans)), None
    )


@pytest.mark.parametrize("jitter", [0, 3])
def test_no_run_with_a_change_at_an_idle_instant_is_above_its_bound(jitter: int) -> None:
    bounded = shorter = 0
    for seed in range(400):
        random = Random(seed)  # noqa: S311 - not for secrets
        members = random_members(random, jitter=jitter)
        found, always = times_during(members, is_idle=True), times_during(members)
        parts = dict(zip(found, members, strict=True))
        components = [one.any if isinstance(one, Participant) else one for one in members]
        longest = dict.fromkeys(parts, 0)
        for number in range(8):
            olds = seeded_runs(f"{seed} {number}", parts, 240, jitter=jitter)
            at = idle_instant(members, olds, simulated_jobs(components, olds), random.randint(0, 120))
            if at is not None:
                for name, response_ns in simulate(
                    components, seeded_runs(f"{seed} {number}", parts, at, jitter=jitter)
                ).items():
                    longest[name] = max(longest[name], response_ns)
        for name, one in found.items():
            if one.response_ns is not None:
                assert longest[name] <= one.response_ns, f"seed {seed}, {name}"
                bounded += 1
                shorter += always[name].response_ns is None or one.response_ns < always[name].response_ns
    assert bounded > 400
    assert shorter > 40


def test_runs_find_that_the_instant_of_the_change_is_not_idle(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(globals(), "idle_instant", lambda *found: found[-1])
    with pytest.raises(AssertionError, match="seed"):
        test_no_run_with_a_change_at_an_idle_instant_is_above_its_bound(0)


# ---- a run that misses a deadline in a change


def study_for(machines: list[Machine]) -> Study:
    return study(machines, NOTHING_ELSE)


NOTHING_ELSE = Surroundings(threads=ThreadList(0, 0, ()))


def random_machines(random: Random) -> list[Machine]:
    return [
        machine(
            execution("Run", "Pause", wcet_ms=random.randint(1, 6), initial=True),
            wait("Pause", "Run", ms=period),
            name=f"T{number}",
            priority=60 - number,
            offset_ns=random.choice((0, 0, 3 * MS)),
        )
        for number, period in enumerate((12, 18, 30))
    ]


def test_no_run_of_a_change_is_above_its_bound() -> None:
    met = missed = 0
    for seed in range(30):
        random = Random(seed)  # noqa: S311 - not for secrets
        one, other = study_for(random_machines(random)), study_for(random_machines(random))
        found = study_of_change(one, other, {}, NOTHING_ELSE)
        sides = [{subject.name: subject for subject in each.subjects} for each in (one, other)]
        run = change_witness(*sides, {})
        if found.verdict.outcome == Outcome.SCHEDULABLE:
            met += 1
            assert run is None, seed
        if run is not None and run[0].missed is not None:
            missed += 1
            cycle = run[0].missed
            response_ns = found.bounds[cycle.component].response_ns
            if response_ns is not None:
                assert cycle.finish_ns - cycle.nominal_ns <= response_ns, seed
    assert met > 3
    assert missed > 3
