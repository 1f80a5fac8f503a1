"""What the ros2 command line finds of `ros2 mauve`.

Where ros2cli is installed, tests/ros/cli/test_ros2_command.py runs it.
"""

import ast
import importlib.util
from importlib.metadata import EntryPoints, distribution
from pathlib import Path

import pytest

import mauve_rt
from mauve_rt.cli.verbs import VERBS

GROUPS = {"ros2cli.command": ["mauve"], "ros2cli.extension_point": ["mauve_rt.verb"]}


@pytest.fixture(scope="module")
def entry_points() -> EntryPoints:
    """Of the installed package, as ros2cli reads them."""
    installed = distribution("mauve_rt")
    assert installed.version == mauve_rt.__version__
    return installed.entry_points


def test_the_verbs_are_those_of_mauve(entry_points: EntryPoints) -> None:
    names = [point.name for point in entry_points.select(group="mauve_rt.verb")]
    assert sorted(names) == sorted(verb.name for verb in VERBS)


def test_the_command_and_its_extension_point(entry_points: EntryPoints) -> None:
    for group, names in GROUPS.items():
        assert [point.name for point in entry_points.select(group=group)] == names


def test_each_leads_to_what_there_is(entry_points: EntryPoints) -> None:
    """Without ros2cli the module cannot be imported: its text has to do."""
    spec = importlib.util.find_spec("mauve_rt.cli.ros2")
    assert spec is not None
    assert spec.origin is not None
    body = ast.parse(Path(spec.origin).read_text(encoding="utf-8")).body
    defined = {node.name for node in body if isinstance(node, ast.ClassDef)}
    defined |= {
        ast.unparse(target) for node in body if isinstance(node, ast.Assign) for target in node.targets
    }
    points = [point for group in (*GROUPS, "mauve_rt.verb") for point in entry_points.select(group=group)]
    for point in points:
        name, _, attribute = point.attr.partition(".")
        assert (point.module, name in defined) == ("mauve_rt.cli.ros2", True)
        if point.group == "mauve_rt.verb":
            assert (name, attribute) == ("verbs", point.name.replace("-", "_"))


def test_each_loads(entry_points: EntryPoints) -> None:
    pytest.importorskip("ros2cli", reason="the ros2 command line is not installed: it is no wheel")
    for verb in VERBS:
        (point,) = entry_points.select(group="mauve_rt.verb", name=verb.name)
        extension = point.load()()
        assert (extension.verb, extension.__doc__) == (verb, verb.help)
