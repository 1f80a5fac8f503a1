"""Which locks components share, and how long they hold those of which only a measurement is known."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

from mauve_rt.analysis.machines import ExecutionTime, Machine


def named_twice(resources: Iterable[str]) -> list[str]:
    """Resources that two or more components name, in alphabetical order."""
    return sorted(name for name, count in Counter(resources).items() if count > 1)


def with_measured_holds(machines: Sequence[Machine], times: Mapping[str, ExecutionTime]) -> list[Machine]:
    """The same, with a time for each undeclared lock that components of one CPU share.

    A resource that components of several CPUs share stays as it is. Measured times contain preemption and
    waiting, so such a resource is no proof that its users cannot meet their deadlines.

    Args:
        machines: all components of the architecture.
        times: the longest that was measured, by resource.

    """
    shared = named_twice(name for machine in machines for name in machine.undeclared_locks)
    users = {name: [one for one in machines if name in one.undeclared_locks] for name in shared}
    taken = {
        name: times[name]
        for name, sharing in users.items()
        if name in times and len(sharing[0].cpus) == 1 and len({one.cpus for one in sharing}) == 1
    }
    return [machine.with_holds(taken) for machine in machines]
