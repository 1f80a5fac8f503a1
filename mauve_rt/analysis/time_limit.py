"""A limit on the CPU time of an analysis: the analysis looks at it between components and runs."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

_until_ns: ContextVar[int | None] = ContextVar("until_ns", default=None)


class NoVerdictError(Exception):
    """The limit has passed before the verdict came."""


@contextmanager
def time_limit(cpu_ns: int) -> Iterator[None]:
    """Around an analysis: so much CPU time of the calling thread."""
    token = _until_ns.set(time.thread_time_ns() + cpu_ns)
    try:
        yield
    finally:
        _until_ns.reset(token)


@contextmanager
def optional_part() -> Iterator[None]:
    """Around what a verdict can do without: it ends after a quarter of the time that is left, if it must."""
    until_ns = _until_ns.get()
    if until_ns is None:
        yield
        return
    left_ns = max(until_ns - time.thread_time_ns(), 0)
    try:
        with time_limit(left_ns // 4):
            yield
    except NoVerdictError:
        check_time_limit()


def check_time_limit() -> None:
    """Between two parts of an analysis.

    Raises:
        NoVerdictError: the limit has passed.
    """
    until_ns = _until_ns.get()
    if until_ns is not None and time.thread_time_ns() > until_ns:
        raise NoVerdictError
