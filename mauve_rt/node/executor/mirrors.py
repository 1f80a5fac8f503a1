"""Values that the executor publishes on request, and those that its file names: ~/mirror."""

import re
from collections.abc import Iterable
from contextlib import suppress

from rclpy.exceptions import NameValidationException
from rclpy.lifecycle import LifecycleNode
from rclpy.validate_topic_name import validate_topic_name

from mauve_rt._bridge import FlatNumbers
from mauve_rt._kernel import ResourceDescription
from mauve_rt.control.values import Values, read_shapes
from mauve_rt.errors import MauveError, one_line
from mauve_rt.file_schema.words import did_you_mean
from mauve_rt.model.flat_fields import flat_fields
from mauve_rt.model.schema import DEFAULT_MIRROR_HZ, MAX_MIRROR_HZ, MirrorModel
from mauve_rt.node.executor.bound_resources import BoundResources, Mirrored
from mauve_rt.parts.message_types import message_class

_NUMBER, _NUMBERS = "std_msgs/msg/Float64", "mauve_msgs/msg/Values"


class Mirrors:
    """The mirrors of an executor. Any thread: BoundResources has the lock."""

    def __init__(self, node: LifecycleNode, values: Values, bound: BoundResources) -> None:
        self._node = node
        self._values = values
        self._bound = bound

    def configure(self, wanted: Iterable[MirrorModel]) -> None:
        """Start those of the file.

        Raises:
            MauveError: one cannot be started; which, and why.
        """
        for each in wanted:
            try:
                self.start(each.name, field=each.field, topic=each.topic, rate_hz=each.rate_hz)
            except MauveError as error:
                raise MauveError(f"executor.mirror: {each.name}: {error}") from error

    def start(
        self, name: str, *, field: str = "", topic: str = "", rate_hz: float = DEFAULT_MIRROR_HZ
    ) -> Mirrored:
        """Publish a value from now on. A mirror that is there already stays as it is.

        Args:
            name: a resource, or component.port.
            field: one number of the value; empty: all of it.
            topic: empty: ~/mirror/NAME.
            rate_hz: most messages a second.

        Raises:
            MauveError: there is no such value, field or type, or the topic is taken.
        """
        if not 0 < rate_hz <= MAX_MIRROR_HZ:
            raise MauveError(f"rate: expected Hz above 0 and at most {MAX_MIRROR_HZ:g}, found {rate_hz:g}")
        resource = self._values.find(name).resource
        is_message = message_class(resource.type) is not None
        numbers = None
        if field or not is_message:
            numbers = _numbers(resource, field)
        mirrored = Mirrored(
            name=name,
            field=field,
            resource=resource.name,
            topic=self._resolved(topic or _topic(name, field)),
            type=_NUMBER if field else resource.type if is_message else _NUMBERS,
            rate_hz=rate_hz,
        )
        self._bound.mirror(mirrored, numbers=numbers, number=0 if field else None)
        return mirrored

    def end(self, name: str, topic: str) -> list[Mirrored]:
        """End the mirrors of a value, or the one on a topic; both empty: all.

        Raises:
            MauveError: there is none.
        """
        full_name = self._resolved(topic) if topic else ""
        ended = self._bound.end_mirrors(
            lambda each: (not name or each.name == name) and (not topic or each.topic == full_name)
        )
        if not ended:
            names = [each.name for each in self._bound.mirrors()]
            if not names:
                raise MauveError("there is no mirror")
            raise MauveError(f"there is no mirror of {name or topic}; {did_you_mean(name, names)}")
        return ended

    def _resolved(self, topic: str) -> str:
        try:
            validate_topic_name(topic)
            return str(self._node.resolve_topic_name(topic))
        except NameValidationException as error:
            raise MauveError(f"topic '{topic}': {one_line(str(error))}") from error


def _numbers(resource: ResourceDescription, field: str) -> FlatNumbers:
    """All numbers of a value, or the one at a path."""
    fields = flat_fields(resource.type, read_shapes(resource))
    try:
        return FlatNumbers(fields, field)
    except MauveError:
        if not field:
            raise
        names = []
        with suppress(MauveError):  # too many or none of them
            names = FlatNumbers(fields).names
        remedy = did_you_mean(field, names) if names else "mauve echo shows its fields"
        raise MauveError(f"{resource.type} has no number '{field}'; {remedy}") from None


def topics(mirrored: Mirrored) -> list[str]:
    """On which it publishes: the values, then their names where these are not in the message's type."""
    names = [f"{mirrored.topic}/names"] if mirrored.type == _NUMBERS else []
    return [mirrored.topic, *names]


def _topic(name: str, field: str) -> str:
    """~/mirror/pose/position/x, ~/mirror/control/error."""
    words = ".".join(word for word in (name, field) if word)
    path = re.sub(r"[\[\].]+", "/", words).strip("/")
    return "~/mirror/" + re.sub(r"/(?=\d)", "/_", path)  # no name of ROS starts with a digit
