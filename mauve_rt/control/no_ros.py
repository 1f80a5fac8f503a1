"""Where there is no ROS: what binds resources to topics and services, in virtual time."""

from collections.abc import Iterable, Mapping
from typing import Any


class NoRos:
    """Topics and services of what is added: whether the middleware takes them only an executor can tell."""

    def open(self, resources: Mapping[str, Any], described: Mapping[str, Any]) -> dict[str, list[int]]:
        """Open nothing."""
        del resources, described
        return {}

    def attach(self, opened: Mapping[str, list[int]]) -> None:
        """Nothing was opened."""
        del opened

    def discard(self, opened: Mapping[str, list[int]]) -> None:
        """Nothing was opened."""
        del opened

    def remove(self, resources: Iterable[str]) -> None:
        """Nothing was open."""
        del resources
