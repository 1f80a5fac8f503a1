"""Figures 1 and 4 of the paper, as mauve graph draws them from the mission's own files."""

from pathlib import Path

import pytest

from mauve_rt.cli.graph_file import drawing_of_file
from mauve_rt.cli.graph_model import fsm_of_model
from mauve_rt.modelling.loading import load_model

EXAMPLES = Path(__file__).parents[3] / "mauve_examples"


def test_the_drawing_of_the_mission_is_fig_1(capsys: pytest.CaptureFixture[str]) -> None:
    drawing, _ = drawing_of_file(EXAMPLES / "architecture/robot.yaml", [], None)
    assert capsys.readouterr().err == "", "the parts are installed"
    rates = {
        node.lines[0]: node.lines[2].partition(",")[0] for node in drawing.nodes if node.kind == "component"
    }
    assert rates == {
        "robot": "10 ms",
        "control": "20 ms",
        "guidance": "100 ms",
        "mapping": "100 ms",
        "exploration": "500 ms",
    }
    names = {node.key: node.lines[0] for node in drawing.nodes}
    arrows = {(names[edge.start], names[edge.end]) for edge in drawing.edges}
    # velocity commands in, the position out
    assert arrows >= {("control", "command"), ("command", "robot"), ("robot", "pose")}
    assert arrows >= {("pose", each) for each in ("control", "guidance", "mapping", "exploration")}
    # goals become targets, and the map is updated by one component
    assert arrows >= {
        ("exploration", "goal"),
        ("goal", "guidance"),
        ("guidance", "target"),
        ("target", "control"),
    }
    assert {start for start, end in arrows if end == "map"} == {"mapping"}
    # the exchange with other robots
    assert arrows >= {("inbox", "exploration"), ("exploration", "outbox")}


def test_the_drawing_of_the_model_is_fig_4() -> None:
    drawing = fsm_of_model(load_model(EXAMPLES / "model.yaml"), "GuidanceFsm")
    states = {node.lines[0]: (node.kind, *node.lines[1:]) for node in drawing.nodes if node.lines}
    assert states == {
        "Idle": ("execution", "read_inputs"),
        "Planning": ("execution", "compute_path"),
        "Following": ("execution", "follow_path"),
        "W1": ("wait", "1 * unit_ms", "100 ms"),
        "W2": ("wait", "2 * unit_ms", "200 ms"),
        "W3": ("wait", "5 * unit_ms", "500 ms"),
    }
    arrows = {(edge.start.split()[-1], edge.end.split()[-1]): edge.lines for edge in drawing.edges}
    assert arrows == {
        ("start", "Idle"): (),
        ("Idle", "Planning"): ("has_new_goal",),
        ("Idle", "Following"): ("has_path",),
        ("Idle", "W1"): ("else",),
        ("Planning", "W3"): (),
        ("Following", "W2"): (),
        **{(wait, "Idle"): () for wait in ("W1", "W2", "W3")},
    }
