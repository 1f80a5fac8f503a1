"""Random architectures of ros/proof.cpp that are proved to meet their deadlines."""

import json
import os
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from mauve_rt.analysis.study import Study, Surroundings, study
from mauve_rt.analysis.verdict import Outcome
from mauve_rt.cli.analyzed import analyzed

WITNESS = "witness"
"""Begin of names of components of the highest priority, one a CPU: they wake late when the machine stalls."""
WITNESS_US = 500
"""Their period."""
WAKEUP_US = 200
"""The longest wake-up that is declared."""
COMPONENTS = (5, 20)

_OVERHEAD_NS = 20_000
_LOAD = (0.3, 0.7)  # of each CPU, as declared
_PERIODS_MS = (2, 5, 10, 20, 50, 100, 200)
_FSMS = ("Loop", "Turns", "Steps", "Guarded", "Events")  # the last one wants a component that writes
_MARGIN, _MORE_US = (
    1.05,
    50,
)  # by which a declared time is above what a state uses: interrupts count for it, too
_SHARE = 0.3  # of components that share a lock, and of CPUs whose priorities do not follow the periods
_TOP, _LOWEST = 98, 10
_STORES = 2


def proved(random: Random, file: Path) -> Study:
    """Write random architectures into the file until one is schedulable."""
    for _ in count():
        file.write_text(json.dumps(_architecture(random)), encoding="utf-8")  # which is YAML
        found = analyzed(str(file), ())
        proof = study(found.components, Surroundings(threads=found.threads))
        if proof.verdict.outcome is Outcome.SCHEDULABLE:
            return proof
    raise AssertionError


def _architecture(random: Random) -> dict[str, Any]:
    drawn = _Drawn(random)
    cpus = sorted(os.sched_getaffinity(0))
    least, most = (max(2, total // len(cpus)) for total in COMPONENTS)
    for cpu in cpus:
        drawn.add_cpu(cpu, random.randint(least + 1, most))
    executor = {"wakeup_us": WAKEUP_US, "overhead_ns": _OVERHEAD_NS}
    return {
        "mauve": 1,
        "executor": executor,
        "components": drawn.components,
        "resources": drawn.resources,
        "connections": drawn.connections,
    }


@dataclass(frozen=True)
class _Drawn:
    random: Random
    components: dict[str, Any] = field(default_factory=dict)
    resources: dict[str, Any] = field(default_factory=dict)
    connections: list[list[str]] = field(default_factory=list)

    def add_cpu(self, cpu: int, number: int) -> None:
        """So many components, and a witness."""
        self._add(
            f"{WITNESS}_{cpu}", "Loop", {"period_us": WITNESS_US}, {"First": 0}, priority=_TOP, cpus=[cpu]
        )
        self._share(f"{WITNESS}_{cpu}", f"own_{cpu}", 0)
        names = [f"c{cpu}_{place}" for place in range(number)]
        shares = np.array([self.random.uniform(0.2, 1) for _ in names])
        shares *= self.random.uniform(*_LOAD) / shares.sum()
        periods_us = sorted(self.random.choice(_PERIODS_MS) * 1_000 for _ in names)
        priorities = sorted((self.random.randint(_LOWEST, _TOP - 1) for _ in names), reverse=True)
        if self.random.random() < _SHARE:
            self.random.shuffle(priorities)
        for place, name in enumerate(names):
            uses_us = int(shares[place] * periods_us[place])
            self._add_component(
                name, names[:place], periods_us[place], uses_us, priority=priorities[place], cpus=[cpu]
            )

    def _add_component(
        self, name: str, writers: list[str], period_us: int, uses_us: int, **place: Any
    ) -> None:
        kind = self.random.choice(_FSMS if writers else _FSMS[:-1])
        first_us = int(uses_us * self.random.uniform(0.2, 0.8)) if kind in ("Steps", "Guarded") else uses_us
        hold_us = int(first_us * self.random.uniform(0.1, 0.9))
        properties = {"period_us": period_us, "long_us": period_us * self.random.randint(1, 4)}
        properties |= {"first_us": first_us - hold_us, "hold_us": hold_us}
        times_us = {"First": first_us}
        if kind == "Steps":
            properties["second_us"] = times_us["Second"] = uses_us - first_us
        elif kind == "Guarded":
            properties["guard_us"] = times_us["Rest"] = uses_us - first_us
        elif kind == "Events":
            place["deadline_ns"] = period_us * 1_000
            self._read(name, self.random.choice(writers))
        if kind != "Events":
            place["offset_ms"] = self.random.choice([0, 0, self.random.randint(0, 5)])
        self._add(name, kind, properties, times_us, **place)
        store = f"store{place['cpus'][0]}_{self.random.randrange(_STORES)}"
        self._share(name, store if self.random.random() < _SHARE else f"own_{name}", hold_us)

    def _add(
        self, name: str, kind: str, properties: dict[str, int], times_us: dict[str, int], **place: Any
    ) -> None:
        self.components[name] = {
            "shell": "bench/ProofShell",
            "core": "bench/ProofCore",
            "fsm": f"bench/Proof{kind}",
            "properties": properties,
            "states": {state: {"wcet_ns": _declared_ns(us)} for state, us in times_us.items()},
            **place,
        }

    def _share(self, component: str, store: str, hold_us: int) -> None:
        self.connections.append([f"{component}.store", f"{store}.hold"])
        known = self.resources.setdefault(store, {"kind": "bench/ProofStore", "longest_hold_ns": 0})
        known["longest_hold_ns"] = max(known["longest_hold_ns"], _declared_ns(hold_us))

    def _read(self, component: str, writer: str) -> None:
        """Let it be released by what the other one writes."""
        resource = f"from_{writer}"
        if resource not in self.resources:
            self.resources[resource] = {"kind": "latest_value", "type": "geometry_msgs/msg/Point"}
            self.connections.append([f"{writer}.out", f"{resource}.write"])
        self.connections.append([f"{component}.in", f"{resource}.read"])


def _declared_ns(us: int) -> int:
    return int(us * _MARGIN + _MORE_US) * 1_000
