"""Whether bounds hold: random architectures that are proved, then run, each response beside its bound."""

import json
import os
import time
from collections.abc import Iterator
from itertools import count
from pathlib import Path
from random import Random
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from executor_process import ExecutorProcess
from native import BenchmarkError
from processes import Processes
from rows import Row, alone, exactly_zero
from settings import Settings
from talkers import plugin_prefix

import mauve_rt.trace
from mauve_rt.analysis.verdict import Outcome
from mauve_rt.analysis.digraph import START
from mauve_rt.analysis.study import Study, Surroundings, study
from mauve_rt.cli.analyzed import analyzed
from mauve_rt.trace.format.records import Kind, Records
from mauve_rt.trace.reading.pairs import following
from mauve_rt.trace.reading.trace import Trace

Times = npt.NDArray[np.int64]

_COMPONENTS = (5, 20)
_LOAD = (0.3, 0.7)
"""Of each CPU, as declared."""
_PERIODS_MS = (2, 5, 10, 20, 50, 100, 200)
_FSMS = ("Loop", "Turns", "Steps", "Guarded", "Events")
_SHARE_OF_LOCK = 0.3
_MARGIN, _MORE_US = 1.05, 50
"""A state declares this times what it uses, and this more: for what interrupts do on its account."""
_WAKEUP_US, _OVERHEAD_NS = 200, 20_000
_WITNESS, _WITNESS_US = "witness", 500
"""Components of the highest priority, one a CPU: when they wake late, the machine stalled."""
_TOP, _LOWEST = 98, 10
_SETTLE_NS = 200_000_000
_SEED = 58


class Excess(NamedTuple):
    """A response above its bound."""

    component: str
    job: str
    at_ns: int
    response_ns: int
    bound_ns: int
    stalled_ns: int
    """For how long the machine stalled before its end, as far as the witnesses saw."""

    @property
    def is_marked(self) -> bool:
        """Whether stalls of the machine explain it."""
        return self.stalled_ns >= self.response_ns - self.bound_ns


class Run(NamedTuple):
    """What came of one architecture."""

    jobs: int
    excesses: list[Excess]
    nearest: float
    """The largest response as a share of its bound, of all jobs; those that a stall reached left out."""
    stalls: int


def proof_rows(settings: Settings) -> Iterator[Row]:
    """Architectures one after another, each for `proof_s`."""
    runs = []
    with Processes() as processes:
        prefix = plugin_prefix(processes.folder, plugin="proof")
        os.environ["AMENT_PREFIX_PATH"] = f"{prefix}{os.pathsep}{os.environ.get('AMENT_PREFIX_PATH', '')}"
        for number in range(settings.proofs):
            file = processes.folder / f"proof_{number}.yaml"
            study = proved(Random(_SEED + number), file)  # noqa: S311 - not for secrets
            bag = processes.folder / f"bag_{number}"
            executor = ExecutorProcess(processes, file, f"bag:={bag}", name=f"proof_{number}")
            executor.wait()
            time.sleep(settings.proof_s)
            executor.end()
            runs.append(held_against(mauve_rt.trace.open(bag), study))
    jobs = sum(run.jobs for run in runs)
    marked = [one for run in runs for one in run.excesses if one.is_marked]
    others = [one for run in runs for one in run.excesses if not one.is_marked]
    where = f"{len(runs)} architectures of {_COMPONENTS[0]} to {_COMPONENTS[1]} components, {settings.proof_s:g} s each"
    note = f"{where}; {jobs:,} jobs; {len(marked)} more beside {sum(run.stalls for run in runs)} stalls of the machine"
    yield exactly_zero(
        "responses above their proved bound, with no stall of the machine",
        [len(others)],
        note=f"{note}; {'; '.join(map(_words, others[:3]))}" if others else note,
    )
    yield alone("longest response of an architecture as a share of its bound", [run.nearest for run in runs], unit="")


def _words(one: Excess) -> str:
    took = f"{one.response_ns / 1e6:.3f} ms, bound {one.bound_ns / 1e6:.3f} ms"
    return f"{one.component}: job {one.job} took {took}, stalls of {one.stalled_ns / 1e6:.3f} ms"


def proved(random: Random, file: Path) -> Study:
    """Write random architectures until one is schedulable."""
    for _ in count():
        file.write_text(json.dumps(_architecture(random)), encoding="utf-8")  # which is YAML
        found = analyzed(str(file), ())
        proof = study(found.components, Surroundings(threads=found.threads))
        if proof.verdict.outcome is Outcome.SCHEDULABLE:
            return proof
    raise AssertionError


def _architecture(random: Random) -> dict[str, Any]:
    cpus = sorted(os.sched_getaffinity(0))
    components: dict[str, Any] = {}
    resources: dict[str, Any] = {}
    connections: list[list[str]] = []
    for cpu in cpus:
        most = _COMPONENTS[1] // len(cpus)
        names = [f"c{cpu}_{number}" for number in range(random.randint(max(2, _COMPONENTS[0] // len(cpus) + 1), most))]
        _add_components(random, cpu, names, components, resources, connections)
        witness = f"{_WITNESS}_{cpu}"
        components[witness] = _component("Loop", cpu, _TOP, {"period_us": _WITNESS_US}, {"First": 0})
        resources[f"own_{witness}"] = {"kind": "bench/ProofStore", "longest_hold_ns": _declared_ns(0)}
        connections.append([f"{witness}.store", f"own_{witness}.hold"])
    executor = {"wakeup_us": _WAKEUP_US, "overhead_ns": _OVERHEAD_NS}
    return {
        "mauve": 1,
        "executor": executor,
        "components": components,
        "resources": resources,
        "connections": connections,
    }


def _add_components(
    random: Random,
    cpu: int,
    names: list[str],
    components: dict[str, Any],
    resources: dict[str, Any],
    connections: list[list[str]],
) -> None:
    load = random.uniform(*_LOAD)
    shares = np.array([random.uniform(0.2, 1) for _ in names])
    shares *= load / shares.sum()
    periods_us = sorted(random.choice(_PERIODS_MS) * 1_000 for _ in names)
    priorities = sorted((random.randint(_LOWEST, _TOP - 1) for _ in names), reverse=True)
    if random.random() < _SHARE_OF_LOCK:  # not by their periods
        random.shuffle(priorities)
    stores: dict[str, int] = {}
    for place, (name, share, period_us, priority) in enumerate(zip(names, shares, periods_us, priorities, strict=True)):
        kind = random.choice(_FSMS if place else _FSMS[:-1])
        uses_us = int(share * period_us)
        properties = {"period_us": period_us, "long_us": period_us * random.randint(1, 4)}
        split = random.uniform(0.2, 0.8)
        costs = {"first_us": uses_us}
        if kind == "Steps":
            costs = {"first_us": int(uses_us * split), "second_us": int(uses_us * (1 - split))}
        elif kind == "Guarded":
            costs = {"first_us": int(uses_us * split), "guard_us": int(uses_us * (1 - split))}
        hold_us = int(costs["first_us"] * random.uniform(0.1, 0.9))
        costs |= {"first_us": costs["first_us"] - hold_us, "hold_us": hold_us}
        store = f"store{cpu}_{random.randint(0, 1)}" if random.random() < _SHARE_OF_LOCK else f"own_{name}"
        stores[store] = max(stores.get(store, 0), hold_us)
        connections.append([f"{name}.store", f"{store}.hold"])
        times = {"First": costs["first_us"] + hold_us}
        if kind == "Steps":
            times["Second"] = costs["second_us"]
        if kind == "Guarded":
            times["Rest"] = costs["guard_us"]
        if kind == "Events":
            writer = names[random.randrange(place)]
            resource = f"from_{writer}"
            if resource not in resources:
                resources[resource] = {"kind": "latest_value", "type": "geometry_msgs/msg/Point"}
                connections.append([f"{writer}.out", f"{resource}.write"])
            connections.append([f"{name}.in", f"{resource}.read"])
        components[name] = _component(kind, cpu, priority, properties | costs, times)
        components[name]["offset_ms"] = random.choice([0, 0, random.randint(0, 5)])
        if kind == "Events":
            components[name]["deadline_ns"] = period_us * 1_000
            del components[name]["offset_ms"]
    for store, hold_us in stores.items():
        resources[store] = {"kind": "bench/ProofStore", "longest_hold_ns": _declared_ns(hold_us)}


def _component(
    kind: str, cpu: int, priority: int, properties: dict[str, int], times_us: dict[str, int]
) -> dict[str, Any]:
    return {
        "shell": "bench/ProofShell",
        "core": "bench/ProofCore",
        "fsm": f"bench/Proof{kind}",
        "priority": priority,
        "cpus": [cpu],
        "properties": properties,
        "states": {state: {"wcet_ns": _declared_ns(time_us)} for state, time_us in times_us.items()},
    }


def _declared_ns(time_us: int) -> int:
    return int(time_us * _MARGIN + _MORE_US) * 1_000


def held_against(trace: Trace, study: Study) -> Run:
    """Each response of a recording beside the bound of its job."""
    stalls = {component: _stalls(trace.of(component)) for component in trace.components if component.startswith(_WITNESS)}
    jobs, nearest, excesses = 0, 0.0, []
    for subject in study.subjects:
        name = subject.name
        if not subject.machine.is_component or name.startswith(_WITNESS):
            continue
        if trace.losses[name].lost:
            raise BenchmarkError(f"records of {name} are lost")
        bounds = {(one.job.after, one.job.until): one.response_ns for one in study.bounds[name].jobs}
        longest_ns = max(bounds.values())
        initial = next((each.name for each in subject.machine.states if each.is_initial and not each.is_wait), START)
        begins, ends = stalls[f"{_WITNESS}_{subject.machine.cpus[0]}"]
        records = trace.of(name)
        releases, waits = following(records, Kind.RELEASE, (Kind.WAIT,), (Kind.RELEASE, Kind.STOP))
        for release, wait in zip(releases, waits, strict=True):
            nominal_ns, end_ns = int(records["a"][release]), int(records["time_ns"][wait])
            job = trace.name(int(records["name"][release])), trace.name(int(records["name"][wait]))
            if job[0] == initial:
                job = START, job[1]
            if job not in bounds:
                raise BenchmarkError(f"{name} made a job that the model lacks: from {job[0]} to {job[1]}")
            response_ns, bound_ns = end_ns - nominal_ns, bounds[job]
            overlap = np.minimum(ends, end_ns) - np.maximum(begins, nominal_ns - 2 * longest_ns)
            stalled_ns = int(np.clip(overlap, 0, None).sum()) + int((overlap > 0).sum()) * _WITNESS_US * 1_000
            jobs += 1
            if response_ns > bound_ns:
                excesses.append(
                    Excess(name, " to ".join(job), nominal_ns, response_ns, bound_ns, stalled_ns)
                )
            elif not stalled_ns:
                nearest = max(nearest, response_ns / bound_ns)
    return Run(jobs, excesses, nearest, sum(len(begins) for begins, _ in stalls.values()))


def _stalls(records: Records) -> tuple[Times, Times]:
    """Begins and ends of the late wake-ups of a witness."""
    releases = records[records["kind"] == Kind.RELEASE]
    late = releases[releases["b"] - releases["a"] > _WAKEUP_US * 1_000]
    return late["a"].astype(np.int64), late["b"].astype(np.int64)
