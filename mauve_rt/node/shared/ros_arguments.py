"""The part of a ROS command line to know before there is a node: the executor's file has its namespace.

rcl reads the parameters, so they have the precedence, the types and the wildcards of any node's.
"""

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from mauve_rt._bridge import parameters_of
from mauve_rt.errors import MauveError, ParameterError

_REMAP, _PARAMETER = ("-r", "--remap"), ("-p", "--param")
_NAME = r"[A-Za-z_]\w*"
_ALL_NODES = "/**"


@dataclass(frozen=True, kw_only=True)
class RosArguments:
    """What `--ros-args` says to a node of one name."""

    given: tuple[tuple[str, dict[str, Any]], ...] = ()  # nodes (as in a parameter file) and their parameters
    by_words: frozenset[str] = frozenset()  # names of parameters that -p gives to nodes of any name, or to it
    node: str = ""
    namespace: str = ""  # of __ns:=, empty: not remapped
    default_node: str = ""  # its name unless remapped

    @property
    def names_namespaces(self) -> bool:
        """Whether some parameters are for nodes of certain namespaces only."""
        return any(nodes not in (_ALL_NODES, f"{_ALL_NODES}/{self.node}") for nodes, _ in self.given)

    @property
    def parameters(self) -> dict[str, Any]:
        """The parameters of such a node, whatever its namespace."""
        return self._of(lambda nodes: nodes.endswith("*") or nodes.rsplit("/", 1)[-1] == self.node)

    def within(self, namespace: str) -> dict[str, Any]:
        """The parameters of the node of that namespace."""
        return self._of(lambda nodes: self._is_of(nodes, namespace))

    def meant_for_it(self, namespace: str) -> dict[str, Any]:
        """As within(), without what a file says to nodes of any name: that may be for others."""
        its_own = self._of(lambda nodes: not nodes.endswith("*") and self._is_of(nodes, namespace))
        return {
            name: value
            for name, value in self.within(namespace).items()
            if name in its_own or name in self.by_words
        }

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

    Raises:
        ParameterError: the node's name or namespace is remapped to what is none, or rcl refuses the words.
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
    names = [value.partition(":=")[0].rpartition(":") for option, value in options if option in _PARAMETER]
    by_words = frozenset(name for scope, _, name in names if scope in ("", node))
    try:
        found = parameters_of(list(arguments))
    except MauveError as error:
        raise ParameterError(str(error)) from error
    given = tuple((f"/{nodes.lstrip('/')}", values) for nodes, values in found)
    return RosArguments(
        given=given, by_words=by_words, node=node, namespace=namespace, default_node=default_node
    )


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


def _pattern(nodes: str) -> re.Pattern[str]:
    """`*` stands for one part of a name, `**` for any number of them."""
    parts = {"**": r"(/\w+)*", "*": r"/\w+"}
    return re.compile("".join(parts.get(part, "/" + re.escape(part)) for part in nodes.split("/")[1:]))
