"""Counts in words: 1 component, 2 components."""


def counted(count: int, what: str, plural: str = "") -> str:
    """Return e.g. 0 steps, 1 step, 2,000 steps; `plural` where it is not `what` with an s."""
    return f"{count:,} {what if count == 1 else plural or what + 's'}"
