"""ROS message, service and action classes by the names that architecture files and requests use.

A name is looked up in the ament index before anything is imported, and imported only from a prefix that lists
it: no name, whoever sent it, makes a process load another module that happens to be installed.
"""

import importlib
import importlib.util
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from mauve_rt.parts import ament_index

INDEX_RESOURCE = "rosidl_interfaces"
PARTS_OF_ACTIONS = ("Goal", "Result", "Feedback")
"""The messages of an action; the name of one is `package/action/Name_Goal`."""

_PROMISED: set[str] = set()


def promise(names: Iterable[str]) -> None:
    """Treat these as messages of which only the name is known: a model's, before they are generated."""
    _PROMISED.update(names)


def is_promised(name: str) -> bool:
    """Whether it is a message that a model promises, and that is not installed."""
    return name in _PROMISED and message_class(name) is None


def is_message(name: str) -> bool:
    """Whether it is the name of a message, installed or promised."""
    return name in _PROMISED or message_class(name) is not None


def message_class(name: str) -> Any:
    """The Python class of `package/msg/Name`, or of `package/action/Name_Goal`, `_Result` and `_Feedback`.

    None when it is no installed ROS message.
    """
    if action := action_of(name):
        return getattr(action_class(action), name.removeprefix(f"{action}_"), None)
    found = _interface(name, "msg")
    return found if hasattr(found, "get_fields_and_field_types") else None


def service_class(name: str) -> Any:
    """The Python class of `package/srv/Name`; None when it is no installed ROS service."""
    found = _interface(name, "srv")
    return found if hasattr(found, "Request") and hasattr(found, "Response") else None


def action_of(name: str) -> str:
    """The action of a type such as `mauve_msgs/action/DriveTo_Goal`; empty: the type is no part of one."""
    action, _, part = name.rpartition("_")
    return action if part in PARTS_OF_ACTIONS and "/action/" in action else ""


def action_class(name: str) -> Any:
    """The Python class of `package/action/Name`; None when it is no installed ROS action."""
    found = _interface(name, "action")
    return found if all(hasattr(found, part) for part in PARTS_OF_ACTIONS) else None


def _interface(name: str, kind: str) -> Any:
    match = re.fullmatch(rf"([a-z]\w*)/{kind}/([A-Z]\w*)", name, re.ASCII)
    if match is None:
        return None
    package, class_name = match.groups()
    listing = (f"{kind}/{class_name}.{kind}", f"{kind}/{class_name}.idl")
    found = ament_index.contents(INDEX_RESOURCE, package)
    prefixes = [prefix for prefix, text in found if not {*listing}.isdisjoint(text.split())]
    if not prefixes or not _is_within(package, prefixes):
        return None
    try:
        return getattr(importlib.import_module(f"{package}.{kind}"), class_name, None)
    except ImportError:
        return None


def _is_within(package: str, prefixes: Iterable[Path]) -> bool:
    """Whether the module that an import would load, or has loaded, is of one of these prefixes."""
    try:
        spec = importlib.util.find_spec(package)
    except (ImportError, ValueError):
        return False
    folders = [Path(each) for each in (spec.submodule_search_locations if spec else None) or ()]
    roots = [root for prefix in prefixes for root in (prefix, prefix.resolve())]
    return any(
        at.is_relative_to(root) for folder in folders for at in (folder, folder.resolve()) for root in roots
    )
