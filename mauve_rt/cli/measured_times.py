"""Measured times that `mauve analyze` takes: of a bag, and of `mauve doctor`."""

import json
import math
from collections.abc import Mapping
from pathlib import Path

import mauve_rt.trace
from mauve_rt.analysis.machines import ExecutionTime
from mauve_rt.analysis.refutation import Measured
from mauve_rt.errors import ParameterError, exception_text
from mauve_rt.trace.reading.statistics import ComponentStatistics, Distribution, all_statistics

Budgets = Mapping[str, ExecutionTime]


def statistics_of(bag: Path) -> dict[str, ComponentStatistics]:
    """Of every component of a bag."""
    return all_statistics(mauve_rt.trace.open(bag))


def measured_of(statistics: Mapping[str, ComponentStatistics]) -> dict[str, Measured]:
    """The longest times of every component."""
    return {
        name: Measured(
            response_ns=one.response.max_ns,
            wakeup_ns=one.wakeup.max_ns,
            execution_ns={state: each.max_ns for state, each in one.execution.items()},
            faults=one.faults,
        )
        for name, one in statistics.items()
    }


def budgets_of(
    path: Path, statistics: Mapping[str, ComponentStatistics], margin: float
) -> tuple[Mapping[str, Budgets], Budgets]:
    """What was measured: by component and state, and by resource the longest call of one of its services.

    Preemption is in both, in a call the wait for the lock too: too much rather than too little. A trace has
    the calls of call ports only: a resource that is only read and written has no measured time.
    """

    def budget(*measured: Distribution) -> ExecutionTime:
        count, longest_ns = sum(one.count for one in measured), max(one.max_ns for one in measured)
        origin = f"measured in {path.name} (n = {count:,}) x {margin:g}"
        return ExecutionTime(math.ceil(longest_ns * margin), origin, is_measured=True)

    states = {
        component: {state: budget(measured) for state, measured in one.execution.items() if measured.count}
        for component, one in statistics.items()
    }
    calls: dict[str, list[Distribution]] = {}
    for one in statistics.values():
        for service, measured in one.services.items():
            if measured.count:
                calls.setdefault(service.partition(".")[0], []).append(measured)
    return states, {resource: budget(*measured) for resource, measured in calls.items()}


def doctor_costs(path: Path) -> dict[str, int]:
    """What a release costs by `mauve doctor --json`, as fields of a ThreadList.

    Raises:
        ParameterError: the file has no such figures.
    """
    try:
        wakeup = json.loads(path.read_text("utf-8"))["wakeup"]
        costs = {"wakeup_ns": float(wakeup["wakeup_us"]) * 1e3, "overhead_ns": float(wakeup["overhead_ns"])}
    except OSError as error:
        raise ParameterError(f"--doctor: {path}: {error.strerror}") from None
    except (ValueError, KeyError, TypeError) as error:
        what = f"--doctor: {path} has no wake-up latency ({exception_text(error)})"
        raise ParameterError(f"{what}; write it with `mauve doctor --json`, without --seconds 0") from None
    for name, cost_ns in costs.items():
        if not math.isfinite(cost_ns) or cost_ns < 0:
            raise ParameterError(f"--doctor: {path}: {name}: expected 0 or more, found {cost_ns:g}")
    return {name: math.ceil(cost_ns) for name, cost_ns in costs.items()}
