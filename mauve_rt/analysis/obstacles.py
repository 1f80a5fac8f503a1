"""What keeps a component's timing from being proved: said, never guessed."""

from collections.abc import Iterator
from pathlib import Path

from mauve_rt.analysis.machines import Machine

_RUNTIME = Path("/proc/sys/kernel/sched_rt_runtime_us")
_CPU = Path("/proc/cpuinfo")


def obstacles(machine: Machine) -> Iterator[str]:
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


def assumptions_about(*, wakeup_us: float = 0.0, sender_priority: int = 1) -> Iterator[str]:
    """What a proof for this machine takes for granted, each as what stands behind an `if`."""
    yield f"threads begin {wakeup_us:g} us after their instants at the latest (--wakeup-us)"
    yield "components hold the locks of resources for no time"
    runtime = _RUNTIME.read_text("ascii").strip() if _RUNTIME.exists() else "-1"
    if runtime != "-1":
        yield (
            f"components leave the rest of {runtime} us in each s, to which real-time threads are throttled "
            "(kernel.sched_rt_runtime_us: -1 switches that off)"
        )
    words = _CPU.read_text("utf-8", "replace").split() if _CPU.exists() else []
    if "hypervisor" in words:
        yield "the host of this virtual machine takes no CPU from it"
    yield "these threads of the executor take next to no time:"
    yield "- watchdog (99) and safe outputs (98), when a state lasts beyond its bound"
    yield "- rules (97), when an executor's rule looks or acts"
    yield f"- sender ({sender_priority}), which sends the messages of bound topics"
    yield "- trace (1), which collects records"
