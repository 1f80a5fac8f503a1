"""Response times of components, computed from their parameters: no ROS, no native library, no measurement.

    tasks = [Task(name="control", cpu=0, priority=80, separation_ns=1_000_000, cost_ns=200_000, ...), ...]
    for bound in response_times(tasks):
        print(bound.task.name, bound.response_ns, bound.reason)

`task` describes components, `blocking` bounds priority inversion, `window` bounds the jobs of one busy
window, and `fixed_priority` joins the three for all components of all CPUs. All times are whole
nanoseconds: no formula uses a floating-point number.
"""

from mauve_rt.analysis.errors import AnalysisError
from mauve_rt.analysis.fixed_priority import ResponseTime, response_times
from mauve_rt.analysis.task import CriticalSection, Task

__all__ = ["AnalysisError", "CriticalSection", "ResponseTime", "Task", "response_times"]
