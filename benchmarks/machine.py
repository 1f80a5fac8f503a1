"""Which machine it was, and what it did to us meanwhile."""

import os
import platform
import re
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from mauve_rt.analysis.obstacles import is_virtual
from mauve_rt.doctor.kernel import preemption


@dataclass(frozen=True, kw_only=True)
class Machine:
    """What a reader needs to know to place the figures."""

    date: str
    cpu: str
    cpus: int
    kernel: str
    preemption: str
    virtualised: bool
    load: tuple[float, float, float]
    missing: list[str]
    """Rights that are not granted."""

    def line(self) -> str:
        """In one line, for people."""
        kind = "virtual machine" if self.virtualised else "bare metal"
        load = " ".join(f"{value:.2f}" for value in self.load)
        rights = f"not granted: {', '.join(self.missing)}" if self.missing else "real-time rights granted"
        return (
            f"{self.date} - {self.cpu}, {self.cpus} CPUs, {kind}, Linux {self.kernel}, {self.preemption}, "
            f"load before {load}, {rights}"
        )

    def as_json(self) -> dict[str, Any]:
        """For machines."""
        return asdict(self)


def describe() -> Machine:
    """Look at the machine."""
    cpuinfo = _text("/proc/cpuinfo")
    model = re.search(r"^model name\s*:\s*(.*)$", cpuinfo, re.MULTILINE)
    return Machine(
        date=datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
        cpu=model[1].strip() if model else platform.machine(),
        cpus=len(os.sched_getaffinity(0)),
        kernel=platform.release(),
        preemption=preemption(),
        virtualised=is_virtual(),
        load=os.getloadavg(),
        missing=_missing_rights(),
    )


class _ShareMeter:
    """Some columns' share of the CPUs' time since this was made."""

    _columns: tuple[int, ...]

    def __init__(self) -> None:
        self._before = _cpu_times()

    def percent(self) -> float:
        """The share so far."""
        spent = [now - before for before, now in zip(self._before, _cpu_times(), strict=True)]
        return 100 * sum(spent[column] for column in self._columns) / max(1, sum(spent))


_IDLE, _IO_WAIT = 3, 4
_STEAL = 7  # columns of /proc/stat; guest times after the last one are contained in user times


class StealMeter(_ShareMeter):
    """The CPU time that the host gave to others."""

    _columns = (_STEAL,)


class IdleMeter(_ShareMeter):
    """The CPU time that no process used."""

    _columns = (_IDLE, _IO_WAIT)


def _cpu_times() -> list[int]:
    words = _text("/proc/stat").splitlines()[0].split()[1:]
    return [int(word) for word in words[: _STEAL + 1]]


def _missing_rights() -> list[str]:
    missing = []
    policy, parameters = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(80))
        os.sched_setscheduler(0, policy, parameters)
    except PermissionError:
        missing.append("SCHED_FIFO")
    if not os.access("/dev/cpu_dma_latency", os.W_OK):
        missing.append("/dev/cpu_dma_latency")
    return missing


def _text(path: str) -> str:
    try:
        return Path(path).read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""
