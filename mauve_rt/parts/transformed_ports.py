"""Ports that read values of any frame as values of their own frame."""

import copy
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

from mauve_rt._kernel import TRANSFORM_OUTCOMES, RigidTransform
from mauve_rt.parts.ports import ReadPort, RequestPort, Sample

__all__ = ["TransformedReadPort", "TransformedSample"]

T = TypeVar("T")
_DONE = TRANSFORM_OUTCOMES[0]


@dataclass(frozen=True)
class TransformedSample(Sample[T]):
    """What a read found; `value` is the type's default unless the outcome is `done`."""

    outcome: str = _DONE  # one of TRANSFORM_OUTCOMES
    frame: str = ""  # that is unknown, or has no transform at that time

    def __bool__(self) -> bool:
        """Whether the value is there, in the port's frame."""
        return self.status != "none" and self.outcome == _DONE


class TransformedReadPort(ReadPort[T]):
    """A port to read poses, points, vectors, rotations, twists or wrenches from, in its own frame."""

    def __init__(
        self,
        type: type[T] | str,  # noqa: A002
        *,
        to: str,
        lookup: RequestPort,
        frame: str = "",
        latest: bool = False,
        optional: bool = False,
    ) -> None:
        super().__init__(type, frame=frame, optional=optional)
        self._to, self._lookup, self._latest = to, lookup, latest

    def read(self) -> TransformedSample[T]:
        """The present value in the port's frame, by the transform at the time at which it was written.

        Raises:
            MauveError: the lookup port is not connected, or not answered.
            TypeError: no pose, point, vector, rotation, twist or wrench is in the message.
        """
        sample = super().read()
        header = getattr(sample.value, "header", None)
        source = (header.frame_id if header is not None else "") or self.frame
        if sample.status == "none" or source == self._to:
            return TransformedSample(sample.value, sample.status, sample.time_ns)
        time_ns = 0 if self._latest else sample.time_ns
        request = self._lookup.service.Request(target=self._to, source=source, time_ns=time_ns)
        found = self._lookup.call_through(self._shell, request)
        outcome = TRANSFORM_OUTCOMES[found.outcome]
        if outcome != _DONE:
            none = self.message_class()
            return TransformedSample(none, sample.status, sample.time_ns, outcome, found.frame)
        moved = transformed(found.transform, sample.value)
        if header is not None:
            moved.header.frame_id = self._to  # type: ignore[attr-defined]
        return TransformedSample(moved, sample.status, sample.time_ns)


def transformed(by: Any, value: T) -> T:
    """A copy of a message, as seen from the frame that a geometry_msgs/msg/Transform leads to.

    Raises:
        TypeError: no pose, point, vector, rotation, twist or wrench is in the message.
    """
    p, q = by.translation, by.rotation
    moved = copy.deepcopy(value)
    _move(RigidTransform([p.x, p.y, p.z], [q.x, q.y, q.z, q.w]), moved)
    return moved


def _move(by: RigidTransform, value: Any) -> None:
    """As transform_value() of transformed_values.hpp."""
    for field, move in _FIELDS.items():
        if hasattr(value, field):
            return move(by, value)
    name = type(value).__name__
    if not hasattr(value, "z"):
        raise TypeError(f"{name}: no pose, point, vector, rotation, twist or wrench is in this message")
    return _put(value, by.vector(_xyz(value)) if name == "Vector3" else by.point(_xyz(value)))


def _move_pose(by: RigidTransform, value: Any) -> None:
    _move(by, value.pose)
    _move_covariance(by.pose_covariance, value)


def _move_twist(by: RigidTransform, value: Any) -> None:
    _move(by, value.twist)
    _move_covariance(by.twist_covariance, value)


def _move_place(by: RigidTransform, value: Any) -> None:
    _put(value.position, by.point(_xyz(value.position)))
    _turn(by, value.orientation)


def _xyz(value: Any) -> list[float]:
    return [value.x, value.y, value.z]


def _put(value: Any, numbers: Any) -> None:
    value.x, value.y, value.z = numbers[:3]


def _turn(by: RigidTransform, value: Any) -> None:
    value.x, value.y, value.z, value.w = by.quaternion([value.x, value.y, value.z, value.w])


def _move_pair(move: Any, first: Any, second: Any) -> None:
    one, other = move(_xyz(first), _xyz(second))
    _put(first, one)
    _put(second, other)


def _move_covariance(move: Any, value: Any) -> None:
    if hasattr(value, "covariance"):
        value.covariance = move(value.covariance)


_FIELDS: dict[str, Callable[[RigidTransform, Any], None]] = {
    "pose": _move_pose,
    "twist": _move_twist,
    "orientation": _move_place,
    "linear": lambda by, value: _move_pair(by.twist, value.linear, value.angular),
    "force": lambda by, value: _move_pair(by.wrench, value.force, value.torque),
    "point": lambda by, value: _put(value.point, by.point(_xyz(value.point))),
    "vector": lambda by, value: _put(value.vector, by.vector(_xyz(value.vector))),
    "wrench": lambda by, value: _move(by, value.wrench),
    "quaternion": lambda by, value: _turn(by, value.quaternion),
    "w": _turn,
}
"""By the first of these fields that a message has."""
