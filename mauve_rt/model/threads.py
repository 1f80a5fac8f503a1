"""Threads of an executor that are no components and take a CPU, or the lock of a resource: one list of them.

The executor publishes the list (~/list_tasks), a bag has it, and the timing analysis makes it from a file.
"""

import os
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from mauve_rt.model.architecture_file import ArchitectureModel, online_cpus
from mauve_rt.model.schema import ExecutorModel, SenderModel

_HIGHEST = 99
_LOOK_EVERY_NS = 1_000_000  # kLeastBetweenLooks of watchdog.cpp
_LOOK_NS, _LOOK_NS_EACH = 40_000, 1_000  # three times what was measured, beside the cost of a wake-up


@dataclass(frozen=True)
class ThreadInfo:
    """One thread, with the fields of mauve_msgs/msg/TaskInfo."""

    name: str
    priority: int = 0
    """Under SCHED_FIFO; 0: an ordinary thread, below all components."""
    cpus: tuple[int, ...] = ()
    """On which it may run; none: any."""
    wcet_ns: int = 0
    """Longest execution for one activation; 0: not declared."""
    min_interarrival_ns: int = 0
    """From one activation to the next; 0: not declared."""
    resource: str = ""
    """Whose lock an ordinary thread takes."""


@dataclass(frozen=True)
class ThreadList:
    """The threads, and what a release costs, with the fields of mauve_msgs/msg/TaskList."""

    wakeup_ns: int
    """Longest time from an instant to the start of its thread; -1: not declared."""
    overhead_ns: int
    """Of a release, beside the states of a component; -1: not declared."""
    tasks: tuple[ThreadInfo, ...]


def thread_list(
    executor: ExecutorModel, uses: Mapping[str, Collection[str]], *, components: int, has_bounds: bool
) -> ThreadList:
    """All that run while nothing faults, stops or is changed, and no rule is loaded.

    Args:
        executor: settings of the process.
        uses: of resources, as `uses_of`.
        components: how many.
        has_bounds: a state has a `max_execution_ns` or an enforced worst case, so that the watchdog looks.

    """
    threads = [ThreadInfo("trace", priority=1)]
    if has_bounds:
        cost_ns = _LOOK_NS + _LOOK_NS_EACH * components
        threads.append(ThreadInfo("watchdog", _HIGHEST, wcet_ns=cost_ns, min_interarrival_ns=_LOOK_EVERY_NS))
    if any("publishes" in sides for sides in uses.values()):
        threads += _senders(executor.sender)
    for resource, sides in sorted(uses.items()):
        threads += [
            ThreadInfo(f"{_USERS[side]} {resource}", resource=resource) for side in _USERS if side in sides
        ]
    wakeup_ns = -1 if executor.wakeup_us is None else round(executor.wakeup_us * 1_000)
    overhead_ns = -1 if executor.overhead_ns is None else executor.overhead_ns
    return ThreadList(wakeup_ns, overhead_ns, tuple(threads))


_USERS = {"subscribes": "topic of", "offers": "service of", "mirrors": "mirror of", "records": "recorder of"}
"""Ordinary threads by how they use a resource."""


def uses_of(model: ArchitectureModel) -> dict[str, set[str]]:
    """How threads that are no components use each resource, in the words of mauve_msgs/msg/ResourceInfo."""
    uses: dict[str, set[str]] = {}
    for name, resource in model.resources.items():
        if resource.ros_names:
            uses.setdefault(name, set()).update(resource.ros_names)
    for mirrored in model.mirrors:
        uses.setdefault(mirrored.name, set()).add("mirrors")
    for name in model.recorded:
        uses.setdefault(name, set()).add("records")
    return uses


_IDLE = ("watchdog", "safe outputs", "commit ", "reserve ", "trial")
"""Begins of names: idle unless a state has a bound, a component faults or a rule acts."""
_LONGEST_NAME = 15
"""That Linux keeps of the name of a thread."""


def real_time_threads() -> Iterator[ThreadInfo]:
    """Threads of this process under SCHED_FIFO that run in normal operation."""
    for entry in os.scandir("/proc/self/task"):
        number = int(entry.name)
        try:
            if os.sched_getscheduler(number) != os.SCHED_FIFO:
                continue
            name = Path(entry.path, "comm").read_text("utf-8", "replace").rstrip("\n")
            priority = os.sched_getparam(number).sched_priority
            cpus = os.sched_getaffinity(number)
        except OSError:  # the thread has ended
            continue
        if not name.startswith(_IDLE):
            yield ThreadInfo(name, priority, () if cpus >= online_cpus() else tuple(sorted(cpus)))


def is_named(thread: str, names: Collection[str]) -> bool:
    """Whether one of these names is the thread's, of which Linux keeps the begin."""
    return any(name.encode()[:_LONGEST_NAME] == thread.encode() for name in names)


def _senders(sender: SenderModel) -> Iterator[ThreadInfo]:
    """The thread that sends messages, and the one for the outputs of stops, which is more urgent by one."""
    cpus = tuple(sender.cpus or ())
    for name, priority in (
        ("topics_out", sender.priority),
        ("stops_out", min(sender.priority + 1, _HIGHEST)),
    ):
        yield ThreadInfo(name, priority, cpus, sender.wcet_ns or 0, sender.min_interarrival_ns or 0)
