"""Bounds of components, only where all that may delay them is known."""

from dataclasses import replace
from types import SimpleNamespace

from analysis_machines import MS, connected, event, execution, machine, wait
from schedule_simulation import LOCK, RUN, UNLOCK, WAIT, Release, simulate

from mauve_rt.analysis.bounds import OFFSETS, Bound, Subject, bounds_of, grid_of
from mauve_rt.analysis.digraph_times import Component
from mauve_rt.analysis.locks import with_measured_holds
from mauve_rt.analysis.machines import ExecutionTime, Hold, Machine
from mauve_rt.analysis.obstacles import assumptions_about
from mauve_rt.analysis.offsets import Grid
from mauve_rt.analysis.plan import bounds_during, subjects_during
from mauve_rt.analysis.study import Surroundings, study
from mauve_rt.analysis.threads import machines_of
from mauve_rt.model.threads import ThreadInfo, ThreadList


def loop(name: str, cost_ms: float, period_ms: int, **told: object) -> Machine:
    states: list[SimpleNamespace] = [
        execution("Run", "Pause", wcet_ms=cost_ms, initial=True),
        wait("Pause", "Run", ms=period_ms),
    ]
    return machine(*states, name=name, **told)


def bounds(*machines: Machine, wakeup_ns: int = 0) -> dict[str, Bound]:
    return bounds_of([Subject.of(one, machines) for one in machines], wakeup_ns=wakeup_ns)


def test_those_of_higher_priority_delay_those_below_and_not_the_reverse() -> None:
    found = bounds(loop("high", 1, 4, priority=60), loop("low", 3, 20, priority=50))
    assert found == {"high": Bound(1 * MS, 4 * MS), "low": Bound(4 * MS, 20 * MS)}
    assert all(one.meets_deadline for one in found.values())


def test_the_next_release_of_the_higher_one_counts() -> None:
    found = bounds(loop("high", 2, 5, priority=60), loop("low", 4, 20, priority=50))
    assert found["low"].response_ns == 8 * MS, "4 and two times 2"


def test_another_cpu_delays_nothing() -> None:
    found = bounds(loop("high", 3, 4, priority=60, cpus=[1]), loop("low", 3, 20, priority=50))
    assert found["low"].response_ns == 3 * MS


def test_a_late_wake_up_is_part_of_the_response() -> None:
    assert bounds(loop("one", 1, 10), wakeup_ns=MS // 10)["one"].response_ns == 11 * MS // 10


def test_each_job_has_its_deadline_and_each_way_its_distance() -> None:
    states = [
        execution("Look", "Short", "Long", wcet_ms=1, initial=True),
        execution("Long", "Rest", wcet_ms=4),
        wait("Short", "Look", ms=5),
        wait("Rest", "Look", ms=50),
    ]
    found = bounds(machine(*states, name="two", priority=60), loop("low", 1, 100, priority=50))
    assert found["two"] == Bound(5 * MS, 50 * MS), "the longest"
    assert {(one.job.until, one.response_ns) for one in found["two"].jobs} == {
        ("Short", 1 * MS),
        ("Rest", 5 * MS),
    }
    assert found["low"] == Bound(6 * MS, 100 * MS), "the long way and itself"


def test_a_late_job_is_shown_though_another_one_lasts_longer() -> None:
    states = [
        execution("Look", "Short", "Long", wcet_ms=1, initial=True),
        execution("Long", "Rest", wcet_ms=4),
        wait("Short", "Look", ms=5),
        wait("Rest", "Look", ms=50),
    ]
    found = bounds(loop("high", 3, 50, priority=70), machine(*states, name="two", priority=60))["two"]
    assert found == Bound(8 * MS, 50 * MS)
    late = bounds(loop("high", 5, 50, priority=70), machine(*states, name="two", priority=60))["two"]
    assert late == Bound(6 * MS, 5 * MS)
    assert not late.meets_deadline


def test_where_one_that_may_delay_it_is_unknown_there_is_no_bound() -> None:
    why = "unknown may delay it, and nothing is proved of that"
    for told in ({"cpus": [0]}, {"cpus": []}, {"cpus": [0, 1]}):
        found = bounds(
            loop("unknown", 0, 4, priority=60, **told), loop("one", 1, 10), loop("top", 1, 9, priority=70)
        )
        assert found["one"] == Bound(None, 10 * MS, why), told
        assert not found["one"].meets_deadline
        assert found["top"].response_ns == 1 * MS, "it is above"
        assert found["unknown"].response_ns is None
    assert (
        bounds(loop("unknown", 0, 4, priority=60, cpus=[1]), loop("one", 1, 10))["one"].response_ns == 1 * MS
    )


def test_equals_go_one_after_the_other() -> None:
    found = bounds(loop("a", 2, 20), loop("b", 3, 20))
    assert (found["a"].response_ns, found["b"].response_ns) == (5 * MS, 5 * MS)


def test_a_component_that_only_waits_takes_next_to_nothing() -> None:
    found = bounds(
        machine(wait("A", "B", ms=3, initial=True), wait("B", "A", ms=7)), loop("one", 1, 10, priority=10)
    )
    assert found["c"] == Bound(1, 3 * MS), "it has to get the processor"
    assert found["one"].response_ns == 1 * MS + 1


# ---- locks of resources


def test_one_below_that_holds_a_lock_blocks_those_up_to_the_highest_user() -> None:
    found = bounds(
        loop("top", 1, 20, priority=70),
        loop("user", 1, 20, priority=60, ports=connected(map=2)),
        loop("between", 1, 20, priority=50),
        loop("holder", 4, 50, priority=40, ports=connected(map=2)),
    )
    assert found["top"] == Bound(1 * MS, 20 * MS), "no user of the map is above it"
    assert found["user"] == Bound(4 * MS, 20 * MS, blocking_ns=2 * MS)
    assert found["between"] == Bound(5 * MS, 20 * MS, blocking_ns=2 * MS), "the holder inherits"
    assert found["holder"] == Bound(7 * MS, 50 * MS)


def test_no_lock_is_held_for_longer_than_a_job_of_its_holder_takes() -> None:
    found = bounds(
        loop("user", 3, 20, priority=60, ports=connected(map=5)),
        loop("holder", 1, 50, priority=40, ports=connected(map=5)),
    )
    assert found["user"] == Bound(4 * MS, 20 * MS, blocking_ns=1 * MS)


def test_each_holder_and_each_resource_blocks_once() -> None:
    high = loop("high", 1, 40, priority=60, ports=connected(a=2, b=5))
    one, two = connected(a=2, b=5), connected(a=2, b=5)
    found = bounds(
        high, loop("one", 9, 90, priority=40, ports=one), loop("two", 9, 90, priority=30, ports=two)
    )
    assert found["high"].blocking_ns == 7 * MS


def test_a_wait_for_a_service_counts_as_execution_and_with_locks_nothing_is_proved() -> None:
    kinds = {"lamp": "client"}
    caller = loop("caller", 3, 20, priority=60, ports=connected(lamp=0), kinds=kinds)
    assert bounds(caller, loop("low", 1, 20))["low"].response_ns == 4 * MS
    line = "wcet_ns of caller has its waits for services in it (lamp)"
    assert line in [*assumptions_about([caller])]
    user = loop("user", 3, 20, priority=60, ports=connected(lamp=0, map=1), kinds=kinds)
    found = bounds(user, loop("holder", 2, 50, priority=40, ports=connected(map=1)))
    assert found["user"].response_ns is None
    assert found["user"].reason == "a lock may block user again after each wait for a service (lamp)"


def test_a_caller_that_a_lock_may_block_leaves_those_below_it_without_a_bound() -> None:
    """In each wait of the caller, the holder locks again: the caller comes late, and its next job in time."""
    caller = loop("caller", 29, 56, priority=60, ports=connected(lamp=0, map=1), kinds={"lamp": "client"})
    below = loop("below", 10, 200, priority=50)
    holder = loop("holder", 30, 1000, priority=40, ports=connected(map=10))
    three_times = [(RUN, 1), (WAIT, 1), (LOCK, "map"), (RUN, 1), (UNLOCK, "map")] * 3
    releases = {
        "caller": [Release(at, at, [*three_times, (RUN, 20)]) for at in (0, 56)],
        "below": [Release(26, 26, [(RUN, 10)])],
        "holder": [Release(0, 0, [(LOCK, "map"), (RUN, 10), (UNLOCK, "map")] * 3)],
    }
    subjects = [Subject.of(one) for one in (caller, below, holder)]
    components = [Component(one.task, one.machine.priority) for one in subjects]
    assert simulate(components, releases)["below"] > 10 + 10 + 29, "one job of each"
    found = bounds(caller, below, holder, loop("above", 1, 100, priority=70))
    assert found["below"].reason == "a lock may block caller again after each wait for a service (lamp)"
    assert found["above"].response_ns == 1 * MS
    elsewhere = replace(below, cpus=(1,))
    assert bounds(caller, elsewhere, holder)["below"].response_ns == 10 * MS


def enforced(name: str, priority: int, *, bound_ms: float = 0.0) -> Machine:
    return machine(
        execution("Run", "Pause", wcet_ms=1, bound_ms=bound_ms, initial=True, enforced=True),
        wait("Pause", "Run", ms=20),
        name=name,
        priority=priority,
    )


def test_an_enforced_worst_case_counts_with_its_overrun() -> None:
    """Until the watchdog looks again, wakes up and has looked: others keep their bounds."""
    watchdog = ThreadInfo("watchdog", 99, wcet_ns=MS // 10, min_interarrival_ns=MS)
    surroundings = Surroundings(threads=ThreadList(MS // 5, 0, (watchdog,)))
    assert surroundings.overrun_ns == MS + MS // 10 + MS // 5
    high = enforced("high", 60)
    low = loop("low", 2, 20)
    found = study([high, low], surroundings)
    jobs = {subject.name: {job.cost_ns for job in subject.task.jobs} for subject in found.subjects}
    assert jobs["high"] == {MS + surroundings.overrun_ns}
    assert jobs["low"] == {2 * MS}, "it is only declared"
    (subject,) = (each for each in found.subjects if each.name == "high")
    assert subject.machine.states == high.states, "runs and wall-clock bounds take the worst case itself"
    without = study([high, low], Surroundings(threads=ThreadList(MS // 5, 0, ())))
    assert (found.bounds["low"].response_ns or 0) > (without.bounds["low"].response_ns or 0) + MS


def test_a_wall_clock_bound_need_not_have_room_for_the_overrun() -> None:
    subject = Subject.of(enforced("c", 50, bound_ms=1.5), overrun_ns=MS)
    assert {job.cost_ns for job in subject.task.jobs} == {MS * 3 // 2}
    assert bounds_of([subject])["c"].too_long == ()


def test_a_verdict_says_whose_worst_cases_are_enforced() -> None:
    guarded = machine(
        execution("Run", "Pause", wcet_ms=1, initial=True, enforced=True),
        wait("Pause", "Run", "Pause", ms=20, wcet_ms=0.1),
        name="guarded",
    )
    half = machine(
        execution("Run", "More", wcet_ms=1, initial=True, enforced=True),
        execution("More", "Pause", bound_ms=1),
        wait("Pause", "Run", ms=20),
        name="half",
    )
    said = [*assumptions_about([loop("one", 1, 20), enforced("two", 50), guarded, half])]
    assert said[:3] == [
        "each execution of one, half ends within its declared time (only max_execution_ns is enforced)",
        "each execution of two, guarded uses at most its wcet_ns of CPU time (enforced), and never sleeps",
        "the guards of waits of guarded end within their declared time (not enforced)",
    ]
    assert "only max_execution_ns" not in " ".join(assumptions_about([enforced("two", 50)]))
    assert "(enforced)" not in " ".join(assumptions_about([loop("one", 1, 20)]))


def test_of_whom_a_lock_may_block_for_an_unknown_time_nothing_is_proved() -> None:
    machines = (
        loop("top", 1, 20, priority=70),
        loop("user", 1, 20, priority=60, ports=connected(map=0)),
        loop("between", 1, 20, priority=50),
        loop("holder", 4, 50, priority=40, ports=connected(map=0)),
        loop("alone", 1, 90, priority=30, ports=connected(log=0)),
    )
    why = ("holder may hold the lock of map for an unknown time: declare longest_hold_ns of the resource",)
    reasons = {one.name: Subject.of(one, machines).obstacles for one in machines}
    assert reasons == {"top": (), "user": why, "between": why, "holder": (), "alone": ()}
    latest = {"kinds": {"map": "latest_value"}}
    one, two = (loop(name, 1, 20, ports=connected(map=0), **latest) for name in ("one", "two"))
    assert Subject.of(one, (one, two)).obstacles == ()


def test_a_resource_of_two_cpus_keeps_its_users_from_being_proved() -> None:
    machines = (
        loop("here", 1, 20, priority=60, ports=connected(map=2, scan=0)),
        loop("there", 1, 20, priority=60, ports=connected(map=2, scan=0), cpus=[1]),
        loop("other", 1, 20, priority=70),
        loop("below", 1, 20, priority=10),
    )
    reasons = {one.name: Subject.of(one, machines).obstacles for one in machines}
    why = "it shares map (held up to 2.000 ms) with {} on another CPU: one CPU for both, or no lock"
    unknown = "it shares scan (held for an unknown time) with {} on another CPU: one CPU for both, or no lock"
    assert reasons == {
        "here": (why.format("there"), unknown.format("there")),
        "there": (why.format("here"), unknown.format("here")),
        "other": (),
        "below": (),
    }
    found = bounds(*machines)
    assert found["other"] == Bound(1 * MS, 20 * MS)
    assert found["below"].response_ns is None


def test_one_of_which_nothing_is_proved_delays_those_that_wait_for_its_lock_too() -> None:
    why = "unknown may delay it, and nothing is proved of that"
    for told in ({"cpus": [0]}, {"cpus": []}, {"cpus": [0, 1]}):
        found = bounds(
            loop("user", 1, 20, priority=60, ports=connected(map=2)),
            loop("between", 1, 20, priority=50),
            loop("top", 1, 20, priority=70),
            loop("unknown", 0, 50, priority=40, ports=connected(map=2), **told),
        )
        assert found["between"].reason.endswith(why), told
        assert found["user"].response_ns is None
        assert found["top"].response_ns == 1 * MS


def test_what_is_taken_for_granted_of_locks_is_told_where_there_are_any() -> None:
    rest = "no component holds a lock for longer than longest_hold_ns, or two locks at once"
    one, two = loop("one", 1, 20, ports=connected(map=2)), loop("two", 1, 20, ports=connected(map=2))
    assert rest in [*assumptions_about([one, two])]
    assert rest not in [*assumptions_about([one, loop("alone", 1, 20)])]


def test_measured_holds_are_taken_of_undeclared_locks_of_one_cpu() -> None:
    times = {
        name: ExecutionTime(3 * MS, "measured", is_measured=True)
        for name in ("map", "scan", "far", "log", "other")
    }
    machines = [
        loop("user", 1, 20, priority=60, ports=connected(map=2, scan=0, far=0, log=0, quiet=0)),
        loop("holder", 4, 50, priority=40, ports=connected(map=2, scan=0, far=0, quiet=0)),
        loop("there", 1, 20, priority=60, ports=connected(far=0), cpus=[1]),
    ]
    user, holder, there = with_measured_holds(machines, times)
    held = (Hold("map", 2 * MS), Hold("scan", 3 * MS, "measured", is_measured=True))
    assert (user.holds, user.undeclared_locks) == (held, ("far", "log", "quiet"))
    assert (holder.holds, holder.undeclared_locks) == (held, ("far", "quiet"))
    assert there == machines[2]
    assert Subject.of(user, (user, holder)).obstacles == (
        "holder may hold the lock of far for an unknown time: declare longest_hold_ns of the resource",
        "holder may hold the lock of quiet for an unknown time: declare longest_hold_ns of the resource",
    )


# ---- guards, the cost of a release, wall-clock bounds, waits for services


def test_guards_of_a_wait_are_part_of_the_job_that_follows() -> None:
    def guarded(guards_ms: float) -> Machine:
        states = [
            execution("Run", "Pause", wcet_ms=1, initial=True),
            wait("Pause", "Run", "Run", ms=10, wcet_ms=guards_ms),
        ]
        return machine(*states, name="high", priority=60)

    low = loop("low", 1, 20, priority=50)
    found = bounds(guarded(2), low)
    assert (found["high"].response_ns, found["low"].response_ns) == (3 * MS, 4 * MS)
    unknown = guarded(0)
    (why,) = Subject.of(unknown).obstacles
    assert why == "no time is known of the guards of Pause: declare wcet_ns of the wait, or of its guards"
    assert bounds(unknown, low)["low"].response_ns is None


def test_each_release_costs_something() -> None:
    machines = (loop("high", 1, 4, priority=60), loop("low", 3, 20, priority=50))
    subjects = [Subject.of(one, machines, overhead_ns=MS // 10) for one in machines]
    found = bounds_of(subjects)
    assert found["high"].response_ns == 11 * MS // 10
    assert found["low"].response_ns == 53 * MS // 10, "two releases of high, and its own"


def test_a_state_with_a_wall_clock_bound_must_end_in_it_with_all_that_preempts() -> None:
    high = loop("high", 5, 10, priority=60)
    for bound_ms, is_met in ((9, True), (8.9, False)):
        states = [
            execution("Run", "Pause", wcet_ms=4, bound_ms=bound_ms, initial=True),
            wait("Pause", "Run", ms=47),
        ]
        found = bounds(high, machine(*states, name="low", priority=50))["low"]
        assert found.response_ns == 9 * MS
        assert found.meets_deadline == is_met
        assert bool(found.too_long) != is_met
    assert found.too_long == (
        "Run may last 9.000 ms, preemption and blocking included, and its max_execution_ns is 8.900 ms",
    )


def test_one_that_waits_for_a_service_meets_its_equals_again() -> None:
    kinds = {"lamp": "client"}
    caller = loop("caller", 3, 90, ports=connected(lamp=0), kinds=kinds)
    other = loop("other", 8, 15)
    assert bounds(caller, other)["caller"].response_ns == 11 * MS + 8 * MS - 8 * MS
    longer = loop("caller", 9, 90, ports=connected(lamp=0), kinds=kinds)
    assert bounds(longer, other)["caller"].response_ns == 25 * MS, "twice the other"
    assert bounds(loop("caller", 9, 90), other)["caller"].response_ns == 17 * MS


def test_a_bag_that_tells_no_kinds_shows_a_client_by_the_type_of_its_port() -> None:
    port = SimpleNamespace(resource="lamp", longest_hold_ns=0, type="std_srvs/srv/SetBool")
    caller = loop("caller", 9, 90, ports=[port])
    assert (caller.clients, caller.undeclared_locks) == (("lamp",), ())
    assert loop("user", 9, 90, ports=[port], kinds={"lamp": "my_robot/Lamp"}).clients == ()


def test_a_load_of_exactly_one_is_bounded_where_nothing_comes_on_top() -> None:
    full = (loop("high", 2, 4, priority=60), loop("low", 4, 8, priority=50))
    assert bounds(*full)["low"] == Bound(8 * MS, 8 * MS)
    late = bounds(*full, wakeup_ns=1)["low"]
    assert late.reason == (
        "the utilization at this priority is 1, and blocking or late wake-ups come on top: nothing is left"
    )


# ---- threads beside the components


def with_threads(components: list[Machine], *threads: ThreadInfo) -> dict[str, Bound]:
    machines = [*components, *machines_of(threads, components)]
    return bounds_of([Subject.of(one, machines) for one in machines])


def test_a_thread_that_takes_a_lock_blocks_as_one_below() -> None:
    components = [loop("user", 1, 20, priority=60, ports=connected(store=9)), loop("low", 1, 50)]
    offered = ThreadInfo("service of store", resource="store")
    found = with_threads(components, offered)
    assert found["user"] == Bound(10 * MS, 20 * MS, blocking_ns=9 * MS)
    assert [*found] == ["user", "low"]
    assert found["low"].blocking_ns == 9 * MS, "the thread inherits the priority of user"
    elsewhere = with_threads(components, ThreadInfo("service of other", resource="other"))
    assert elsewhere["user"].blocking_ns == 0
    unknown = [loop("user", 1, 20, ports=connected(store=0))]
    assert with_threads(unknown)["user"].response_ns == 1 * MS
    assert with_threads(unknown, offered)["user"].response_ns is None


def test_a_real_time_thread_delays_those_below_it_on_each_cpu_where_it_may_run() -> None:
    components = [loop("here", 1, 20, cpus=[0]), loop("there", 1, 20, cpus=[1])]
    known = ThreadInfo("topics_out", 70, wcet_ns=2 * MS, min_interarrival_ns=10 * MS)
    assert {one.response_ns for one in with_threads(components, known).values()} == {3 * MS}
    pinned = with_threads(components, replace(known, cpus=(1,)))
    assert (pinned["here"].response_ns, pinned["there"].response_ns) == (1 * MS, 3 * MS)
    below = with_threads(components, replace(known, priority=10))
    assert below["here"].response_ns == 1 * MS
    unknown = with_threads(components, ThreadInfo("topics_out", 70, (1,)))
    assert unknown["here"].response_ns == 1 * MS
    assert unknown["there"].reason == "topics_out may delay it, and nothing is proved of that"


# ---- offsets


def two(**low: object) -> tuple[Machine, Machine]:
    """The lower one would miss its deadline without its offset."""
    facts = {"priority": 50, "offset_ns": 5 * MS, "deadline_ns": 6 * MS, **low}
    return loop("high", 4, 10, priority=60), loop("low", 5, 10, **facts)


def test_offsets_count_where_a_deadline_would_not_be_met_without_them() -> None:
    found = bounds(*two())
    assert found == {"high": Bound(4 * MS, 10 * MS), "low": Bound(5 * MS, 6 * MS, by=OFFSETS)}
    assert found["low"].meets_deadline
    assert bounds(*two(deadline_ns=9 * MS))["low"] == Bound(9 * MS, 9 * MS), "true for any offsets"
    assert bounds(*two(offset_ns=1005 * MS))["low"].response_ns == 5 * MS
    assert bounds(*two(offset_ns=2 * MS))["low"] == Bound(7 * MS, 6 * MS, by=OFFSETS)


def test_offsets_know_late_wake_ups_blocking_and_the_cost_of_a_release() -> None:
    earlier = two(offset_ns=4 * MS)
    assert bounds(*earlier, wakeup_ns=MS)["low"] == Bound(6 * MS, 6 * MS, by=OFFSETS)
    late = bounds(*earlier, wakeup_ns=MS + 1)["low"]
    assert (late.response_ns, late.by) == (10 * MS + 1, OFFSETS), "the next release of the higher one"
    holder = loop("holder", 2, 100, priority=40, ports=connected(map=1))
    found = bounds(*two(offset_ns=4 * MS, ports=connected(map=1)), holder)["low"]
    assert found == Bound(6 * MS, 6 * MS, blocking_ns=1 * MS, by=OFFSETS)
    machines = [replace(machine, deadline_ns=6 * MS) for machine in two()]
    subjects = [Subject.of(one, overhead_ns=MS // 10) for one in machines]
    assert bounds_of(subjects)["low"].response_ns == 92 * MS // 10


def test_only_a_component_on_the_grid_of_the_epoch_has_an_offset() -> None:
    high, low = two()
    odd = machine(
        execution("Run", "Short", wcet_ms=4, initial=True),
        wait("Short", "Again", ms=3),
        execution("Again", "Long", wcet_ms=0.001),
        wait("Long", "Run", ms=7),
        name="high",
        priority=60,
    )
    sporadic = machine(
        event("Await", "Run", least_ms=10, initial=True),
        execution("Run", "Await", wcet_ms=4),
        name="high",
        priority=60,
    )
    beside = replace(high, is_component=False)
    assert grid_of(Subject.of(high).machine) == Grid(10 * MS, 0)
    for one in (odd, sporadic, beside):
        assert grid_of(Subject.of(one).machine) is None
        found = bounds(one, low)["low"]
        assert (found.response_ns or 0) >= 9 * MS
        assert not found.by
    finer = replace(high, period_ns=5 * MS)
    assert bounds(finer, low)["low"].response_ns == 9 * MS, "it may begin 5 ms later"


def test_a_state_that_would_be_cut_off_without_offsets() -> None:
    def with_limit(offset_ms: int) -> Bound:
        low = machine(
            execution("Run", "Pause", wcet_ms=5, bound_ms=6, initial=True),
            wait("Pause", "Run", ms=10),
            name="low",
            offset_ns=offset_ms * MS,
        )
        return bounds(two()[0], low)["low"]

    assert with_limit(5).meets_deadline
    assert with_limit(5).by == OFFSETS
    assert with_limit(8).too_long, "the higher one comes 2 ms later"


def test_offsets_do_not_count_while_a_change_is_made() -> None:
    before = [Subject.of(one) for one in two()]
    after = [before[0], Subject.of(two(deadline_ns=7 * MS)[1])]
    assert all(one.meets_deadline for each in (before, after) for one in bounds_of(each).values())
    during = bounds_during(subjects_during(before, after, {}), before, after, {})["low"]
    assert (during.response_ns, during.by, during.meets_deadline) == (9 * MS, "", False)
