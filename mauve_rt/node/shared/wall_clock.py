"""Steps of CLOCK_REALTIME: NTP, GPS or an operator sets the clock while a program runs."""

import time

_STEP_NS = 500_000_000  # a clock that is slewed gains at most 0.5 ms in a second
_RECENT_NS = 60_000_000_000


class WallClock:
    """Notices steps of the clock. For one thread."""

    def __init__(self) -> None:
        self._ahead_ns = _ahead_ns()
        self._text = ""  # of the last step
        self._noticed_ns = 0

    def look(self) -> str:
        """Describe a step since the last call, "" if there was none."""
        ahead_ns = _ahead_ns()
        step_ns, self._ahead_ns = ahead_ns - self._ahead_ns, ahead_ns
        if abs(step_ns) < _STEP_NS:
            return ""
        self._noticed_ns = time.monotonic_ns()
        self._text = (
            f"the clock of this machine was set {'forward' if step_ns > 0 else 'back'} by "
            f"{abs(step_ns) / 1e9:.1f} s: times of the log and stamps of messages jump; components, rules "
            "and services go by the monotonic clock"
        )
        return self._text

    def recent(self) -> str:
        """The last step, for a minute."""
        return self._text if time.monotonic_ns() - self._noticed_ns < _RECENT_NS else ""


def _ahead_ns() -> int:
    """Of CLOCK_BOOTTIME: it goes on while the machine is suspended."""
    return time.time_ns() - time.clock_gettime_ns(time.CLOCK_BOOTTIME)
