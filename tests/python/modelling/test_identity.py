"""A model, the code that is generated from it, and the model that is read back from the registered code."""

import itertools
import sys
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mauve_rt._kernel import PluginRegistry
from mauve_rt.errors import MauveError
from mauve_rt.model.plugins import PluginIndex, PluginLoader, parse_index
from mauve_rt.model.registered_model import registered_model
from mauve_rt.modelling.generate import generated, skeletons, write_generated, write_skeletons
from mauve_rt.modelling.loading import load_model
from mauve_rt.modelling.package_model import PackageModel
from mauve_rt.yaml.writer import write_yaml

GUIDANCE = Path(__file__).with_name("guidance.yaml")
PACKAGES = (f"robot_{number}" for number in itertools.count())  # a module is imported once
TIMES = st.sampled_from(["250 us", "1 ms", "20 ms", "3 * unit_ms", "1 * unit_ms"])
FIXED = st.sampled_from(["1 us", "0.2 ms", "7 ms"])
FIELDS = st.sampled_from(["float64", "uint32", "bool", "float32[3]", "int16[<=8]", "string<=12"])
PORTS = st.sampled_from(
    [
        {"read": "geometry_msgs/msg/Point"},
        {"read": "std_msgs/msg/Float64", "optional": True},
        {"write": "geometry_msgs/msg/Twist"},
        {"write": "mauve_msgs/action/DriveTo_Feedback"},
        {"write": "std_msgs/msg/Bool", "on_commit": "set_zero", "on_stop": "hold"},
        {"event": True},
        {"event": True, "optional": True},
    ]
)
PROPERTIES = st.sampled_from(
    [
        {"type": "float64", "default": 0.5, "unit": "m/s", "minimum": -1.0, "maximum": 2.5},
        {"type": "int64", "default": -3, "description": 'it\'s "so", \\ and so'},
        {"type": "bool", "default": True},
        {"type": "string", "default": "a: b # c", "read_by": "core"},
        {"type": "string", "default": "", "read_by": ["shell", "core"]},
    ]
)
UNIT = {"type": "int64", "default": 10, "unit": "ms", "minimum": 1, "maximum": 1000, "read_by": "fsm"}


@st.composite
def machines(draw: st.DrawFn, core: str, actions: list[str], guards: list[str]) -> dict[str, Any]:
    """Each action in a state of its own; guards lead to any wait."""
    count = len(actions)
    asked = [draw(st.sampled_from(range(count))) for _ in guards]
    states: dict[str, Any] = {}
    for number, action in enumerate(actions):
        branches: list[Any] = [
            {"if": guard, "to": f"W{draw(st.integers(0, count - 1))}"}
            for guard, at in zip(guards, asked, strict=True)
            if at == number
        ]
        bound = draw(st.sampled_from([{}, {"max_execution": "30 ms"}]))
        states[f"S{number}"] = {"run": action, **bound, "next": [*branches, f"W{number}"]}
        states[f"W{number}"] = {"wait": draw(TIMES), "next": f"S{(number + 1) % count}"}
    if draw(st.booleans()):
        states["W0"] = {
            "wait_event": {
                "inputs": "trigger",
                "timeout": draw(st.sampled_from(["1 s", "forever"])),
                "min_interarrival": draw(TIMES),
            },
            "next": "S0" if count == 1 else "S1",
        }
    return {"core": core, "initial": "S0", "states": states}


@st.composite
def periodic_machines(draw: st.DrawFn, core: str, actions: list[str], guards: list[str]) -> dict[str, Any]:
    """A ring of all actions; guards are asked in the first state."""
    count = len(actions)
    states: dict[str, Any] = {
        f"S{number}": {"run": action, "next": f"S{(number + 1) % count}"}
        for number, action in enumerate(actions)
    }
    to = f"S{draw(st.integers(0, count - 1))}"
    states["S0"]["next"] = [*({"if": guard, "to": to} for guard in guards), states["S0"]["next"]]
    return {"core": core, "periodic": draw(TIMES), "initial": "S0", "states": states}


@st.composite
def models(draw: st.DrawFn) -> dict[str, Any]:
    """Models whose parts are all used, without descriptions of what becomes comments."""
    content: dict[str, Any] = {
        "mauve_model": 1,
        "package": next(PACKAGES),
        "shells": {},
        "cores": {},
        "fsms": {},
    }
    for name in draw(st.sampled_from([["Leg"], ["Leg", "Eye"]])):
        ports = {"trigger": {"read": "std_msgs/msg/Bool"}}
        ports |= {f"port_{index}": each for index, each in enumerate(draw(st.lists(PORTS, max_size=4)))}
        values = {"unit_ms": UNIT}
        values |= {
            f"value_{index}": each for index, each in enumerate(draw(st.lists(PROPERTIES, max_size=4)))
        }
        content["shells"][f"{name}Shell"] = {"properties": values, "ports": ports}
        actions = [f"act_{index}" for index in range(draw(st.integers(1, 4)))]
        guards = [f"is_{index}" for index in range(draw(st.integers(0, 3)))]
        wcet = {
            method: draw(FIXED) for method in draw(st.lists(st.sampled_from(actions + guards), unique=True))
        }
        implementations = {f"{name}A": {"wcet": wcet} if wcet else {}, f"{name}B": {}}
        core: dict[str, Any] = {"shell": f"{name}Shell", "actions": actions, "guards": guards}
        core["state"] = {
            f"field_{index}": each for index, each in enumerate(draw(st.lists(FIELDS, max_size=3)))
        }
        core |= draw(st.sampled_from([{}, {"handover": {"budget": "50 us"}}]))
        content["cores"][name] = core | {"implementations": implementations}
        content["fsms"][f"{name}Fsm"] = draw(machines(name, actions, guards))
        content["fsms"][f"{name}Psm"] = draw(periodic_machines(name, actions, guards))
    return content


def read_back(model: PackageModel, folder: Path) -> PackageModel:
    """Generate it in Python, load the parts, and read their model."""
    write_generated(folder, generated(model, is_python=True))
    write_skeletons(folder / "python", skeletons(model, is_python=True))
    sys.path.insert(0, str(folder / "python"))
    try:
        plugins, complaints = parse_index((folder / "plugins.txt").read_text(), prefix=folder, origin="index")
        assert complaints == []
        found = registered_model(model.package, PluginLoader(PluginRegistry(), PluginIndex(plugins)))
    finally:
        sys.path.remove(str(folder / "python"))
    assert found.guesses == []
    return load_model("model.yaml", text=write_yaml(found.content))


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(content=models())
def test_a_generated_model_reads_back_the_same(
    content: dict[str, Any], tmp_path_factory: pytest.TempPathFactory
) -> None:
    model = load_model("model.yaml", text=write_yaml(content))
    assert read_back(model, tmp_path_factory.mktemp("model")).content == model.content


def test_a_package_without_parts_is_refused() -> None:
    with pytest.raises(MauveError, match="'no_robot'"):
        registered_model("no_robot", PluginLoader(PluginRegistry(), PluginIndex()))
