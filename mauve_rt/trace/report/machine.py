"""What the machine did to the components, told apart from what they did themselves."""

from typing import NamedTuple

import numpy as np

from mauve_rt.trace.report.analysis import Analysis
from mauve_rt.trace.report.overruns import late_cycles
from mauve_rt.trace.report.stalls import Stall, stalls


class Machine(NamedTuple):
    """When something outside of the components held the processors, and what came of it."""

    stalls: list[Stall]
    overruns: dict[str, int]
    """Per component: those that would not have been but for a wake-up in a stall."""


def machine_of(analysis: Analysis) -> Machine:
    """Return what the trace proves of it; with losses nothing: who knows what the lost records told."""
    found = [] if analysis.trace.lost else stalls(analysis)
    return Machine(found, {name: _stalled_overruns(analysis, name, found) for name in analysis.statistics})


def _stalled_overruns(analysis: Analysis, component: str, found: list[Stall]) -> int:
    """Count overruns whose cycle woke late in a stall, and had ended in time if it had woken in time."""
    released, late = late_cycles(analysis, component)
    if not found or not len(late):
        return 0
    begin_ns = np.array([one.begin_ns for one in found])
    end_ns = np.array([one.end_ns for one in found])
    nominal_ns, actual_ns = released["a"], released["b"]
    first = np.minimum(np.searchsorted(begin_ns, nominal_ns), len(found) - 1)
    stalled = (begin_ns[first] >= nominal_ns) & (end_ns[first] <= actual_ns)
    in_time = late["time_ns"] - (actual_ns - nominal_ns) <= late["a"]
    return int((stalled & in_time).sum())
