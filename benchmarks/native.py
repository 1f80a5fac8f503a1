"""The C++ programs beside this file, built by CMake: run one, get its line of JSON."""

import json
import subprocess
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar

ROOT = Path(__file__).resolve().parent.parent
_BUILT = ROOT / "build" / "benchmarks"

Result = TypeVar("Result")
Measure = Callable[[int], dict[str, Any]]
"""Runs a program; gets the number of the round."""


class BenchmarkError(Exception):
    """A measurement that could not be made."""


def run(program: str, *, timeout_s: float = 300, **options: float | str) -> dict[str, Any]:
    """Run a program with --name value for each option; what it printed.

    Raises:
        BenchmarkError: it is not built, failed, or printed something else.
    """
    words = [str(_BUILT / program)]
    for name, value in options.items():
        words += [f"--{name.replace('_', '-')}", str(value)]
    try:
        done = subprocess.run(words, capture_output=True, text=True, timeout=timeout_s, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise BenchmarkError(f"{program}: {error}") from None
    if done.returncode:
        raise BenchmarkError(done.stderr.strip() or f"{program}: exit status {done.returncode}")
    result: dict[str, Any] = json.loads(done.stdout)
    return result


def interleaved(rounds: int, *measures: Callable[[int], Result]) -> list[list[Result]]:
    """Run every measure once a round, a different one first each time; results by round and measure.

    Measures get the number of the round, to derive seeds from.
    """
    results = []
    for number in range(rounds):
        order: Sequence[int] = [(number + place) % len(measures) for place in range(len(measures))]
        found = {which: measures[which](number) for which in order}
        results.append([found[which] for which in range(len(measures))])
    return results


def both(program: str, rounds: int, **options: int) -> list[list[dict[str, Any]]]:
    """Rounds of [component, bare]: the two sides of a program, seeded by the round's number."""

    def side(who: str) -> Measure:
        return lambda number: run(program, who=who, seed=number, **options)

    return interleaved(rounds, side("component"), side("bare"))
