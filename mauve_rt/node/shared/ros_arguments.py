"""The part of a ROS command line to know before there is a node: the executor's file has its namespace."""

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mauve_rt.errors import ParameterError
from mauve_rt.yaml.text import YamlError, read_yaml

_REMAP, _PARAMETER = ("-r", "--remap"), ("-p", "--param")
_NAME = r"[A-Za-z_]\w*"
_ALL_NODES = "/**"
_ANYWHERE = "/**/"  # before a node's name: in whichever namespace


@dataclass(frozen=True, kw_only=True)
class RosArguments:
    """What `--ros-args` says to a node of one name."""

    given: tuple[tuple[str, dict[str, Any]], ...] = ()  # nodes (as in a parameter file) and their parameters
    node: str = ""
    namespace: str = ""  # of __ns:=, empty: not remapped
    default_node: str = ""  # its name unless remapped

    @property
    def names_namespaces(self) -> bool:
        """Whether some parameters are for nodes of certain namespaces only."""
        everywhere = (_ALL_NODES, _ANYWHERE + self.node)
        return any(nodes not in everywhere for nodes, _ in self.given)

    @property
    def parameters(self) -> dict[str, Any]:
        """The parameters of such a node, whatever its namespace."""
        return self._of(lambda nodes: nodes.endswith("*") or nodes.rsplit("/", 1)[-1] == self.node)

    def within(self, namespace: str) -> dict[str, Any]:
        """The parameters of the node of that namespace."""
        return self._of(lambda nodes: self._is_of(nodes, namespace))

    def meant_for_it(self, namespace: str) -> dict[str, Any]:
        """As within(), without what a file says to nodes of any name: that may be for others."""
        return self._of(lambda nodes: not nodes.endswith("*") and self._is_of(nodes, namespace))

    def _is_of(self, nodes: str, namespace: str) -> bool:
        return _pattern(nodes).fullmatch(f"{namespace.rstrip('/')}/{self.node}") is not None

    def _of(self, applies: Callable[[str], bool]) -> dict[str, Any]:
        found: dict[str, Any] = {}
        for nodes, values in self.given:
            if applies(nodes):
                found.update(values)  # later ones win, as in rcl
        return found


def parse_ros_arguments(arguments: Sequence[str], *, node: str) -> RosArguments:
    """Parameters (`-p`, `--params-file`) and remappings that apply to the node named `node` unless remapped.

    What else rcl would refuse is left out: rcl says so itself when the node is made.

    Raises:
        ParameterError: the node's name or namespace is remapped to what is none, or a file is no YAML.
    """
    default_node = node
    options = list(_options(arguments))
    rules = [value for option, value in options if option in _REMAP]
    node = _remapped(rules, ("__node", "__name"), node=node) or node
    namespace = _remapped(rules, ("__ns",), node=node)
    if not re.fullmatch(_NAME, node, re.ASCII):
        raise ParameterError(f"remapping __node: expected a name such as boss, found {node}")
    if not re.fullmatch(f"/|(/{_NAME})+|", namespace, re.ASCII):
        raise ParameterError(f"remapping __ns: expected a full namespace such as /robot_1, found {namespace}")
    given: list[tuple[str, dict[str, Any]]] = []
    for option, value in options:
        if option in _PARAMETER:
            source, separator, text = value.partition(":=")
            scope, _, name = source.rpartition(":")
            if separator and scope in ("", node):
                given.append((_ANYWHERE + node, {name: _parse(text)}))
        elif option not in _REMAP:
            given += _of_file(value)
    return RosArguments(given=tuple(given), node=node, namespace=namespace, default_node=default_node)


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
        value = read_yaml(text)
    except YamlError:
        return text
    return text if value is None else value


def _of_file(path: str) -> list[tuple[str, dict[str, Any]]]:
    try:
        return [*_sections(read_yaml(Path(path).read_text(encoding="utf-8")), "")]
    except OSError:
        return []
    except (UnicodeDecodeError, YamlError) as error:
        raise ParameterError(f"parameter file {path}: {error}") from error


def _sections(values: Any, nodes: str) -> Iterator[tuple[str, dict[str, Any]]]:
    """Namespaces may be nested or written out: `robot_1: {executor: {...}}` or `/robot_1/executor: {...}`."""
    for key, value in values.items() if isinstance(values, dict) else ():
        if key != "ros__parameters":
            yield from _sections(value, f"{nodes}/{str(key).strip('/')}")
        elif isinstance(value, dict):
            yield nodes, dict(_flattened(value))


def _pattern(nodes: str) -> re.Pattern[str]:
    """`*` stands for one part of a name, `**` for any number of them."""
    parts = {"**": r"(/\w+)*", "*": r"/\w+"}
    return re.compile("".join(parts.get(part, "/" + re.escape(part)) for part in nodes.split("/")[1:]))


def _flattened(values: dict[Any, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in values.items():
        if isinstance(value, dict):
            yield from _flattened(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value
