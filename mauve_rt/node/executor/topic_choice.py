"""Which topics of other nodes a recording takes: by name, by a pattern (/camera/*), by a regex."""

import fnmatch
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

from rclpy.lifecycle import LifecycleNode
from rclpy.qos import DurabilityPolicy

from mauve_rt.errors import ParameterError, one_line
from mauve_rt.model import message_class
from mauve_rt.model.schema import QOS_NAMES

_BEST_EFFORT, _LATCHED = "best_effort", "transient_local"
_WILDCARDS = frozenset("*?[")

_OWN = {  # recorded in any case
    "~/state": "mauve_msgs/msg/ArchitectureState",
    "~/events": "mauve_msgs/msg/ReconfigurationEvent",
    "~/decisions": "mauve_msgs/msg/SupervisorDecision",
    "~/shadow": "mauve_msgs/msg/Shadow",
    "~/violations": "mauve_msgs/msg/BoundViolation",
    "~/trace/batches": "mauve_msgs/msg/TraceBatch",
    "~/trace/names": "mauve_msgs/msg/TraceNames",
    "~/trace/architecture": "mauve_msgs/msg/TraceArchitecture",
}


class ChosenTopic(NamedTuple):
    """A topic to record beside the executor's own."""

    name: str
    """As it was given; the node resolves it."""
    full_name: str
    type_name: str
    qos: str
    """One of QOS_NAMES."""


class TopicPattern(NamedTuple):
    """Topics to record by a rule for their names, also those that appear later."""

    text: str
    """As it was given."""
    expression: re.Pattern[str]
    type_name: str = ""
    """Only topics of this type; empty: of any."""
    qos: str = ""
    """One of QOS_NAMES; empty: as the publishers offer it."""

    def fits(self, full_name: str) -> bool:
        """Whether it takes a topic of that name. Hidden ones it takes if it names them."""
        is_hidden = "/_" in full_name and "/_" not in self.text
        return not is_hidden and self.expression.search(full_name) is not None


class Choice(NamedTuple):
    """What a recording was asked to take."""

    topics: tuple[ChosenTopic, ...] = ()
    patterns: tuple[TopicPattern, ...] = ()


class TopicChoice:
    """Chooses topics from names and patterns, by what the ROS graph shows. From any thread."""

    def __init__(self, node: LifecycleNode, bound: Callable[[], Mapping[str, str]]) -> None:
        """`bound`: the topics that resources are bound to now, which are recorded in any case."""
        self._node = node
        self._bound = bound
        self._told: set[tuple[str, str]] = set()  # what was warned of; two threads at once may warn twice

    def choose(self, topics: Sequence[str], expressions: Sequence[str]) -> Choice:
        """Return each topic once, without those that are recorded in any case, and the patterns.

        Raises:
            ParameterError: an entry is no name, no pattern, or names a type that does not fit.

        """
        named = [text for text in topics if not _is_pattern(text)]
        globs = [_glob(text) for text in topics if _is_pattern(text)]
        patterns = (*globs, *map(_expression, expressions))
        chosen = tuple(self._named(named))
        found = self.found(patterns, {topic.full_name for topic in chosen})
        return Choice((*chosen, *found), patterns)

    def found(self, patterns: Iterable[TopicPattern], taken: Iterable[str]) -> list[ChosenTopic]:
        """Return the topics that patterns take now, but those taken already or recorded in any case."""
        patterns = tuple(patterns)
        if not patterns:
            return []
        left_out = {*taken, *self._anyhow()}
        new = []
        for name, types in self._node.get_topic_names_and_types():
            fitting = next((one for one in patterns if name not in left_out and one.fits(name)), None)
            if fitting is not None and (topic := self._of_pattern(fitting, name, types)) is not None:
                new.append(topic)
        return new

    def warn_once(self, full_name: str, what: str) -> None:
        """Log a warning of a topic, once."""
        if (full_name, what) not in self._told:
            self._told.add((full_name, what))
            self._node.get_logger().warning(f"topic {full_name} to record: {what}")

    def _of_pattern(self, pattern: TopicPattern, name: str, types: Sequence[str]) -> ChosenTopic | None:
        types = [one for one in types if pattern.type_name in ("", one)]
        if not types:
            return None
        why = ""
        if len(types) > 1:
            why = f"used with the types {' and '.join(types)}; name it as {name}:package/msg/Type"
        elif message_class(types[0]) is None:
            why = f"its type {types[0]} is not installed; install the package of the type"
        elif self._node.resolve_topic_name(name) != name:
            why = f"the executor remaps it to {self._node.resolve_topic_name(name)}; name that one"
        if why:
            self.warn_once(name, f"{pattern.text} takes it, but {why}: it is not recorded")
            return None
        return ChosenTopic(name, name, types[0], pattern.qos or self._offered(name))

    def _offered(self, name: str) -> str:
        """The quality of service that takes most: the last messages too, where each publisher keeps them."""
        offered = [one.qos_profile.durability for one in self._node.get_publishers_info_by_topic(name)]
        keep_all = bool(offered) and all(one == DurabilityPolicy.TRANSIENT_LOCAL for one in offered)
        return _LATCHED if keep_all else _BEST_EFFORT

    def _anyhow(self) -> dict[str, str]:
        """Topics that are recorded in any case, with their types."""
        own = {self._node.resolve_topic_name(name): type_name for name, type_name in _OWN.items()}
        return {**own, **self._bound()}

    def _named(self, topics: Sequence[str]) -> Iterator[ChosenTopic]:
        """Each topic once; those that are recorded in any case are left out."""
        anyhow = self._anyhow()
        found: dict[str, ChosenTopic] = {}
        for text in topics:
            topic = self._parse(text, anyhow)
            before = found.setdefault(topic.full_name, topic)
            if before[1:] != topic[1:]:
                what = f"{before.type_name}:{before.qos} and {topic.type_name}:{topic.qos}"
                raise ParameterError(
                    f"topic {topic.full_name} to record: named twice, as {what}; name it once"
                )
        return (topic for name, topic in found.items() if name not in anyhow)

    def _parse(self, topic: str, anyhow: Mapping[str, str]) -> ChosenTopic:
        name, type_name, qos, *more = _fields(topic)
        try:
            full_name = self._node.resolve_topic_name(name)
        except Exception as error:  # rclpy has an exception class of its own for each mistake
            expected = f"expected a name, found '{name}': {one_line(str(error))}"
            raise ParameterError(f"topic to record: {expected}") from error
        known = dict(self._node.get_topic_names_and_types()).get(full_name, [])
        known = [anyhow[full_name]] if full_name in anyhow else known
        if not type_name:
            if len(known) != 1:
                found = f"used with the types {' and '.join(known)}" if known else "used by nobody now"
                raise ParameterError(
                    f"topic {full_name} to record: {found}; give its type, {name}:package/msg/Type"
                )
            type_name = known[0]
        elif known and type_name not in known:
            raise ParameterError(
                f"topic {full_name} to record: used as {' and '.join(known)}, found {type_name}"
            )
        if message_class(type_name) is None or more or (qos or _BEST_EFFORT) not in QOS_NAMES:
            expected = "name, name:package/msg/Type of an installed message, and perhaps one of"
            expected = f"{expected} {', '.join(f':{word}' for word in QOS_NAMES)}"
            raise ParameterError(f"topic to record: expected {expected}; found '{topic}'")
        return ChosenTopic(name, full_name, type_name, qos or _BEST_EFFORT)


def _fields(text: str) -> list[str]:
    """Name, type and quality of service of an entry, empty where it has none; what is more comes behind."""
    return [*text.split(":"), *([""] * (2 - text.count(":")))]


def _is_pattern(text: str) -> bool:
    return not _WILDCARDS.isdisjoint(text)


def _glob(text: str) -> TopicPattern:
    name, type_name, qos, *more = _fields(text)
    is_type_known = not type_name or message_class(type_name) is not None
    if not name.startswith("/") or not is_type_known or more or (qos or _BEST_EFFORT) not in QOS_NAMES:
        forms = "/NAME, /NAME:package/msg/Type of an installed message, and perhaps one of"
        expected = f"{forms} {', '.join(f':{word}' for word in QOS_NAMES)}, with * ? [ ] in NAME"
        raise ParameterError(f"pattern of topics to record: expected {expected}; found '{text}'")
    return TopicPattern(text, re.compile(rf"\A{fnmatch.translate(name)}"), type_name, qos)


def _expression(text: str) -> TopicPattern:
    try:
        return TopicPattern(text, re.compile(text))
    except re.error as error:
        what = f"expected a regular expression, found '{text}': {error}"
        raise ParameterError(f"regular expression of topics to record: {what}") from error
