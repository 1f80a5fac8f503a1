"""The launch files as installed: what they name exists.

Where `launch` is installed, tests/ros/test_launch.py runs them.
"""

import ast
import importlib
import os
from pathlib import Path
from typing import Any

import pytest

from mauve_examples.mission.demo_options import parse_options
from mauve_rt.parts.ament_index import share_folder

FILES = {"mauve_rt": "executor.launch.py", "mauve_examples": "exploration.launch.py"}
# Where the parameters of an executable are described.
DESCRIBED = {
    "executor": "mauve_rt.node.executor.main",
    "supervisor": "mauve_rt.node.supervisor.main",
    "radio": "mauve_examples.mission.radio",
}


class LaunchFile:
    """A launch file as text: nothing of it is executed."""

    def __init__(self, package: str) -> None:
        share = share_folder(package)
        assert share is not None
        self.path = share / "launch" / FILES[package]
        self.tree = ast.parse(self.path.read_text(encoding="utf-8"), str(self.path))

    def calls(self, *names: str) -> list[ast.Call]:
        calls = [node for node in ast.walk(self.tree) if isinstance(node, ast.Call)]
        return [call for call in calls if isinstance(call.func, ast.Name) and call.func.id in names]

    def first_words(self, *names: str) -> list[str]:
        """The first arguments of calls, those that are text."""
        first = [call.args[0] for call in self.calls(*names) if call.args]
        return [
            word.value for word in first if isinstance(word, ast.Constant) and isinstance(word.value, str)
        ]

    def constant(self, name: str) -> ast.expr:
        """What a name at the top of the file is assigned."""
        (value,) = (
            node.value
            for node in self.tree.body
            if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == name
        )
        return value

    @property
    def arguments(self) -> list[str]:
        return self.first_words("DeclareLaunchArgument", "_optional")


@pytest.fixture(params=FILES)
def file(request: Any) -> LaunchFile:
    return LaunchFile(request.param)


def _parameters_of_executor() -> list[str]:
    names = LaunchFile("mauve_rt").constant("_PARAMETERS")
    assert isinstance(names, ast.Dict)
    return [ast.literal_eval(key) for key in names.keys if key is not None]


def _options_of_demo() -> tuple[str, ...]:
    names: tuple[str, ...] = ast.literal_eval(LaunchFile("mauve_examples").constant("_OPTIONS"))
    return names


def test_every_argument_is_declared_once_and_used(file: LaunchFile) -> None:
    used = set(file.first_words("given", "LaunchConfiguration"))
    used |= set(_parameters_of_executor() if file.path.name == FILES["mauve_rt"] else _options_of_demo())
    assert sorted(file.arguments) == sorted(used)


def test_every_executable_exists(file: LaunchFile) -> None:
    nodes = file.calls("Node")
    assert nodes
    for node in nodes:
        named = {
            word.arg: ast.literal_eval(word.value)
            for word in node.keywords
            if word.arg in ("package", "executable")
        }
        share = share_folder(named["package"])
        assert share is not None
        program = share.parents[1] / "lib" / named["package"] / named["executable"]
        assert os.access(program, os.X_OK), program


def test_every_parameter_is_known_to_its_executable(file: LaunchFile) -> None:
    for node in file.calls("Node"):
        words = {word.arg: word.value for word in node.keywords}
        executable = ast.literal_eval(words["executable"])
        usage = importlib.import_module(DESCRIBED[executable]).__doc__ or ""
        dictionaries = [found for found in ast.walk(words["parameters"]) if isinstance(found, ast.Dict)]
        names = [ast.literal_eval(key) for found in dictionaries for key in found.keys if key is not None]
        names += {"executor": _parameters_of_executor(), "supervisor": ["rules"], "radio": []}[executable]
        assert names
        for name in names:
            assert f"-p {name}:=" in usage, name


def test_what_is_imported_of_ours_exists(file: LaunchFile) -> None:
    imports = [node for node in ast.walk(file.tree) if isinstance(node, ast.ImportFrom)]
    ours = [node for node in imports if (node.module or "").startswith("mauve_")]
    assert ours
    for node in ours:
        module = importlib.import_module(node.module or "")
        assert all(hasattr(module, name.name) for name in node.names)


def test_the_mission_s_robots_are_launched_by_arguments_there_are() -> None:
    (robot,) = LaunchFile("mauve_examples").calls("_robot")
    given = {word.arg for word in robot.keywords}
    assert {"architecture", "rules"} <= given <= set(LaunchFile("mauve_rt").arguments)


def test_the_mission_s_arguments_are_options_of_the_demo(tmp_path: Path) -> None:
    values = {"map": "room", "link_loss_at": "5", "link_back_at": "9", "out": str(tmp_path / "out")}
    words = [
        f"--{name.replace('_', '-')}={values.get(name, '1')}"
        for name in _options_of_demo()
        if name != "robots"
    ]
    options = parse_options([*words, "--robots=3"])
    assert (options.robots, options.link_loss_at_s, options.link_back_at_s) == (3, 5.0, 9.0)
