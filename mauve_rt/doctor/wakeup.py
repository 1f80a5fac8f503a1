"""The wake-up test: how late a thread starts on each CPU, and what one activation costs.

It runs an architecture as an executor does: on each CPU one basic element in C++ (a relay of a number) at
1 kHz. The trace records of its releases have the latencies.
"""

import os
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from mauve_rt.counts import counted
from mauve_rt.doctor.finding import Finding, ok, warning

PRIORITY = 95
_ELEMENT = "mauve_rt/Float64Relay"
_PERIOD_US = 1000
_SETTLE = 20  # releases left out: caches are cold
_DRAIN_NS, _LOOK_S = 100_000_000, 0.25
_NOTABLE_US = 1000.0  # one period of the fastest usual control loop
_EDGES_US = (5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10000)


@dataclass(frozen=True, kw_only=True)
class CpuWakeup:
    """The wake-up latencies on one CPU."""

    cpu: int
    policy: str
    count: int
    min_us: float
    median_us: float
    p999_us: float
    max_us: float
    histogram: list[tuple[float | None, int]]
    """(upper edge in us, None of the last range; how many latencies are in the range)."""


@dataclass(frozen=True, kw_only=True)
class Wakeup:
    """The outcome of the test."""

    seconds: float
    period_us: int = _PERIOD_US
    priority: int = PRIORITY
    cpus: list[CpuWakeup] = field(default_factory=list)
    wakeup_us: float
    """The longest latency of all CPUs."""
    overhead_ns: int | None
    """The CPU time of one release of the element, on the CPU with the longest: a mean over the test.

    As Linux counts it: the wake-up, the activation with its trace, and the next wait. None: not known.
    """

    @property
    def is_fifo(self) -> bool:
        """Whether every thread had real-time rights."""
        return all(each.policy == "SCHED_FIFO" for each in self.cpus)


def measure(seconds: float, cpus: Sequence[int] = ()) -> Wakeup:
    """Run the test on these CPUs, or on all that this process may use.

    Raises:
        MauveError: the basic elements are not installed, or a thread cannot be made.
    """
    import numpy as np  # noqa: PLC0415 - takes its time to load

    from mauve_rt._kernel import Architecture, Deployer, PluginRegistry  # noqa: PLC0415
    from mauve_rt.model.plugins import PluginIndex, PluginLoader  # noqa: PLC0415
    from mauve_rt.trace.format.records import RECORD, Kind  # noqa: PLC0415

    on = list(cpus) or sorted(os.sched_getaffinity(0))
    registry = PluginRegistry()
    loader = PluginLoader(registry, PluginIndex.installed())
    for kind, name in (("shell", f"{_ELEMENT}Shell"), ("core", _ELEMENT), ("fsm", f"{_ELEMENT}Fsm")):
        loader.require(kind, name)
    architecture = Architecture(registry)
    for cpu in on:
        name = f"cpu_{cpu}"
        architecture.add_component(
            name, f"{_ELEMENT}Shell", _ELEMENT, f"{_ELEMENT}Fsm", priority=PRIORITY, cpus=[cpu]
        )
        architecture.set_property(name, "period_us", _PERIOD_US)
        for side, (port, service) in enumerate((("input", "read"), ("output", "write"))):
            architecture.add_resource(f"{name}_{side}", kind="shared_data", type="std_msgs/msg/Float64")
            architecture.connect(name, port, f"{name}_{side}", service)
    architecture.configure()
    deployer = Deployer(architecture)
    deployer.collect_trace(_DRAIN_NS)
    drained: list[bytes] = []
    readings: list[_Reading] = []
    deployer.deploy()
    try:
        policies = {each.name: each.policy for each in architecture.components()}
        until_s = time.monotonic() + seconds
        while (left_s := until_s - time.monotonic()) > 0:
            readings.append(_Reading.now())
            time.sleep(min(left_s, _LOOK_S))
            drained.append(deployer.drain_trace().records)
        readings.append(_Reading.now())
    finally:
        deployer.shutdown()
    drained.append(deployer.drain_trace().records)
    records = np.frombuffer(b"".join(drained), RECORD)
    numbers = {name: number for number, name in enumerate(deployer.trace_components())}
    cpus_found, costs_ns = [], []
    for cpu in on:
        name = f"cpu_{cpu}"
        of_cpu = records[(records["component"] == numbers[name]) & (records["kind"] == Kind.RELEASE)]
        latencies_us = (of_cpu["b"] - of_cpu["a"])[_SETTLE:] / 1e3
        if latencies_us.size:
            cpus_found.append(_statistics(cpu, policies[name], latencies_us))
        costs_ns.append(_release_ns(name, of_cpu["b"], readings[0], readings[-1]))
    return Wakeup(
        seconds=seconds,
        cpus=cpus_found,
        wakeup_us=max((each.max_us for each in cpus_found), default=0.0),
        overhead_ns=max((each for each in costs_ns if each is not None), default=None),
    )


class _Reading(NamedTuple):
    """The CPU time of each thread of this process by its name, at an instant of CLOCK_MONOTONIC."""

    time_ns: int
    spent_ns: dict[str, int]

    @classmethod
    def now(cls) -> "_Reading":
        spent = {}
        for thread in Path("/proc/self/task").iterdir():
            with suppress(OSError):  # it has ended, or this kernel does not count
                name = (thread / "comm").read_text("utf-8", "replace").strip()
                spent[name] = int((thread / "schedstat").read_text("ascii").split()[0])
        return cls(time.monotonic_ns(), spent)


def _release_ns(name: str, releases: Any, first: _Reading, last: _Reading) -> int | None:
    """The CPU time that a thread spent between two readings for each of its releases; None: not known."""
    count = int(((releases >= first.time_ns) & (releases < last.time_ns)).sum())
    if not count or name not in first.spent_ns or name not in last.spent_ns:
        return None
    return (last.spent_ns[name] - first.spent_ns[name]) // count


def describe(wakeup: Wakeup) -> Iterator[Finding]:
    """The test as one line of the report."""
    where = counted(len(wakeup.cpus), "CPU")
    found = f"longest {wakeup.wakeup_us:.0f} us at 1 kHz in {wakeup.seconds:g} s on {where}"
    if not wakeup.is_fifo:
        yield warning(
            f"{found}, as SCHED_OTHER",
            cost="the figure says nothing about components with real-time rights",
            remedy="docs/howto/realtime_rights.md",
        )
    elif wakeup.wakeup_us > _NOTABLE_US:
        yield warning(
            found,
            cost="a component can miss a release of a period of this length",
            remedy="docs/howto/pin_and_isolate_cpus.md, and measure again under the worst load",
        )
    else:
        yield ok(found)


def describe_missing(problem: str) -> Finding:
    """A test that could not be carried out."""
    return warning(
        problem,
        cost="the wake-up latency of this computer is not measured",
        remedy="scripts/setup installs the basic elements that the test runs",
    )


def _statistics(cpu: int, policy: str, latencies_us: Any) -> CpuWakeup:
    import numpy as np  # noqa: PLC0415

    least, median, p999, most = (float(np.percentile(latencies_us, each)) for each in (0, 50, 99.9, 100))
    counts = np.bincount(np.searchsorted(_EDGES_US, latencies_us, side="right"), minlength=len(_EDGES_US) + 1)
    return CpuWakeup(
        cpu=cpu,
        policy=policy,
        count=len(latencies_us),
        min_us=least,
        median_us=median,
        p999_us=p999,
        max_us=most,
        histogram=[(edge, int(count)) for edge, count in zip((*_EDGES_US, None), counts, strict=True)],
    )
