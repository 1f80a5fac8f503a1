"""What `mauve new` writes is built, tested and run as its user does it, over this installation."""

import os
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from new_robot import NewRobot

pytestmark = pytest.mark.timeout(600)  # it compiles
MAUVE = shutil.which("mauve") or ""


@pytest.fixture
def new_robot(tmp_path: Path, domain: int) -> Callable[..., NewRobot]:
    """new_robot(NAME, OPTION...) in a folder that is in no workspace."""
    environment = os.environ | {"ROS_DOMAIN_ID": str(domain)}

    def make(name: str, *options: str) -> NewRobot:
        return NewRobot(tmp_path, name, *options, environment=environment, mauve=MAUVE)

    return make


def test_a_new_package_runs_to_its_first_swap(
    new_robot: Callable[..., NewRobot], record_property: Callable[[str, object], None]
) -> None:
    robot = new_robot("my_robot")
    robot.build()
    assert robot.warnings() == ""
    with robot.running():
        record_property("seconds_to_the_swap", robot.swap())
    with robot.running("--rules", "architecture/rules.yaml", "--ros-args", "-p", "drive.speed:=2.0"):
        robot.wait_for_core("my_robot/Halt")  # the rule acts at 1 m
    assert passed(robot.build("--test")) == {"test_drive", "test_halt", "architecture"}


def test_a_new_package_in_python_runs_to_its_first_swap_and_takes_all_parts(
    new_robot: Callable[..., NewRobot], record_property: Callable[[str, object], None]
) -> None:
    robot = new_robot("py_robot", "--python")
    robot.build()
    with robot.running("robot"):
        record_property("seconds_to_the_swap", robot.swap())
    for words in (
        ("component", "LiftArm"),
        ("core", "Fast", "--for", "LiftArm"),
        ("core", "Soft", "--for", "LiftArm", "--python"),  # in Python for a shell in C++
        ("component", "eye", "--python"),
        ("core", "blink", "--for", "Eye", "--python"),
        ("resource", "Tally"),
        ("resource", "Notes", "--python"),
        ("message", "Leg"),
        ("rules", "repair"),
    ):
        robot.mauve("new", *words)
    said = robot.build("--debug", "--test")
    assert robot.warnings() == ""
    assert passed(said) == {"test_lift_arm", "test_fast", "test_tally", "architecture", "pytest"}
    prefix = robot.folder / "install"
    index = (prefix / "share/ament_index/resource_index/mauve_rt_plugins/py_robot").read_text("utf-8")
    names = {line.split("; ")[1] for line in index.splitlines()}
    assert {
        f"py_robot/{name}" for name in ("LiftArm", "Fast", "Soft", "EyeFsm", "Blink", "Tally", "Notes")
    } <= names
    assert (prefix / "share/py_robot/msg/Leg.msg").exists()


def passed(said: str) -> set[str]:
    """The tests of ctest that have passed."""
    return set(re.findall(r"Test +#\d+: (\w+) \.+ +Passed", said))
