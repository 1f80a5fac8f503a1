"""What keeps a component's timing from being proved: said, never guessed."""

from collections.abc import Iterator
from pathlib import Path

from mauve_rt.analysis.digraph import DigraphTask
from mauve_rt.analysis.machines import FOREVER_NS, Machine, in_ms

_RUNTIME = Path("/proc/sys/kernel/sched_rt_runtime_us")
_CPU = Path("/proc/cpuinfo")


def obstacles(machine: Machine, task: DigraphTask) -> Iterator[str]:
    """Why nothing can be proved of a component, each with what would help."""
    if machine.is_python:
        yield "it has parts in Python, which run under the interpreter's lock: write them in C++"
    elif machine.is_python is None:
        yield "its plug-ins are not installed here, so nobody knows whether parts of it are in Python"
    if len(machine.cpus) != 1:
        where = f"on CPUs {', '.join(map(str, machine.cpus))}" if machine.cpus else "on any CPU"
        yield f"it may run {where}: pin it to one (cpus in the architecture file)"
    if machine.policy not in ("", "SCHED_FIFO"):
        yield f"its thread is {machine.policy}: give the process real-time rights"
    if not machine.states:
        yield "nothing tells its states: it is not configured, or was recorded by an earlier version"
    if machine.missing:
        names = ", ".join(machine.missing)
        yield f"no time is known of {names}: declare wcet_ns, or measure (--budget-from BAG)"
    for job in task.jobs:
        if job.cost_ns is not None and job.separation_ns != FOREVER_NS and job.cost_ns > job.separation_ns:
            takes = f"{' -> '.join(job.states)} takes {in_ms(job.cost_ns)}"
            yield f"{takes}, and {job.until} lasts {in_ms(job.separation_ns)}: shorten it, or wait longer"


def obstacles_of_this_machine() -> Iterator[str]:
    """Why a proof for this machine holds under reserve: what else may take its processors."""
    runtime = _RUNTIME.read_text("ascii").strip() if _RUNTIME.exists() else "-1"
    if runtime != "-1":
        yield (
            f"real-time threads are throttled to {runtime} us of each s (kernel.sched_rt_runtime_us): "
            "-1 switches that off"
        )
    words = _CPU.read_text("utf-8", "replace").split() if _CPU.exists() else []
    if "hypervisor" in words:
        yield "it is a virtual machine: its host may take a CPU at any time"


def competing_threads(*, sender_priority: int = 1) -> tuple[str, ...]:
    """Threads of an executor beside the components, of which no cost is known."""
    return (
        "watchdog (99) and safe outputs (98), when a state lasts beyond its bound",
        "rules (97), when an executor's rule looks or acts",
        f"sender ({sender_priority}), which sends the messages of bound topics",
        "trace (1), which collects records",
    )
