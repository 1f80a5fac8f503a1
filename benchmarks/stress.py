"""The machine kept busy at normal priority: by stress-ng, or by one computing thread on each CPU."""

import os
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager

import native
import packages
from native import BenchmarkError

DESCRIPTION = "stress-ng: computing on every CPU, memory, file system, at normal priority"
_RAMP_S = 0.5


def available() -> str:
    """Empty when stress-ng can be run, else why not."""
    return packages.available("stress-ng", "stress-ng")


@contextmanager
def stressed() -> Iterator[None]:
    """Inside, the machine is under stress.

    Raises:
        BenchmarkError: stress-ng does not run, or ended too soon.
    """
    cpus = len(os.sched_getaffinity(0))
    with tempfile.TemporaryDirectory(prefix="mauve_bench_") as folder:
        words = ["stress-ng", "--quiet", "--temp-path", folder]
        words += ["--cpu", str(cpus), "--vm", "1", "--vm-bytes", "128M", "--hdd", "1", "--hdd-bytes", "64M"]
        process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        try:
            time.sleep(_RAMP_S)
            if process.poll() is not None:
                raise BenchmarkError(f"stress-ng ended: {process.communicate()[1].strip()}")
            yield
            if process.poll() is not None:
                raise BenchmarkError(f"stress-ng ended too soon: {process.communicate()[1].strip()}")
        finally:
            process.terminate()  # ends its stressors too
            process.communicate()


@contextmanager
def computing() -> Iterator[None]:
    """Inside, an ordinary thread of another process never rests on each CPU.

    Raises:
        BenchmarkError: the program does not run, or ended too soon.
    """
    cpus = len(os.sched_getaffinity(0))
    with native.running("bench_busy", cpus=cpus) as process:
        time.sleep(_RAMP_S)
        yield
        if process.poll() is not None:
            raise BenchmarkError("bench_busy ended too soon")
