"""Bounds of components, only where all that may delay them is known."""

from types import SimpleNamespace

from analysis_machines import MS, execution, machine, wait

from mauve_rt.analysis.bounds import Bound, Subject, bounds_of
from mauve_rt.analysis.machines import Machine


def loop(name: str, cost_ms: float, period_ms: int, **told: object) -> Machine:
    states: list[SimpleNamespace] = [
        execution("Run", "Pause", bound_ms=cost_ms, initial=True),
        wait("Pause", "Run", ms=period_ms),
    ]
    return machine(*states, name=name, **told)


def bounds(*machines: Machine, wakeup_ns: int = 0) -> dict[str, Bound]:
    return bounds_of([Subject.of(one) for one in machines], wakeup_ns=wakeup_ns)


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
