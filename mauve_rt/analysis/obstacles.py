"""What keeps a component's timing from being proved: said, never guessed."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from mauve_rt.analysis.locks import named_twice
from mauve_rt.analysis.machines import Machine, in_ms

_ROOT = Path("/")
_NOT_THROTTLED = -1


def obstacles(machine: Machine, others: Sequence[Machine] = ()) -> Iterator[str]:
    """Why nothing can be proved of a component, each with what would help.

    `others`: components of the same architecture; the component may be among them.
    """
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
        states = (state for state in machine.states if state.name in machine.missing)
        names = ", ".join(
            f"{state.name} ({why})" if (why := state.time.why_missing) else state.name for state in states
        )
        yield f"no time is known of {names}: declare wcet_ns, or measure (--budget-from BAG)"
    yield from _shared_with_other_cpus(machine, others)


def _shared_with_other_cpus(machine: Machine, others: Sequence[Machine]) -> Iterator[str]:
    """The bound on blocking is for one CPU. Of a component that may run on any CPU this is said already."""
    elsewhere = [other for other in others if machine.cpus and other.cpus and other.cpus != machine.cpus]
    for hold in machine.holds:
        names = [other.name for other in elsewhere if hold.resource in other.resources]
        if names:
            held = f"{hold.resource} (held up to {in_ms(hold.longest_ns)})"
            yield f"it shares {held} with {', '.join(names)} on another CPU: one CPU for both, or no lock"


def assumptions_about(
    machines: Sequence[Machine], *, wakeup_us: float = 0.0, sender_priority: int = 1
) -> Iterator[str]:
    """What a proof for these components takes for granted, each as what stands behind an `if`."""
    yield f"threads begin {wakeup_us:g} us after their instants at the latest (--wakeup-us)"
    yield from _about_locks(machines)
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
    yield "these threads of the executor take next to no time:"
    yield "- watchdog (99) and safe outputs (98), when a state lasts beyond its bound"
    yield "- rules (97), when an executor's rule looks or acts"
    yield f"- sender ({sender_priority}), which sends the messages of bound topics"
    yield "- trace (1), which collects records"


def runtime_us(root: Path = _ROOT) -> int:
    """The us of each second that the kernel gives to real-time threads; -1: it does not limit them."""
    file = root / "proc/sys/kernel/sched_rt_runtime_us"
    return int(file.read_text("ascii")) if file.exists() else _NOT_THROTTLED


def is_virtual(root: Path = _ROOT) -> bool:
    """Whether the computer is a virtual machine, by the flags of its CPUs."""
    file = root / "proc/cpuinfo"
    return file.exists() and "hypervisor" in file.read_text("utf-8", "replace").split()


def _about_locks(machines: Sequence[Machine]) -> Iterator[str]:
    undeclared = named_twice(resource for machine in machines for resource in machine.undeclared_locks)
    if undeclared:
        names = ", ".join(undeclared)
        yield f"components hold the locks of {names} for no time: no longest_hold_ns is declared"
    if named_twice(resource for machine in machines for resource in machine.resources):
        yield "no component holds a lock for longer than longest_hold_ns, or two locks at once"
