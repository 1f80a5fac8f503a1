"""Durations in the kernel's unit: whole nanoseconds."""

__all__ = ["FOREVER", "ms_to_ns", "s_to_ns", "us_to_ns"]

FOREVER = 2**63 - 1
"""A length of time that never ends, in ns."""


def us_to_ns(microseconds: float) -> int:
    """Microseconds in nanoseconds."""
    return round(microseconds * 1_000)


def ms_to_ns(milliseconds: float) -> int:
    """Milliseconds in nanoseconds."""
    return round(milliseconds * 1_000_000)


def s_to_ns(seconds: float) -> int:
    """Seconds in nanoseconds."""
    return round(seconds * 1_000_000_000)
