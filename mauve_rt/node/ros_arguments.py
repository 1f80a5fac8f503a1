"""The part of a ROS command line to know before there is a node: the executor's file has its namespace."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from mauve_rt.errors import ParameterError

_REMAP, _PARAMETER = ("-r", "--remap"), ("-p", "--param")
_NAME = r"[A-Za-z_]\w*"


@dataclass(frozen=True, kw_only=True)
class RosArguments:
    """What `--ros-args` says to one node."""

    parameters: dict[str, Any] = field(default_factory=dict)  # later ones win, as in rcl
    namespace: str = ""  # of __ns:=, empty: not remapped


def parse_ros_arguments(arguments: Sequence[str], *, node: str) -> RosArguments:
    """Parameters (`-p`, `--params-file`) and remappings that apply to the node named `node` unless remapped.

    What else rcl would refuse is left out: rcl says so itself when the node is made.

    Raises:
        ParameterError: the node's name or namespace is remapped to what is none.
    """
    options = list(_options(arguments))
    rules = [value for option, value in options if option in _REMAP]
    node = _remapped(rules, ("__node", "__name"), node=node) or node
    namespace = _remapped(rules, ("__ns",), node=node)
    if not re.fullmatch(_NAME, node, re.ASCII):
        raise ParameterError(f"remapping __node: expected a name such as boss, found {node}")
    if not re.fullmatch(f"/|(/{_NAME})+|", namespace, re.ASCII):
        raise ParameterError(f"remapping __ns: expected a full namespace such as /robot_1, found {namespace}")
    parameters: dict[str, Any] = {}
    for option, value in options:
        if option in _PARAMETER:
            source, separator, text = value.partition(":=")
            scope, _, name = source.rpartition(":")
            if separator and scope in ("", node):
                parameters[name] = _parse(text)
        elif option not in _REMAP:
            parameters.update(_of_file(value, node))
    return RosArguments(parameters=parameters, namespace=namespace)


def _remapped(rules: Sequence[str], sources: Sequence[str], *, node: str) -> str:
    """The target of the first rule for one of `sources`, which is the one rcl takes; empty: there is none."""
    for rule in rules:
        source, _, target = rule.partition(":=")
        scope, _, name = source.rpartition(":")
        if name in sources and scope in ("", node):
            return target
    return ""


def _options(arguments: Sequence[str]) -> Iterator[tuple[str, str]]:
    """(option, value) of the options that matter, within the stretches `--ros-args ... [--]`."""
    inside = False
    words = iter(arguments)
    for word in words:
        if word == "--ros-args":
            inside = True
        elif word == "--":
            inside = False
        elif inside and word in (*_REMAP, *_PARAMETER, "--params-file"):
            value = next(words, None)
            if value is not None:
                yield word, value


def _parse(text: str) -> Any:
    try:
        value = YAML(typ="safe", pure=True).load(text)
    except (YAMLError, ValueError, RecursionError):
        return text
    return text if value is None else value


def _of_file(path: str, node: str) -> dict[str, Any]:
    try:
        document = YAML(typ="safe", pure=True).load(Path(path).read_text(encoding="utf-8"))
    except (OSError, YAMLError, ValueError, RecursionError):
        return {}
    found: dict[str, Any] = {}
    for pattern, section in document.items() if isinstance(document, dict) else ():
        applies = re.fullmatch(r"/\*\*|(/\*\*|/?[\w/]*/)?/?" + re.escape(node), str(pattern)) is not None
        values = section.get("ros__parameters") if isinstance(section, dict) else None
        if applies and isinstance(values, dict):
            found.update(_flattened(values))
    return found


def _flattened(values: dict[Any, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in values.items():
        if isinstance(value, dict):
            yield from _flattened(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value
