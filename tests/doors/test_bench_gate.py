"""What must not happen at all, as scripts/bench counts it: few rounds, whatever else the machine does."""

import json
import os
import shlex
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import pytest
from doors import NINJA, ROOT, build

pytestmark = pytest.mark.timeout(1200)  # it compiles
# Quick, and no load can spoil them. Each has a program.
COUNTED = {"restart": "bench_restart", "prefault": "bench_prefault", "latest-value": "bench_latest_value"}


def test_the_counts_that_must_be_zero_are() -> None:
    environment = dict(os.environ) | NINJA
    build("cmake", "--build", ROOT / "build", "--target", *COUNTED.values(), environment=environment)
    only = [word for name in COUNTED for word in ("--only", name)]
    command = [sys.executable, ROOT / "benchmarks" / "run.py", *only, "--rounds", "1", "--gate"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    zero = [line for line in done.stdout.splitlines() if "| 0 | met |" in line or "| 0 ns | met |" in line]
    assert len(zero) == len(COUNTED), done.stdout


def test_each_benchmark_compiles() -> None:
    """Without code of it: a whole build takes three times as long."""
    commands = []
    for unit in json.loads((ROOT / "build" / "compile_commands.json").read_text()):
        if "/benchmarks/" not in unit["file"] or "cmake_pch" in unit["file"]:
            continue
        words = shlex.split(unit["command"])
        output = words.index("-o")
        commands.append(([*words[:output], *words[output + 2 :], "-fsyntax-only"], unit["directory"]))
    assert commands
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(lambda each: build(*each[0], environment=os.environ, cwd=each[1]), commands))
