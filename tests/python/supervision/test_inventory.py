"""Whether the effect of a step is in place, by what ~/list_components says."""

import pytest

from mauve_rt.model.steps import Step
from mauve_rt.supervision.inventory import Inventory, ListedComponent

THERE = Inventory(
    "one",
    {
        "guidance": ListedComponent(  # noqa: S604 - no shell of a system
            state="RUNNING",
            shell="a/Shell",
            core="a/Core",
            fsm="a/Fsm",
            properties={"step": "0.5", "name": "'it's'", "on": "true"},
            connections={"goal": "goal.read", "free": ""},
        ),
        "camera": ListedComponent(state="STOPPED"),
    },
    {"goal"},
)


@pytest.mark.parametrize(
    ("kind", "target", "name", "value", "shown"),
    [
        ("replace_core", "guidance", "a/Core", "", True),
        ("replace_core", "guidance", "a/Other", "", False),
        ("replace_core", "nobody", "a/Core", "", False),
        ("replace_fsm", "guidance", "a/Fsm", "", True),
        ("replace_shell", "guidance", "a/Core", "", False),
        ("set_property", "guidance", "step", "5e-1", True),
        ("set_property", "guidance", "step", "0.51", False),
        ("set_property", "guidance", "name", "it's", True),
        ("set_property", "guidance", "on", "true", True),
        ("set_property", "guidance", "on", "1", False),
        ("set_property", "guidance", "missing", "", False),
        ("connect", "guidance", "goal", "goal.read", True),
        ("connect", "guidance", "goal", "other.read", False),
        ("disconnect", "guidance", "free", "", True),
        ("disconnect", "guidance", "goal", "", False),
        ("add_component", "camera", "", "{}", True),
        ("add_component", "nobody", "", "{}", False),
        ("remove_component", "nobody", "", "", True),
        ("remove_component", "camera", "", "", False),
        ("add_resource", "goal", "", "{}", True),
        ("add_resource", "plan", "", "{}", False),
        ("remove_resource", "plan", "", "", True),
        ("remove_resource", "goal", "", "", False),
        ("start", "guidance", "", "", True),
        ("start", "camera", "", "", False),
        ("stop", "camera", "", "", True),
        ("stop", "guidance", "", "", False),
    ],
)
def test_a_step_s_effect(kind: str, target: str, name: str, value: str, shown: bool):  # noqa: FBT001
    step = Step(kind=kind, target=target, name=name, value=value)
    assert THERE.shows([step]) is shown


def test_every_step_counts():
    steps = [Step(kind="stop", target="camera"), Step(kind="stop", target="guidance")]
    assert not THERE.shows(steps)
    assert THERE.shows(steps[:1])
