"""The time of a state as the analysis takes it: the worst case, else the bound that the watchdog enforces."""

import pytest
from analysis_machines import execution

from mauve_rt.analysis.machines import ExecutionTime, State


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
