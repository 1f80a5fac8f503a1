"""What a component's thread allocates is counted in a Python process too, whenever the kernel was loaded."""

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from mauve_rt import _kernel
from mauve_rt._kernel import (
    Architecture,
    ComponentDescription,
    Deployer,
    PluginRegistry,
    allocation_counting,
)

ALLOCATIONS_OF_WASTEFUL = 4
LIBRARY = Path(_kernel.__file__).resolve().parents[3] / "libmauve_rt.so"
ASK = "from mauve_rt._kernel import allocation_counting; print(allocation_counting())"

pytestmark = pytest.mark.skipif(allocation_counting() == "none", reason="built with a sanitizer")


@pytest.fixture
def architecture(plugin_prefix: Path) -> Iterator[Architecture]:
    registry = PluginRegistry()
    registry.load_library(str(plugin_prefix / "lib" / "libexecutor_tests.so"))
    architecture = Architecture(registry)
    for name, core in (("thrifty", "Counter"), ("wasteful", "Wasteful")):
        architecture.add_component(  # noqa: S604
            name,
            shell="executor_tests/CounterShell",
            core=f"executor_tests/{core}",
            fsm="executor_tests/CounterFsm",
        )
    architecture.configure()
    deployer = Deployer(architecture)
    deployer.deploy()
    until = time.monotonic() + 60
    while min(part.releases for part in architecture.components()) < 10:
        assert time.monotonic() < until
        time.sleep(0.01)
    for name in ("thrifty", "wasteful"):
        deployer.stop(name)
    yield architecture
    deployer.shutdown()


def _part(architecture: Architecture, name: str) -> ComponentDescription:
    return next(part for part in architecture.components() if part.name == name)


def test_allocations_of_a_library_s_component_are_counted_one_by_one(architecture: Architecture) -> None:
    wasteful = _part(architecture, "wasteful")
    assert [time.state for time in wasteful.execution_times] == ["Count"]
    activations = wasteful.execution_times[0].count
    assert activations >= 9
    assert wasteful.allocations == ALLOCATIONS_OF_WASTEFUL * activations


def test_a_component_beside_it_allocates_nothing(architecture: Architecture) -> None:
    assert _part(architecture, "thrifty").allocations == 0


def test_execution_times_are_told_per_state(architecture: Architecture) -> None:
    (count,) = _part(architecture, "wasteful").execution_times
    assert 0 < count.mean_ns <= count.max_ns


@pytest.mark.parametrize(
    ("first", "preload", "counted"),
    [
        ("import ctypes; ctypes.CDLL('libstdc++.so.6'); ", "", "some"),
        ("", str(LIBRARY), "all"),
        ("import ctypes; ctypes.CDLL('libstdc++.so.6'); ", str(LIBRARY), "all"),
    ],
)
def test_what_is_counted_is_told(first: str, preload: str, counted: str) -> None:
    environment = {**os.environ, "LD_PRELOAD": preload}
    answer = subprocess.run(
        [sys.executable, "-c", first + ASK], env=environment, check=True, capture_output=True, text=True
    )
    assert answer.stdout.strip() == counted
