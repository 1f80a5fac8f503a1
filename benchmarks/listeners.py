"""How soon after a cause the last message of an output reaches a listener here, and a remote one."""

import os
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from native import BenchmarkError
from rows import Row, alone, not_available
from settings import Settings

from mauve_examples.mission.hosts import HostsError

sys.path.append(str(Path(__file__).parents[1] / "tests"))
sys.path.append(str(Path(__file__).parents[1] / "tests/ros"))
sys.path.append(str(Path(__file__).parents[1] / "tests/ros/links"))

from compiled_plugins import install_plugins
from last_message import CAUSES, CONDITIONS, CUT, LOCAL, QUALITIES, REMOTE, TIMEOUT_S, Ending, Machines, Trial

_NAMES = {"fault": "fault", "e_stop": "e-stop rule", "sigterm": "SIGTERM"}
_HOSTS = {LOCAL: "local", REMOTE: "remote"}
_AROUND_S = 0.1  # a driver's own loop, and a computer that lets it wait


def last_message_rows(settings: Settings) -> Iterator[Row]:
    """Each condition `rounds` times: an executor, the outputs of which end by one cause after another."""
    with tempfile.TemporaryDirectory() as folder:
        prefix = Path(folder) / "prefix"
        prefix.mkdir()
        install_plugins(prefix, "executor_tests")
        paths = os.pathsep.join([str(prefix), os.environ.get("AMENT_PREFIX_PATH", "")])
        try:
            machines = Machines(Path(folder), {"AMENT_PREFIX_PATH": paths})
        except HostsError as error:
            raise BenchmarkError(str(error)) from None
        try:
            rounds = [{name: machines.trial(name) for name in CONDITIONS} for _ in range(settings.rounds)]
        except AssertionError as error:
            raise BenchmarkError(str(error)) from None
        finally:
            machines.close()
    for cause in CAUSES:
        for condition in CONDITIONS:
            yield from _rows(cause, condition, [trials[condition] for trials in rounds])
    watched = [ending for trials in rounds for ending in trials[CUT].watched]
    yield _row(
        f"cut cable to the safe command of a remote driver, driver_timeout_ms: {TIMEOUT_S * 1e3:g}",
        watched,
        limit_ms=1e3 * (TIMEOUT_S + _AROUND_S),
        note=_told(watched),
    )


def _rows(cause: str, condition: str, trials: list[Trial]) -> Iterator[Row]:
    endings = [ending for trial in trials for ending in trial.endings if ending.cause == cause]
    for host, where in _HOSTS.items():
        here = [ending for ending in endings if ending.host == host]
        if not here:
            continue  # no message reaches it
        reliable, best_effort = (
            [ending for ending in here if ending.quality == quality] for quality in QUALITIES
        )
        yield _row(
            f"{_NAMES[cause]} to the last message at a {where} listener, {condition}",
            reliable,
            note=f"reliable: {_told(reliable)}; best effort: {_told(best_effort)}",
        )


def _row(what: str, endings: list[Ending], *, limit_ms: float | None = None, note: str) -> Row:
    times_ms = _times_ms(endings)
    return (
        alone(what, times_ms, unit="ms", limit=limit_ms, note=note) if times_ms else not_available(what, note)
    )


def _times_ms(endings: list[Ending]) -> list[float]:
    return [1e3 * ending.safe_after_s() for ending in endings if ending.is_safe()]


def _told(endings: list[Ending]) -> str:
    times_ms = _times_ms(endings)
    safe = f"safe in {len(times_ms)} of {len(endings)}"
    return f"{safe}, maximum {max(times_ms):.3g} ms" if times_ms else safe
