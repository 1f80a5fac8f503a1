"""What keeps a component's timing from being proved: said, never guessed."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from mauve_rt.analysis.locks import named_twice
from mauve_rt.analysis.machines import Machine, in_ms

_ROOT = Path("/")
_NOT_THROTTLED = -1


def obstacles(machine: Machine, others: Sequence[Machine] = ()) -> Iterator[str]:
    """Why nothing can be proved of a component or of another thread, each with what would help.

    `others`: components and threads of the same architecture; the component may be among them.
    """
    if not machine.is_component:
        if machine.missing:
            yield f"its time is not declared: {machine.remedy}"
        return
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
    executions = _named(machine, is_wait=False)
    if executions:
        yield f"no time is known of {executions}: declare wcet_ns, or measure (--budget-from BAG)"
    waits = _named(machine, is_wait=True)
    if waits:
        yield f"no time is known of the guards of {waits}: declare wcet_ns of the wait, or of its guards"
    yield from _shared_with_other_cpus(machine, others)
    yield from _unknown_holds(machine, others)


def _named(machine: Machine, *, is_wait: bool) -> str:
    """States without a time."""
    missing = (state for state in machine.states if state.name in machine.missing)
    return ", ".join(
        f"{state.name} ({why})" if (why := state.time.why_missing) else state.name
        for state in missing
        if state.is_wait == is_wait
    )


def _shared_with_other_cpus(machine: Machine, others: Sequence[Machine]) -> Iterator[str]:
    """The bound on blocking is for one CPU. Of a component that may run on any CPU this is said already."""
    elsewhere = [other for other in others if machine.cpus and other.cpus and other.cpus != machine.cpus]
    times_ns = {hold.resource: hold.longest_ns for hold in machine.holds}
    for resource in sorted(machine.locks):
        names = [other.name for other in elsewhere if resource in other.locks]
        if names:
            held = (
                f"held up to {in_ms(times_ns[resource])}"
                if resource in times_ns
                else "held for an unknown time"
            )
            yield (
                f"it shares {resource} ({held}) with {', '.join(names)} on another CPU: "
                "one CPU for both, or no lock"
            )


def _unknown_holds(machine: Machine, others: Sequence[Machine]) -> Iterator[str]:
    """Locks that one below holds for an unknown time, and that the component or one above it wants."""
    undeclared = {resource for other in (machine, *others) for resource in other.undeclared_locks}
    for resource in sorted(undeclared):
        users = [other for other in others if resource in other.locks]
        below = [other.name for other in users if other.priority < machine.priority]
        if below and max(other.priority for other in users) >= machine.priority:
            yield (
                f"{', '.join(below)} may hold the lock of {resource} for an unknown time: "
                "declare longest_hold_ns of the resource"
            )


def unknown_costs(threads: Any) -> Iterator[str]:
    """Which costs of a release are not known; `threads` has the fields of mauve_msgs/msg/TaskList."""
    if threads.wakeup_ns < 0:
        yield "its longest wake-up is not declared: wakeup_us of the executor, or --wakeup-us (mauve doctor)"
    if threads.overhead_ns < 0:
        yield (
            "the cost of a release is not declared: overhead_ns of the executor, or --overhead-ns "
            "(mauve doctor)"
        )


def assumptions_about(machines: Sequence[Machine]) -> Iterator[str]:
    """What a proof for these components takes for granted, each as what stands behind an `if`."""
    yield from _ends_of_executions(machines)
    if named_twice(resource for machine in machines for resource in machine.resources):
        yield "no component holds a lock for longer than longest_hold_ns, or two locks at once"
    for machine in machines:
        if machine.clients:
            yield f"wcet_ns of {machine.name} has its waits for services in it ({', '.join(machine.clients)})"
    if (runtime := runtime_us()) != _NOT_THROTTLED:
        yield (
            f"components leave the rest of {runtime} us in each s, to which real-time threads are throttled "
            "(kernel.sched_rt_runtime_us: -1 switches that off)"
        )
    if is_virtual():
        yield "the host of this virtual machine takes no CPU from it"
    yield "no other real-time thread runs on these CPUs, and no interrupt takes one for long"
    yield "no component faults, stops or is changed, and no rule of the executor acts"


def _ends_of_executions(machines: Sequence[Machine]) -> Iterator[str]:
    """Of whom a time is only declared, and of whom a mechanism enforces it."""
    if names := ", ".join(one.name for one in machines if not one.is_enforced):
        yield f"each execution of {names} ends within its declared time (only max_execution_ns is enforced)"
    if names := ", ".join(one.name for one in machines if one.is_enforced):
        yield f"each execution of {names} uses at most its wcet_ns of CPU time (enforced), and never sleeps"
    if guarded := ", ".join(one.name for one in machines if one.is_enforced and one.has_guarded_waits):
        yield f"the guards of waits of {guarded} end within their declared time (not enforced)"


def runtime_us(root: Path = _ROOT) -> int:
    """The us of each second that the kernel gives to real-time threads; -1: it does not limit them."""
    file = root / "proc/sys/kernel/sched_rt_runtime_us"
    return int(file.read_text("ascii")) if file.exists() else _NOT_THROTTLED


def is_virtual(root: Path = _ROOT) -> bool:
    """Whether the computer is a virtual machine, by the flags of its CPUs."""
    file = root / "proc/cpuinfo"
    return file.exists() and "hypervisor" in file.read_text("utf-8", "replace").split()
