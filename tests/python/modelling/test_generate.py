"""What is generated from a model, and what is left to the user."""

from pathlib import Path
from types import ModuleType

import pytest

from mauve_rt.errors import MauveError
from mauve_rt.modelling.generate import (
    generated,
    interfaces,
    python_module,
    skeletons,
    write_generated,
    write_skeletons,
)
from mauve_rt.modelling.loading import load_model

GUIDANCE = Path(__file__).with_name("guidance.yaml")


def test_only_generated_files_change_and_only_when_they_differ(tmp_path: Path) -> None:
    model = load_model(GUIDANCE)
    folder = tmp_path / "generated"
    write_generated(folder, generated(model))
    own = folder / "notes.txt"
    own.write_text("mine")
    times = {path: path.stat().st_mtime_ns for path in folder.rglob("*.?pp")}
    assert len(times) == 6
    write_generated(folder, generated(model))
    assert times == {path: path.stat().st_mtime_ns for path in times}

    less = load_model("model.yaml", text=GUIDANCE.read_text().partition("  GuidancePsm:")[0])
    write_generated(folder, generated(less))
    assert not (folder / "include/my_robot/model/guidance_psm.hpp").exists()
    assert own.read_text() == "mine"


def test_a_file_of_the_user_is_not_written_over(tmp_path: Path) -> None:
    model = load_model(GUIDANCE)
    mine = tmp_path / "src/plugins.cpp"
    mine.parent.mkdir()
    mine.write_text("// mine")
    with pytest.raises(MauveError, match="is there, and was not generated"):
        write_generated(tmp_path, generated(model))
    assert mine.read_text() == "// mine"


@pytest.mark.parametrize("is_python", [False, True])
def test_skeletons_are_written_once(tmp_path: Path, is_python: bool) -> None:  # noqa: FBT001
    files = skeletons(load_model(GUIDANCE), is_python=is_python)
    written = write_skeletons(tmp_path, files)
    assert written == [*files]
    mine = tmp_path / written[1]
    mine.write_text("mine")
    (tmp_path / written[2]).unlink()
    assert write_skeletons(tmp_path, files) == [written[2]]
    assert mine.read_text() == "mine"


def test_interfaces_of_others_are_named() -> None:
    text = GUIDANCE.read_text(encoding="utf-8")
    text = text.replace("{x: float64, y: float64}", "{at: geometry_msgs/msg/Point}")
    text = text.replace(
        "goal: {read: Point2D}",
        "goal: {read: nav_msgs/msg/Odometry}\n      plan: {call: std_srvs/srv/Trigger}",
    )
    found = interfaces(load_model("model.yaml", text=text))
    assert found == ["geometry_msgs/msg/Point", "nav_msgs/msg/Odometry", "std_srvs/srv/Trigger"]


def test_ports_of_the_parts_of_an_action_register_the_action() -> None:
    text = GUIDANCE.read_text(encoding="utf-8")
    text = text.replace("goal: {read: Point2D}", "goal: {read: mauve_msgs/action/DriveTo_Goal}")
    text = text.replace("target: {write: Point2D", "target: {write: mauve_msgs/action/DriveTo_Feedback")
    model = load_model("model.yaml", text=text)
    assert interfaces(model) == ["mauve_msgs/action/DriveTo"]
    files = generated(model)
    header = files["include/my_robot/model/guidance_shell.hpp"]
    assert "#include <mauve_types/mauve_msgs/action/drive_to.hpp>" in header
    assert 'read_port<mauve::msg::mauve_msgs::DriveTo::Goal>("goal")' in header
    assert files["src/plugins.cpp"].count("action_type<mauve::msg::mauve_msgs::DriveTo>()") == 1


def test_frames_of_ports_are_in_both_languages() -> None:
    text = GUIDANCE.read_text(encoding="utf-8")
    text = text.replace("goal: {read: Point2D}", "goal: {read: Point2D, optional: true, frame: map}")
    text = text.replace("{write: Point2D, on_stop: hold}", "{write: Point2D, frame: odom, child_frame: base}")
    text = text.replace("position: {read: Point2D}", "position: {read: Point2D, child_frame: base}")
    model = load_model("model.yaml", text=text)
    header = generated(model)["include/my_robot/model/guidance_shell.hpp"]
    for port in (
        """read_port<Point2D>("goal").optional().in_frame("map");""",
        """write_port<Point2D>("target").in_frame("odom", "base");""",
        """read_port<Point2D>("position").in_frame("", "base");""",
    ):
        assert port in header
    module = ModuleType("my_robot_parts.model")
    exec(python_module(model), vars(module))  # noqa: S102
    ports = vars(module.GuidanceShell)
    frames = {name: (ports[name].frame, ports[name].child_frame) for name in ("goal", "target", "position")}
    assert frames == {"goal": ("map", ""), "target": ("odom", "base"), "position": ("", "base")}


def test_a_description_cannot_leave_its_comment() -> None:
    text = GUIDANCE.read_text(encoding="utf-8")
    evil = 'description: "a \\"\\"\\" quote, and \\\\"'
    text = text.replace(
        "    shell: GuidanceShell\n    actions", f"    shell: GuidanceShell\n    {evil}\n    actions"
    )
    model = load_model("model.yaml", text=text)
    module = ModuleType("my_robot_parts.model")
    exec(python_module(model), vars(module))  # noqa: S102
    assert module.GuidanceCore.__doc__ == 'a """ quote, and \\'
    assert 'a """ quote, and\n' in generated(model)["include/my_robot/model/guidance_core.hpp"]
