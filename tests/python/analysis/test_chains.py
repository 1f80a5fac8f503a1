"""Bounds of chains: by hand, against simulated runs, with planted mistakes; reasons why there is none."""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from random import Random
from types import SimpleNamespace

import numpy as np
import pytest
from analysis_machines import MS, connected, event, execution, machine, wait
from schedule_simulation import RUN, Release, simulated_jobs

from mauve_rt.analysis.chains import Channel, Route, RouteBound, assumptions_of, longest_wait_ns, route_bound
from mauve_rt.analysis.machines import Machine
from mauve_rt.analysis.study import Study, Surroundings, study
from mauve_rt.trace.reading.chains import Jobs, data_ages_ns, reactions_ns


def loop(name: str, cost_ms: float, period_ms: int, priority: int = 50, **told: object) -> Machine:
    return machine(
        execution("Run", "Pause", wcet_ms=cost_ms, initial=True),
        wait("Pause", "Run", ms=period_ms),
        name=name,
        priority=priority,
        **told,
    )


def sporadic(name: str, cost_ms: int, least_ms: int, longest_ms: int, **told: object) -> Machine:
    """On events, with a timeout."""
    wakes = event("Wait", "Run", least_ms=least_ms, initial=True)
    wakes.duration_ns = longest_ms * MS
    return machine(execution("Run", "Wait", wcet_ms=cost_ms), wakes, name=name, **told)


def studied(*machines: Machine, wakeup_ns: int = 0, tasks: Sequence[object] = ()) -> Study:
    return study(
        machines, Surroundings(threads=SimpleNamespace(wakeup_ns=wakeup_ns, overhead_ns=0, tasks=tasks))
    )


def bound_of(*machines: Machine, channels: Sequence[Channel] = (), wakeup_ns: int = 0) -> RouteBound:
    """Of the chain through these components in their order; channel c0 is in front of the first one."""
    route = Route(tuple(one.name for one in machines), tuple(f"c{n}" for n in range(len(machines) + 1)))
    known = {one.name: one for one in channels}
    return route_bound(route, known, studied(*machines, wakeup_ns=wakeup_ns), wakeup_ns=wakeup_ns)


# ---- by hand


def test_a_chain_waits_for_each_release_and_each_response() -> None:
    found = bound_of(
        loop("a", 1, 10, 60, cpus=[0]), loop("b", 2, 20, 50, cpus=[1]), loop("c", 3, 30, cpus=[2])
    )
    assert found.longest_ns == (10 + 1 + 20 + 2 + 30 + 3) * MS
    assert ", ".join(map(str, found.terms)) == (
        "a 10.000 + 1.000 ms, b 20.000 + 2.000 ms, c 30.000 + 3.000 ms"
    )
    assert str(found.route) == "c0 -> a -> c1 -> b -> c2 -> c -> c3"


def test_the_longest_wait_of_a_digraph_counts_and_of_an_event_the_timeout() -> None:
    uneven = machine(
        execution("Run", "Short", "Long", wcet_ms=1, initial=True),
        wait("Short", "Run", ms=5),
        wait("Long", "Run", ms=40),
        name="uneven",
    )
    found = studied(uneven, sporadic("event", 1, 4, 25, cpus=[1]))
    assert [longest_wait_ns(subject) for subject in found.subjects] == [40 * MS, 25 * MS]


def test_a_member_finishes_before_a_lower_one_on_its_cpu_begins() -> None:
    """Only there its response is not counted, but the late wake-up is."""
    high, low = loop("a", 2, 10, 60), loop("b", 1, 20, 50)
    assert bound_of(high, low).longest_ns == (10 + 20 + 3) * MS
    assert bound_of(high, low, wakeup_ns=MS // 2).terms[0].counted_ns == MS // 2
    for other in (loop("b", 1, 20, 60), loop("b", 1, 20, 70), loop("b", 1, 20, 50, cpus=[1])):
        found = bound_of(high, other)
        assert found.terms[0].counted_ns == found.terms[0].response_ns > 0
    assert bound_of(low, high).terms[0].counted_ns == 3 * MS
    calling = replace(high, clients=("lamp",))
    assert bound_of(calling, low).terms[0].counted_ns == 2 * MS, (
        "it leaves the CPU as it waits for the answer"
    )


def test_a_member_that_waits_for_a_lock_of_a_thread_counts_with_its_response() -> None:
    high, low = loop("a", 2, 10, 60, ports=connected(scan=1)), loop("b", 1, 20, 50)
    thread = SimpleNamespace(name="mirror", cpus=[], priority=0, resource="scan")
    route = Route(("a", "b"), ("", "x", ""))
    alone = route_bound(route, {}, studied(high, low))
    shared = route_bound(route, {}, studied(high, low, tasks=[thread]))
    assert alone.terms[0].counted_ns == 0
    assert shared.terms[0].counted_ns == shared.terms[0].response_ns == 3 * MS, "blocked for 1 ms"


def test_a_queue_delays_by_a_job_for_each_element() -> None:
    queue = Channel("c1", "ring_buffer", capacity=4, overwrites=True, writers=("a",), readers=("b",))
    found = bound_of(loop("a", 1, 10, cpus=[0]), loop("b", 2, 20, cpus=[1]), channels=[queue])
    assert found.longest_ns == (10 + 1 + 4 * 20 + 2) * MS
    assert str(found.terms[1]) == "b 4 x 20.000 + 2.000 ms"


# ---- without a bound


@pytest.mark.parametrize(
    ("channel", "why"),
    [
        (Channel("c1", "ring_buffer", 4), "c1 refuses values when it is full: set overwrite to true"),
        (
            Channel("c1", "ring_buffer", overwrites=True),
            "nothing here says the capacity of the queue c1: analyze the architecture file",
        ),
        (
            Channel("c1", "ring_buffer", 4, overwrites=True, readers=("b", "x")),
            "c1 has several readers (b, x): each takes values of the others",
        ),
        (
            Channel("c1", "latest_value", writers=("a", "/scan")),
            "c1 has more writers (/scan): they may hide a value of the chain",
        ),
        (Channel("c1", "pkg/Map"), "c1 is a pkg/Map: nothing says when its readers get a value"),
    ],
)
def test_a_channel_that_may_lose_a_value_is_named(channel: Channel, why: str) -> None:
    found = bound_of(loop("a", 1, 10), loop("b", 1, 20), channels=[channel])
    assert (found.longest_ns, found.reasons) == (None, (why,))


def test_nothing_has_to_be_known_of_the_readers_of_the_last_resource() -> None:
    last = Channel("c1", "pkg/Map", writers=("a", "x"), readers=("y",))
    assert bound_of(loop("a", 1, 10), channels=[last]).longest_ns == 11 * MS


def test_a_queue_at_the_end_may_refuse_the_output() -> None:
    full = Channel("c1", "ring_buffer", 4, readers=("x", "y"))
    assert bound_of(loop("a", 1, 10), channels=[full]).reasons == (
        "c1 refuses values when it is full: set overwrite to true",
    )
    assert bound_of(loop("a", 1, 10), channels=[replace(full, overwrites=True)]).longest_ns == 11 * MS


def test_a_member_without_a_bound_is_named() -> None:
    python = bound_of(loop("a", 1, 10, 60), loop("b", 1, 20, is_python=True))
    assert python.reasons == ("b has no response bound: it is not provable",)
    forever = machine(execution("Run", "Wait", wcet_ms=1), event("Wait", "Run", least_ms=10, initial=True))
    assert bound_of(forever).reasons == ("c may wait forever in Wait: give the event wait a timeout",)
    late = bound_of(loop("a", 6, 10, 60, deadline_ns=40 * MS), loop("b", 4, 20, 50, deadline_ns=40 * MS))
    assert late.longest_ns is not None
    skips = bound_of(loop("b", 4, 8, 50, deadline_ns=40 * MS), loop("a", 5, 20, 60))
    assert skips.reasons == (
        "b may miss a release: a job has a response of 9.000 ms and 8.000 ms to the next one",
    )
    cut = machine(
        execution("Run", "Pause", wcet_ms=2, bound_ms=3, initial=True),
        wait("Pause", "Run", ms=20),
        name="cut",
    )
    (why,) = bound_of(cut, loop("a", 2, 20, 60)).reasons
    assert why.startswith("cut may be faulted: Run may last 4.000 ms, ")
    catches_up = replace(loop("b", 4, 8, 50, deadline_ns=40 * MS), overrun="catch_up")
    assert bound_of(catches_up, loop("a", 5, 20, 60)).longest_ns == (8 + 9 + 20 + 5) * MS


def test_nothing_is_known_of_a_chain_on_an_unknown_computer() -> None:
    unknown = Surroundings(threads=SimpleNamespace(wakeup_ns=-1, overhead_ns=0, tasks=()))
    found = route_bound(Route(("a",), ("", "")), {}, study([loop("a", 1, 10)], unknown))
    assert found.longest_ns is None
    assert found.reasons[0].startswith("this computer: its longest wake-up is not declared")


def test_what_a_chain_assumes() -> None:
    route = Route(("a", "b"), ("in", "x", "out"))
    channels = {"in": Channel("in", "shared_data", topics=("/in",)), "x": Channel("x")}
    assert [*assumptions_of([route], channels)] == [
        "each job of a member reads its input and then writes its output; of a queue it takes an element",
        "the readers of x get the newest value (nothing here says the kind)",
        "no time passes on /in: the transport is not counted",
    ]


# ---- against runs

Run = list[list[tuple[int, int]]]
"""Of each member: begin and finish of each job."""


def random_chain(random: Random) -> list[Machine]:
    """Members on one or two CPUs, periodic or on events, with distinct or equal priorities."""
    members = []
    for number in range(random.randint(1, 3)):
        least = random.randint(6, 30)
        longest = least + random.choice((0, 0, random.randint(1, 20)))
        cost = random.randint(1, max(1, least // 4))
        told = {"cpus": [random.randint(0, 1)], "priority": random.randint(50, 53), "deadline_ns": least * MS}
        members.append(sporadic(f"m{number}", cost, least, longest, **told))
    return members


def run_of(random: Random, members: Sequence[Machine], *, wakeup: int, until: int = 600) -> Run:
    """A run of all of them: some gaps shortest, some longest; most jobs as long as they may be."""
    finished: dict[str, list[tuple[int, int]]] = {}
    together = random.randint(0, 20)
    for cpu in (0, 1):
        here = [one for one in members if one.cpus == (cpu,)]
        releases = {}
        for one in here:
            wakes = next(state for state in one.states if state.is_wait)
            cost = next(state.time.ns or 0 for state in one.states if not state.is_wait)
            least, longest = wakes.separation_ns // MS, wakes.latest_ns // MS
            usual = random.choice(([longest], [least], [least, longest], [random.randint(least, longest)]))
            arrival, jobs = random.choice((together, random.randint(0, 40))), []
            while arrival < until:
                took = cost // MS if random.random() < 0.8 else random.randint(1, cost // MS)
                late = random.choice((0, wakeup))
                jobs.append(Release(arrival, arrival + late, [(RUN, took)]))
                arrival += random.choice(usual)
            releases[one.name] = jobs
        finished |= simulated_jobs(here, releases)
    return [finished[one.name] for one in members]


def longest_of_registers(run: Run, *, capacity: int = 0) -> tuple[int, int]:
    """Reaction time and data age with a register behind each member, or a queue between the first two."""
    start, end = max(jobs[0][0] for jobs in run), min(jobs[-1][1] for jobs in run)
    events = sorted(
        (time, not is_end, member, job)
        for member, jobs in enumerate(run)
        for job, ends in enumerate(jobs)
        for is_end, time in enumerate(ends)
    )
    registers: list[int | None] = [None] * (len(run) + 1)
    queue: deque[int | None] = deque(maxlen=capacity)
    held: dict[int, int | None] = {}
    outputs: list[tuple[int, int]] = []  # instant and source
    for time, is_begin, member, _ in events:
        if is_begin:
            if member == 1 and capacity and queue:
                registers[1] = queue.popleft()
            held[member] = registers[member] if member else time
        elif member == 0 and capacity:
            queue.append(held[0])
        else:
            registers[member + 1] = held[member]
            if member == len(run) - 1 and held[member] is not None and time <= end:
                outputs.append((time, held[member] or 0))
    age = max(
        (time - before for (_, before), (time, _) in pairwise(outputs) if before >= start),
        default=0,
    )
    reactions = []
    for begin, _ in run[0]:
        shown = next((time for time, source in outputs if source > begin), None)
        if begin >= start and shown is not None:
            reactions.append(shown - begin)
    return max(reactions, default=0), age


def known_jobs(run: Run) -> list[Jobs]:
    """As the trace would give them."""
    limits = np.iinfo(np.int64)
    found = []
    for jobs in run:
        begins, ends = (np.array(column, np.int64) for column in zip(*jobs, strict=True))
        unknown = np.array([(limits.min, begins[0]), (ends[-1], limits.max)], np.int64)
        found.append(Jobs(begins, ends, unknown))
    return found


Change = Callable[[RouteBound], int]


def _without(index: int, part: str) -> Change:
    return lambda bound: (bound.longest_ns or 0) - getattr(bound.terms[index], part)


MISTAKES: dict[str, Change] = {
    "forgets the wait of the first member": _without(0, "wait_ns"),
    "forgets the wait of the last member": _without(-1, "wait_ns"),
    "forgets the response of the last member": _without(-1, "counted_ns"),
    "forgets each other response": lambda bound: (
        sum(one.wait_ns for one in bound.terms) + bound.terms[-1].counted_ns
    ),
    "counts half of each wait": lambda bound: sum(one.wait_ns // 2 + one.counted_ns for one in bound.terms),
}


def chains(count: int, *, wakeup: int = 0, runs: int = 4) -> list[tuple[RouteBound, list[Run]]]:
    found = []
    for seed in range(count):
        random = Random(seed)  # noqa: S311 - no cryptography
        members = random_chain(random)
        bound = bound_of(*members, wakeup_ns=wakeup * MS)
        if bound.longest_ns is not None:
            found.append((bound, [run_of(random, members, wakeup=wakeup) for _ in range(runs)]))
    assert len(found) > count / 2
    return found


@pytest.mark.parametrize("wakeup", [0, 2])
def test_no_run_of_a_chain_is_above_its_bound(wakeup: int) -> None:
    near = equal = with_shortcut = 0
    every = chains(800, wakeup=wakeup)
    for bound, runs in every:
        times = [longest_of_registers(run) for run in runs]
        longest = max(max(pair) for pair in times) * MS
        assert longest <= (bound.longest_ns or 0), f"{bound.terms}"
        equal += all(reaction == age for reaction, age in times)
        is_near = longest >= 0.95 * (bound.longest_ns or 0)
        near += is_near
        with_shortcut += is_near and any(one.counted_ns < one.response_ns for one in bound.terms)
    assert near > len(every) / 20, "the runs come near the bounds"
    assert with_shortcut, "also where a response is not counted"
    assert equal > 0.9 * len(every), "both maxima are equal, but at the borders of a run"


@pytest.mark.parametrize("mistake", [*MISTAKES.values()], ids=[*MISTAKES])
def test_runs_find_a_mistake_in_the_bound_of_a_chain(mistake: Change) -> None:
    assert any(
        max(longest_of_registers(run)) * MS > mistake(bound) for bound, runs in chains(200) for run in runs
    )


def test_runs_find_a_forgotten_wake_up() -> None:
    """A member of higher priority that wakes up late lets the next one read too early."""
    above = 0
    for bound, runs in chains(2000, wakeup=2, runs=6):
        wakeups = sum(one.counted_ns for one in bound.terms if one.counted_ns < one.response_ns)
        above += any(max(longest_of_registers(run)) * MS > (bound.longest_ns or 0) - wakeups for run in runs)
    assert above


def test_what_the_jobs_of_a_trace_show_is_what_registers_show() -> None:
    compared = 0
    for _, runs in chains(300):
        for run in runs:
            reaction, _ = longest_of_registers(run)
            found = reactions_ns(known_jobs(run))
            assert max(found, default=0) == reaction
            ages = data_ages_ns(known_jobs(run))
            assert max(ages, default=0) <= reaction
            compared += reaction > 0
    assert compared


@pytest.mark.parametrize("capacity", [1, 3])
def test_no_run_with_a_queue_is_above_its_bound(capacity: int) -> None:
    near = without_queue = 0
    for seed in range(400):
        random = Random(seed)  # noqa: S311 - no cryptography
        slow = random.randint(12, 30)
        writer = sporadic("m0", 1, random.randint(4, 10), 10, cpus=[0])
        reader = sporadic("m1", random.randint(1, 4), slow, slow, cpus=[1])
        queue = Channel("c1", "ring_buffer", capacity, overwrites=True, writers=("m0",), readers=("m1",))
        bound = bound_of(writer, reader, channels=[queue]).longest_ns or 0
        run = run_of(random, [writer, reader], wakeup=0)
        reaction, age = longest_of_registers(run, capacity=capacity)
        assert max(reaction, age) * MS <= bound
        near += reaction * MS >= 0.9 * bound
        without_queue += reaction * MS > (bound_of(writer, reader).longest_ns or 0)
    assert near
    assert bool(without_queue) == (capacity > 1), "a bound that forgets the queue is too short"
