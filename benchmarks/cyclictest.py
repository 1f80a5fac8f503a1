"""cyclictest of Debian's rt-tests, the field's own yardstick of wake-up latency."""

import json
import subprocess
import tempfile
from pathlib import Path

import numpy as np
import packages
from native import BenchmarkError

_OVERFLOW_NS = 1_000_000
"""Latencies from here on are counted, not measured."""


def available() -> str:
    """Empty when cyclictest can be run, else why not."""
    return packages.available("cyclictest", "rt-tests")


def latencies_ns(*, priority: int, cpu: int, duration_s: float) -> list[float]:
    """Latencies of one run at 1 kHz.

    Raises:
        BenchmarkError: it failed.
    """
    loops = round(duration_s * 1000)
    with tempfile.TemporaryDirectory(prefix="mauve_bench_") as folder:
        result = Path(folder) / "result.json"
        words = [
            *(
                "cyclictest",
                "--quiet",
                "--mlockall",
                f"--priority={priority}",
                f"--affinity={cpu}",
                "--threads=1",
            ),
            *(
                "--interval=1000",
                f"--loops={loops}",
                "--nsecs",
                f"--histogram={_OVERFLOW_NS}",
                f"--json={result}",
            ),
        ]
        done = subprocess.run(
            words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, check=False
        )
        if done.returncode:
            raise BenchmarkError(f"cyclictest: {done.stderr.strip()}")
        histogram = json.loads(result.read_text(encoding="utf-8"))["thread"]["0"]["histogram"]
    values = np.array([int(latency) for latency in histogram], np.float64)
    counts = np.array(list(histogram.values()), np.int64)
    over = max(0, loops - int(counts.sum()))
    return [*np.repeat(values, counts).tolist(), *[float(_OVERFLOW_NS)] * over]
