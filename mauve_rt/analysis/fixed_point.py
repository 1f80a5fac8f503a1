"""The least time at which all work that is released until then is done."""

from collections.abc import Callable

# Paths, or steps of a fixed point: some seconds of work. A utilization very close to 1 can need more.
MOST_STEPS = 200_000


class UnboundedError(Exception):
    """There is no bound, or it takes too many steps to find. `str()` is the reason."""


def least_time_ns(work_ns: Callable[[int], int], start_ns: int) -> int:
    """The least time t >= start with work(t) <= t; `work_ns` never decreases.

    Raises:
        UnboundedError: not found within `MOST_STEPS` steps.

    """
    time_ns = start_ns
    for _ in range(MOST_STEPS):
        needed_ns = work_ns(time_ns)
        if needed_ns <= time_ns:
            return time_ns
        time_ns = needed_ns
    raise UnboundedError(f"the busy window has more than {MOST_STEPS} steps")
