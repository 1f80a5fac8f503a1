"""What must not happen at all, as scripts/bench counts it: few rounds, whatever else the machine does."""

import os
import subprocess
import sys

import pytest
from doors import NINJA, ROOT, build

pytestmark = pytest.mark.timeout(1200)  # it compiles
COUNTED = ("restart", "prefault", "latest-value")  # quick, and no load can spoil them


def test_the_counts_that_must_be_zero_are() -> None:
    environment = dict(os.environ) | NINJA
    build("cmake", "--build", ROOT / "build", "--target", "benchmarks", environment=environment)
    only = [word for name in COUNTED for word in ("--only", name)]
    command = [sys.executable, ROOT / "benchmarks" / "run.py", *only, "--rounds", "1", "--gate"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    zero = [line for line in done.stdout.splitlines() if "| 0 | met |" in line or "| 0 ns | met |" in line]
    assert len(zero) == len(COUNTED), done.stdout
