"""The time of a state as the analysis takes it: the worst case, else the bound that the watchdog enforces."""

import pytest
from analysis_machines import MS, connected, execution, machine

from mauve_rt.analysis.machines import ExecutionTime, Hold, State


@pytest.mark.parametrize(
    ("wcet_ms", "bound_ms", "expected"),
    [
        (2, 0, ExecutionTime(2_000_000, "declared")),
        (2, 5, ExecutionTime(2_000_000, "declared")),
        (0, 5, ExecutionTime(5_000_000, "declared (its bound)")),
        (0, 0, ExecutionTime(None, "missing")),
    ],
)
def test_the_worst_case_comes_before_the_bound(wcet_ms: int, bound_ms: int, expected: ExecutionTime) -> None:
    assert State.of(execution("Act", "Pause", wcet_ms=wcet_ms, bound_ms=bound_ms)).time == expected


def test_a_state_of_a_bag_of_an_earlier_version_has_a_bound_only() -> None:
    told = execution("Act", "Pause", bound_ms=5)
    del told.wcet_ns
    assert State.of(told).time == ExecutionTime(5_000_000, "declared (its bound)")


@pytest.mark.parametrize(
    ("enforced", "bound_ms", "expected_ms"),
    [
        (False, 0, 2),
        (True, 0, 3.5),
        (True, 9, 3.5),
        (True, 3, 3),  # the watchdog ends it there
        (True, 2, 2),
    ],
)
def test_an_execution_overruns_an_enforced_worst_case(
    *, enforced: bool, bound_ms: int, expected_ms: float
) -> None:
    state = State.of(execution("Act", "Pause", wcet_ms=2, bound_ms=bound_ms, enforced=enforced))
    assert state.time.ns == 2 * MS
    assert state.overrunning(MS * 3 // 2).time.ns == expected_ms * MS
    assert state.is_watched == (enforced or bound_ms > 0)


def test_the_locks_of_a_component_are_those_of_connected_resources() -> None:
    ports = [*connected(map=2, scan=0), *connected(map=2), *connected(**{"": 0})]
    found = machine(ports=ports)
    assert (found.holds, found.undeclared_locks) == ((Hold("map", 2_000_000),), ("scan",))


def test_a_port_that_takes_no_lock_holds_none() -> None:
    quick, slow = connected(scan=0, map=2), connected(scan=0, map=2)
    for port in quick:
        port.wait_free = True
    assert (machine(ports=quick).holds, machine(ports=quick).undeclared_locks) == ((), ())
    assert machine(ports=[*quick, *slow]) == machine(ports=slow), "its other ports do"


def test_a_port_of_a_bag_of_an_earlier_version_declares_nothing() -> None:
    (port,) = connected(map=2)
    del port.longest_hold_ns
    found = machine(ports=[port])
    assert (found.holds, found.undeclared_locks) == ((), ("map",))
