"""A run that misses a deadline as JSON, on its way from an executor to `mauve analyze --witness`."""

import json
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from mauve_rt.analysis.digraph import Job
from mauve_rt.analysis.machines import Machine
from mauve_rt.analysis.schedule import Cycle, Schedule
from mauve_rt.analysis.study import Study

_MOST_CYCLES = 500  # the last ones: a reply has a size


def witness_json(study: Study) -> str:
    """The run of what is not schedulable; empty: there is none."""
    schedule = study.verdict.witness
    if schedule is None or schedule.missed is None:
        return ""
    cycles = schedule.cycles[-_MOST_CYCLES:]
    here = {cycle.component for cycle in cycles}
    components = [
        {name: getattr(one.machine, name) for name in ("name", "offset_ns", "period_ns", "overrun")}
        for one in study.subjects
        if one.name in here
    ]
    told = {"components": components, "cycles": cycles, "missed": schedule.missed}
    return json.dumps(told, default=asdict)


def witness_of_json(text: str) -> tuple[list[Machine], Schedule]:
    """The components and the run, of the JSON of an executor of this version."""
    told = json.loads(text)
    nothing: dict[str, Any] = {"cpus": (), "priority": 0, "policy": "", "deadline_ns": 0, "states": ()}
    components = [Machine(**one, **nothing) for one in told["components"]]
    return components, Schedule([_cycle(one) for one in told["cycles"]], [], _cycle(told["missed"]))


def _cycle(told: Mapping[str, Any]) -> Cycle:
    job = Job(**{**told["job"], "states": tuple(told["job"]["states"])})
    return Cycle(**{**told, "job": job, "states": [tuple(state) for state in told["states"]]})
