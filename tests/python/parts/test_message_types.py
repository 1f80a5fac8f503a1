"""Names of types are looked up in the ament index; nothing else is imported, whatever they say."""

import sys
from pathlib import Path

import pytest
from std_srvs.srv import SetBool

from mauve_msgs.action import DriveTo
from mauve_rt.parts.message_types import action_class, message_class, service_class
from mauve_rt.parts.messages import type_name

NO_TYPES = (
    "",
    "/",
    "/msg/",
    "executor_tests_trap/msg/X",
    "executor_tests_trap/msg/Float64",
    "antigravity/msg/X",
    "os/msg/Path",
    "std_msgs/msg/Nobody",
    "std_msgs/msg/float64",
    "std_msgs/msg/_float64",
    "std_msgs/srv/Float64",
    "std_msgs/msg/Float64\n",
    "std_msgs.msg/msg/Float64",
    "../std_msgs/msg/Float64",
    "../../lib/std_msgs/msg/Float64",
    "std_msgs/../std_msgs/msg/Float64",
    "/std_msgs/msg/Float64",
    "std_msgs/msg/Float64/../Float64",
    "std_msgs/msg/Fl\0at",
    "std_msgs/msg/Fl\u00f6at",
    "std_msgs/msg/" + "F" * 100_000,
    "s" * 300 + "/msg/Float64",
    "executor_tests_trap/action/X_Goal",
    "mauve_msgs/action/DriveTo",
    "mauve_msgs/action/DriveTo_SendGoal_Request",
    "mauve_msgs/action/Nothing_Goal",
    "mauve_msgs/msg/DriveTo_Goal",
    "mauve_msgs/../mauve_msgs/action/DriveTo_Goal",
)


@pytest.fixture
def trap(tmp_path: Path, plugin_prefix: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A file that is there once the trap was imported."""
    path = tmp_path / "imported"
    monkeypatch.setenv("EXECUTOR_TESTS_TRAP", str(path))
    return path


@pytest.mark.parametrize("name", NO_TYPES, ids=[repr(name)[:40] for name in NO_TYPES])
def test_what_no_package_lists_is_not_imported(name: str, trap: Path) -> None:
    before = {*sys.modules}
    assert message_class(name) is None
    assert service_class(name) is None
    assert not trap.exists()
    assert not {"antigravity", "executor_tests_trap"} & ({*sys.modules} - before)


def test_a_package_that_is_listed_is_imported_from_its_prefix_only(
    trap: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    index = tmp_path / "share" / "ament_index" / "resource_index" / "rosidl_interfaces"
    index.mkdir(parents=True)
    (index / "executor_tests_trap").write_text("msg/X.idl\nmsg/X.msg\n", encoding="utf-8")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))
    assert message_class("executor_tests_trap/msg/X") is None
    assert not trap.exists()


def test_installed_types() -> None:
    assert message_class("std_msgs/msg/Float64").__name__ == "Float64"
    assert service_class("std_srvs/srv/SetBool") is SetBool
    assert action_class("mauve_msgs/action/DriveTo") is DriveTo
    assert action_class("mauve_msgs/action/Drive") is None
    assert message_class("std_srvs/srv/SetBool") is None


@pytest.mark.parametrize("part", ["Goal", "Result", "Feedback"])
def test_a_part_of_an_action_has_the_name_that_rosidl_gives_it(part: str) -> None:
    name = f"mauve_msgs/action/DriveTo_{part}"
    assert message_class(name) is getattr(DriveTo, part)
    assert type_name(getattr(DriveTo, part)) == name
