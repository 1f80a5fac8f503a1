"""Bounds of components, only where all that may delay them is known."""

from types import SimpleNamespace

from analysis_machines import MS, connected, execution, machine, wait

from mauve_rt.analysis.bounds import Bound, Subject, bounds_of
from mauve_rt.analysis.locks import with_measured_holds
from mauve_rt.analysis.machines import ExecutionTime, Hold, Machine
from mauve_rt.analysis.obstacles import assumptions_about


def loop(name: str, cost_ms: float, period_ms: int, **told: object) -> Machine:
    states: list[SimpleNamespace] = [
        execution("Run", "Pause", bound_ms=cost_ms, initial=True),
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
        execution("Look", "Short", "Long", bound_ms=1, initial=True),
        execution("Long", "Rest", bound_ms=4),
        wait("Short", "Look", ms=5),
        wait("Rest", "Look", ms=50),
    ]
    found = bounds(machine(*states, name="two", priority=60), loop("low", 1, 100, priority=50))
    assert found["two"] == Bound(1 * MS, 5 * MS), "the short way, which is the closest to its deadline"
    assert found["low"] == Bound(6 * MS, 100 * MS), "the long way and itself"


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
    assert found["user"].reason == "after each wait for a service (lamp) a lock may block it anew"


def test_a_lock_that_nobody_declares_is_held_for_no_time() -> None:
    found = bounds(
        loop("user", 1, 20, priority=60, ports=connected(map=0)),
        loop("holder", 4, 50, priority=40, ports=connected(map=0)),
    )
    assert found["user"] == Bound(1 * MS, 20 * MS)


def test_a_resource_of_two_cpus_keeps_its_users_from_being_proved() -> None:
    machines = (
        loop("here", 1, 20, priority=60, ports=connected(map=2, scan=0)),
        loop("there", 1, 20, priority=60, ports=connected(map=2, scan=0), cpus=[1]),
        loop("other", 1, 20, priority=70),
        loop("below", 1, 20, priority=10),
    )
    reasons = {one.name: Subject.of(one, machines).obstacles for one in machines}
    why = "it shares map (held up to 2.000 ms) with {} on another CPU: one CPU for both, or no lock"
    assert reasons == {
        "here": (why.format("there"),),
        "there": (why.format("here"),),
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


def test_locks_that_are_shared_and_undeclared_are_told_as_taken_for_granted() -> None:
    def told(*machines: Machine) -> list[str]:
        return [line for line in assumptions_about(machines) if "lock" in line]

    latest = {"kinds": {"pose": "latest_value"}}
    ports = connected(scan=0, pose=0, map=2)
    one, two = loop("one", 1, 20, ports=ports, **latest), loop("two", 1, 20, ports=ports, **latest)
    alone = loop("alone", 1, 20, ports=connected(log=0))
    rest = "no component holds a lock for longer than longest_hold_ns, or two locks at once"
    assert told(one, alone) == []
    assert told(one, two, alone) == [
        "components hold the locks of scan for no time: no longest_hold_ns is declared",
        rest,
    ]
    unknown = loop("two", 1, 20, ports=connected(scan=0, pose=0))
    assert told(unknown, unknown) == [
        "components hold the locks of pose, scan for no time: no longest_hold_ns is declared"
    ]


def test_measured_holds_are_taken_of_undeclared_locks_of_one_cpu() -> None:
    times = {name: ExecutionTime(3 * MS, "measured") for name in ("map", "scan", "far", "log", "other")}
    machines = [
        loop("user", 1, 20, priority=60, ports=connected(map=2, scan=0, far=0, log=0, quiet=0)),
        loop("holder", 4, 50, priority=40, ports=connected(map=2, scan=0, far=0, quiet=0)),
        loop("there", 1, 20, priority=60, ports=connected(far=0), cpus=[1]),
    ]
    user, holder, there = with_measured_holds(machines, times)
    held = (Hold("map", 2 * MS), Hold("scan", 3 * MS, "measured"))
    assert (user.holds, user.undeclared_locks) == (held, ("far", "log", "quiet"))
    assert (holder.holds, holder.undeclared_locks) == (held, ("far", "quiet"))
    assert there == machines[2]
    assert bounds(user, holder, there)["user"].blocking_ns == 3 * MS
