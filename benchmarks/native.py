"""The C++ programs beside this file, built by CMake: run one, get its line of JSON."""

import json
import subprocess
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
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
    try:
        done = subprocess.run(
            _words(program, options), capture_output=True, text=True, timeout=timeout_s, check=False
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise BenchmarkError(f"{program}: {error}") from None
    if done.returncode:
        raise BenchmarkError(done.stderr.strip() or f"{program}: exit status {done.returncode}")
    result: dict[str, Any] = json.loads(done.stdout)
    return result


@contextmanager
def running(program: str, **options: float | str) -> Iterator[subprocess.Popen[str]]:
    """Inside, a program runs, from its first line of output to the end of its input.

    Raises:
        BenchmarkError: it is not built, or printed nothing.
    """
    try:
        process = subprocess.Popen(
            _words(program, options), stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
    except OSError as error:
        raise BenchmarkError(f"{program}: {error}") from None
    with process:  # waits for its end
        assert process.stdin is not None  # noqa: S101 - both are pipes
        assert process.stdout is not None  # noqa: S101
        try:
            if not process.stdout.readline():
                raise BenchmarkError(f"{program} ended too soon")
            yield process
        finally:
            process.stdin.close()


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


def _words(program: str, options: Mapping[str, float | str]) -> list[str]:
    words = [str(_BUILT / program)]
    for name, value in options.items():
        words += [f"--{name.replace('_', '-')}", str(value)]
    return words
