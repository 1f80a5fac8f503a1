"""The mission's robot meets its deadlines by proof; with a slow planner it does not, and a run shows it."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import mauve_rt.trace

ROBOT = Path(__file__).parents[2] / "architecture/robot.yaml"
MS = 1_000_000


def analyzed(*words: str) -> tuple[int, dict[str, Any]]:
    # In a process of its own: here other tests load packages with C++ types of their own for these messages.
    command = [sys.executable, "-m", "mauve_rt.cli", "analyze", str(ROBOT), "--json", *words]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return done.returncode, json.loads(done.stdout)


def test_the_robot_is_schedulable() -> None:
    status, told = analyzed()
    assert (status, told["verdict"]["outcome"]) == (0, "schedulable")
    for one in told["components"]:  # by the cores, from the model
        origins = {state["origin"].partition(" mauve_examples/")[0] for state in one["states"]}
        assert origins == {"declared by core"}
    for one in told["components"]:
        assert 0 < one["response"]["response_ns"] <= one["response"]["deadline_ns"]


def test_a_slow_planner_takes_the_time_of_those_below(tmp_path: Path) -> None:
    bag = tmp_path / "witness"
    status, told = analyzed("--suppose", "guidance.Planning=120ms", "--witness", str(bag))
    assert (status, told["verdict"]["outcome"]) == (1, "not schedulable")
    assert told["verdict"]["sentence"].startswith(
        "not schedulable: mapping misses its deadline at 100.000 ms after the start"
    )
    assert "120.220 ms of guidance" in told["verdict"]["sentence"]
    trace = mauve_rt.trace.open(bag)
    assert [*trace.components] == ["robot", "control", "guidance", "mapping", "exploration"]
    assert trace.lost == 0


def test_its_model_takes_the_place_of_the_installed_parts() -> None:
    """The library of the package has types of other packages as well: it is not loaded beside the model."""
    status, told = analyzed("--model", str(ROBOT.parents[1] / "model.yaml"))
    assert (status, told["verdict"]["outcome"]) == (0, "schedulable")
    assert [one["response"] for one in told["components"]] == [
        one["response"] for one in analyzed()[1]["components"]
    ]
