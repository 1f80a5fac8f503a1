"""The last command, as long as it is fresh."""

import math
import time
from collections.abc import Callable
from typing import Generic, TypeVar

Command = TypeVar("Command")


class CommandWatch(Generic[Command]):
    """Keeps the last command, and yields the safe one once nothing has come for a time.

        watch = CommandWatch(0.3, safe=Twist())
        node.create_subscription(Twist, "cmd_vel", watch.received, qos)
        ...
        move(watch.value)  # in the driver's own loop

    The age counts from the reception, by CLOCK_MONOTONIC of this computer: neither the sender's time nor a
    step of the wall clock counts. One thread may receive while others read.
    """

    def __init__(
        self, timeout_s: float, safe: Command, *, now_ns: Callable[[], int] = time.monotonic_ns
    ) -> None:
        """`safe`: before the first command, and from `timeout_s` after the last one on. `now_ns`: the clock.

        Raises:
            ValueError: the timeout is not a positive number.
        """
        if not (timeout_s > 0 and math.isfinite(timeout_s)):
            raise ValueError(f"timeout_s: expected a positive number of seconds, found {timeout_s}")
        self._timeout_ns = round(timeout_s * 1e9)
        self._safe = safe
        self._now_ns = now_ns
        self._last: tuple[int, Command] | None = None  # exchanged whole

    def received(self, command: Command) -> None:
        """A command has come now."""
        self._last = (self._now_ns(), command)

    @property
    def value(self) -> Command:
        """What to do now."""
        last = self._last
        return last[1] if last is not None and self._is_fresh(last[0]) else self._safe

    @property
    def is_safe(self) -> bool:
        """Whether that is the safe command for want of a fresh one."""
        last = self._last
        return last is None or not self._is_fresh(last[0])

    @property
    def age_s(self) -> float:
        """Time since the last command, s; infinite before the first one."""
        last = self._last
        return math.inf if last is None else (self._now_ns() - last[0]) / 1e9

    def _is_fresh(self, received_ns: int) -> bool:
        return self._now_ns() - received_ns < self._timeout_ns
