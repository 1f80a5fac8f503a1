"""The runs behind the figures: two tasks and their deployer on one processor, recorded into bags.

The deployer is this program's main thread, an ordinary one, pinned to the tasks' processor. What it did and
when is measured here; all that the tasks did comes from their traces.
"""

import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import mauve_rt.trace
from mauve_rt.api import Architecture, Deployer, PluginRegistry, monotonic_ns, ms_to_ns
from mauve_rt.model.plugins import PluginIndex, PluginLoader
from mauve_rt.trace.reading.trace import Trace, merge_traces
from mauve_rt.trace.recording.recorder import Recorder

PERIOD_MS = 40
WORK_MS = (8, 10)  # of tau_1 and tau_2, in each period
PREPARE_MS = 6  # of the core that replaces tau_2's
TASKS = ("tau_1", "tau_2")
_PRIORITIES = (60, 50)
_PERIODS_SHOWN = 3
_PREEMPTED_NS = 1_000_000  # a longer pause of a thread that never sleeps
_ONCE = 60.0  # seconds: the recorder empties the rings when it starts and when it stops, and disturbs nobody


@dataclass(frozen=True)
class Activity:
    """What the deployer was doing; `parts` are the intervals in which it ran, ns of CLOCK_MONOTONIC."""

    label: str
    parts: tuple[tuple[int, int], ...]

    @property
    def begin_ns(self) -> int:
        """When it began."""
        return self.parts[0][0]

    @property
    def end_ns(self) -> int:
        """When it was done."""
        return self.parts[-1][1]


@dataclass(frozen=True)
class Run:
    """One run: who it was, what the deployer did, the trace."""

    trace: Trace
    tasks: tuple[str, str]
    """The names of tau_1 and tau_2 in the trace."""
    deployer: tuple[Activity, ...]
    policy: str
    """The tasks' scheduling policy, read back from their threads."""


def plugin_registry() -> PluginRegistry:
    """A registry that knows the tasks' parts."""
    registry = PluginRegistry()
    loader = PluginLoader(registry, PluginIndex.installed())
    for kind, name in (("shell", "WorkShell"), ("core", "Work"), ("core", "ShortWork"), ("fsm", "WorkFsm")):
        loader.require(kind, f"mauve_examples/{name}")
    return registry


def run_without_barrier(registry: PluginRegistry, folder: Path, cpu: int) -> Run:
    """Fig. 3: tau_1 is started, and when it has run, tau_2: by a deployer each, on an epoch each."""
    stages = [_Stage(registry, folder / task, cpu, (task,)) for task in TASKS]
    activities = []
    with _on_processor(cpu):
        for stage, task in zip(stages, TASKS, strict=True):
            activities.append(_start_and_see(f"start {task}", stage))
        _sleep_until(stages[1].deployer.epoch_ns + _PERIODS_SHOWN * ms_to_ns(PERIOD_MS))
    for stage in stages:
        stage.finish()
    trace = merge_traces({task: stage.trace() for task, stage in zip(TASKS, stages, strict=True)})
    tasks = (f"{TASKS[0]}/{TASKS[0]}", f"{TASKS[1]}/{TASKS[1]}")
    return Run(trace, tasks, tuple(activities), stages[0].policy)


def run_deployment(registry: PluginRegistry, folder: Path, cpu: int) -> Run:
    """Fig. 5: one deployer, the barrier, one epoch."""
    stage = _Stage(registry, folder, cpu, TASKS)
    with _on_processor(cpu):
        activity = _call("deploy", stage.deployer.deploy)
        _sleep_until(stage.deployer.epoch_ns + (_PERIODS_SHOWN + 1) * ms_to_ns(PERIOD_MS))
    stage.finish()
    return Run(stage.trace(), TASKS, (activity,), stage.policy)


def run_reconfiguration(registry: PluginRegistry, folder: Path, cpu: int) -> Run:
    """Fig. 6: the core of tau_2 is replaced while both run."""
    stage = _Stage(registry, folder, cpu, TASKS)
    with _on_processor(cpu):
        stage.deployer.deploy()
        _sleep_until(stage.deployer.epoch_ns + ms_to_ns(2 * PERIOD_MS + sum(WORK_MS) + 3))
        activity = _call(
            "R", lambda: stage.deployer.replace_core(TASKS[1], "mauve_examples/ShortWork", phase_timeout_ns=0)
        )
        _sleep_until(activity.end_ns + _PERIODS_SHOWN * ms_to_ns(PERIOD_MS))
    stage.finish()
    return Run(stage.trace(), TASKS, (activity,), stage.policy)


class _Stage:
    """Tasks with a deployer of their own and a recorder."""

    def __init__(self, registry: PluginRegistry, bag: Path, cpu: int, tasks: tuple[str, ...]) -> None:
        self._bag = bag
        self.architecture = Architecture(registry)
        for task in tasks:
            index = TASKS.index(task)
            self.architecture.add_component(
                task,
                "mauve_examples/WorkShell",
                "mauve_examples/Work",
                "mauve_examples/WorkFsm",
                priority=_PRIORITIES[index],
                cpus=[cpu],
                alternatives=["mauve_examples/ShortWork"],
            )
            for name, value_ms in (("period", PERIOD_MS), ("work", WORK_MS[index]), ("prepare", PREPARE_MS)):
                self.architecture.set_property(task, f"{name}_us", value_ms * 1000)
        self.architecture.configure()
        self.deployer = Deployer(self.architecture)
        self.deployer.prepare_process()
        self._recorder = Recorder(
            self.deployer, bag, node_name="/figures/executor", flush_period_s=_ONCE, drain_period_s=_ONCE
        )
        self._recorder.start()
        self.policy = ""

    def finish(self) -> None:
        """Stop the tasks and close the bag."""
        self.policy = self.architecture.components()[0].policy
        self.deployer.shutdown()
        self._recorder.stop()

    def trace(self) -> Trace:
        """Read the bag."""
        return mauve_rt.trace.open(self._bag)


def _start_and_see(label: str, stage: _Stage) -> Activity:
    """Deploy a task and look until it has been released, as who starts one after the other does.

    A pause between two looks is the task's doing: it runs on the same processor, at a higher priority.
    """
    parts = []
    begin_ns = monotonic_ns()
    stage.deployer.deploy()
    looked_ns = monotonic_ns()
    released = False
    while not released:
        released = stage.architecture.components()[0].releases > 0
        now_ns = monotonic_ns()
        if now_ns - looked_ns > _PREEMPTED_NS:
            parts.append((begin_ns, looked_ns))
            begin_ns = now_ns
        looked_ns = now_ns
    return Activity(label, (*parts, (begin_ns, looked_ns)))


def _call(label: str, call: Callable[[], object]) -> Activity:
    begin_ns = monotonic_ns()
    call()
    return Activity(label, ((begin_ns, monotonic_ns()),))


def _sleep_until(instant_ns: int) -> None:
    time.sleep(max(0, instant_ns - monotonic_ns()) * 1e-9)


@contextmanager
def _on_processor(cpu: int) -> Iterator[None]:
    """Pin the calling thread; those that it creates for a component have CPUs of their own."""
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {cpu})
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)
