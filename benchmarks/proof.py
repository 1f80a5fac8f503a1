"""Whether bounds hold: random architectures that are proved, then run, each response beside its bound."""

import os
import time
from collections.abc import Iterator
from random import Random
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from executor_process import ExecutorProcess
from native import BenchmarkError
from processes import Processes
from random_architectures import COMPONENTS, WAKEUP_US, WITNESS, WITNESS_US, proved
from rows import Row, alone, exactly_zero
from settings import Settings
from talkers import plugin_prefix

import mauve_rt.trace
from mauve_rt.analysis.bounds import Subject
from mauve_rt.analysis.digraph import START
from mauve_rt.analysis.study import Study
from mauve_rt.trace.format.records import Kind, Records
from mauve_rt.trace.reading.pairs import following
from mauve_rt.trace.reading.trace import Trace

Times = npt.NDArray[np.int64]

_SEED = 58
_SHOWN = 3


class Job(NamedTuple):
    """One that ran, and its bound."""

    component: str
    name: str
    response_ns: int
    bound_ns: int
    stalled_ns: int
    """For how long the machine stalled before its end, at most, as far as the witness of its CPU saw."""

    @property
    def is_too_long(self) -> bool:
        """Whether it took longer than is proved, and stalls do not explain it."""
        return self.response_ns > self.bound_ns + self.stalled_ns

    @property
    def share(self) -> float:
        """Of its bound."""
        return self.response_ns / self.bound_ns

    def __str__(self) -> str:
        """As `a: Rest to Rest took 2.100 ms, its bound is 2.000 ms`."""
        took = f"{self.component}: {self.name} took {self.response_ns / 1e6:.3f} ms"
        return f"{took}, its bound is {self.bound_ns / 1e6:.3f} ms, stalls {self.stalled_ns / 1e6:.3f} ms"


def proof_rows(settings: Settings) -> Iterator[Row]:
    """Architectures one after another, each for `proof_s`."""
    runs = [*_runs(settings)]
    jobs = [job for run in runs for job in run]
    late = [job for job in jobs if job.is_too_long]
    reached = sum(job.response_ns > job.bound_ns for job in jobs) - len(late)
    sizes = " to ".join(map(str, COMPONENTS))
    note = f"{len(runs)} architectures of {sizes} components, {settings.proof_s:g} s each: {len(jobs):,} jobs"
    note += f"; {reached} more were late by stalls of the machine, by the witness of their CPU"
    yield exactly_zero(
        "responses above their proved bound", [len(late)], note="; ".join([note, *map(str, late[:_SHOWN])])
    )
    yield alone(
        "longest response of an architecture, as a share of its bound",
        [max(job.share for job in run if not job.stalled_ns) for run in runs],
        unit="",
    )


def _runs(settings: Settings) -> Iterator[list[Job]]:
    with Processes() as processes:
        prefix = plugin_prefix(processes.folder, plugin="proof")
        found = os.environ.get("AMENT_PREFIX_PATH", "")
        os.environ["AMENT_PREFIX_PATH"] = f"{prefix}{os.pathsep}{found}"  # for the analysis, too
        try:
            for number in range(settings.proofs):
                yield _run(processes, number, settings.proof_s)
        finally:
            os.environ["AMENT_PREFIX_PATH"] = found


def _run(processes: Processes, number: int, duration_s: float) -> list[Job]:
    file, bag = (processes.folder / f"{what}_{number}" for what in ("proof", "bag"))
    study = proved(Random(_SEED + number), file.with_suffix(".yaml"))  # noqa: S311 - not for secrets
    executor = ExecutorProcess(processes, file.with_suffix(".yaml"), f"bag:={bag}", name=file.name)
    executor.wait()
    time.sleep(duration_s)
    executor.end()
    return [*held_against(mauve_rt.trace.open(bag), study)]


def held_against(trace: Trace, study: Study) -> Iterator[Job]:
    """Each job of a recording beside its bound.

    Raises:
        BenchmarkError: records are lost, a component faulted, or a job is not in the model.
    """
    stalls = {name: _stalls(trace.of(name)) for name in trace.components if name.startswith(WITNESS)}
    for subject in study.subjects:
        if not subject.machine.is_component or subject.name.startswith(WITNESS):
            continue
        records = trace.of(subject.name)
        if trace.losses[subject.name].lost or (records["kind"] == Kind.FAULT).any():
            raise BenchmarkError(f"{subject.name} faulted, or records of it are lost")
        yield from _jobs(trace, subject, study, stalls[f"{WITNESS}_{subject.machine.cpus[0]}"])


def _jobs(trace: Trace, subject: Subject, study: Study, stalls: tuple[Times, Times]) -> Iterator[Job]:
    bounds = {(one.job.after, one.job.until): one.response_ns for one in study.bounds[subject.name].jobs}
    waits = {until for _, until in bounds}
    begins_ns, ends_ns = stalls
    records = trace.of(subject.name)
    pairs = following(records, Kind.RELEASE, (Kind.WAIT,), (Kind.RELEASE, Kind.STOP))
    for release, wait in zip(*pairs, strict=True):
        after, until = (trace.name(int(records["name"][place])) for place in (release, wait))
        job = (after if after in waits else START, until)
        if job not in bounds:
            raise BenchmarkError(f"{subject.name} ran a job that the model lacks: {after} to {until}")
        nominal_ns, end_ns = int(records["a"][release]), int(records["time_ns"][wait])
        window_ns = nominal_ns - 2 * max(bounds.values())  # an earlier stall may still delay it
        lengths_ns = np.minimum(ends_ns, end_ns) - np.maximum(begins_ns, window_ns)
        lengths_ns = lengths_ns[lengths_ns > 0] + WITNESS_US * 1_000  # it may have begun after the last look
        stalled_ns = int(lengths_ns.sum())
        yield Job(subject.name, f"{after} to {until}", end_ns - nominal_ns, bounds[job], stalled_ns)


def _stalls(records: Records) -> tuple[Times, Times]:
    """Begins and ends of the late wake-ups of a witness."""
    releases = records[records["kind"] == Kind.RELEASE]
    late = releases[releases["b"] - releases["a"] > WAKEUP_US * 1_000]
    return late["a"].astype(np.int64), late["b"].astype(np.int64)
