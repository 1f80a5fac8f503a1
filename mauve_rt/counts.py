"""Counts and lengths of time in words: 1 component, 2 components, 2.5 ms."""


def counted(count: int, what: str, plural: str = "") -> str:
    """Return e.g. 0 steps, 1 step, 2,000 steps; `plural` where it is not `what` with an s."""
    return f"{count:,} {what if count == 1 else plural or what + 's'}"


def duration(nanoseconds: int) -> str:
    """`5 us`, `2.5 ms`, `1 s`; `-` for none."""
    size = abs(nanoseconds)
    if size == 0:
        return "-"
    for unit, factor in (("s", 1_000_000_000), ("ms", 1_000_000), ("us", 1_000)):
        if size >= factor:
            return f"{nanoseconds / factor:.4g} {unit}"
    return f"{nanoseconds} ns"
