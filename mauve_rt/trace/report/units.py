"""Times and counts as a person reads them: three digits, a unit, no ambiguity."""

import math

from mauve_rt import counts

_NARROW_SPACE = "\N{NARROW NO-BREAK SPACE}"
_MINUS = "\N{MINUS SIGN}"
_UNITS = ((1, "ns"), (1_000, "\N{MICRO SIGN}s"), (1_000_000, "ms"), (1_000_000_000, "s"))
_LONGEST_IN_SECONDS_NS = 120_000_000_000
_LONGEST_IN_MINUTES = 120
_TENS, _HUNDREDS, _THOUSANDS = 10, 100, 1000


def time_text(time_ns: float | None) -> str:
    """Return a time with its unit, e.g. 12.3 µs; a dash for None."""
    if time_ns is None:
        return "\N{EN DASH}"
    if time_ns == 0:
        return f"0{_NARROW_SPACE}\N{MICRO SIGN}s"
    size_ns = abs(time_ns)
    sign = _MINUS if time_ns < 0 else ""
    if size_ns >= _LONGEST_IN_SECONDS_NS:
        minutes, seconds = divmod(round(size_ns / 1e9), 60)
        if minutes >= _LONGEST_IN_MINUTES:
            hours, minutes = divmod(minutes, 60)
            return f"{sign}{hours}{_NARROW_SPACE}h{_NARROW_SPACE}{minutes}{_NARROW_SPACE}min"
        return f"{sign}{minutes}{_NARROW_SPACE}min{_NARROW_SPACE}{seconds}{_NARROW_SPACE}s"
    factor, unit = next(pair for pair in reversed(_UNITS) if size_ns >= pair[0] or pair[0] == 1)
    return f"{sign}{digits(size_ns / factor)}{_NARROW_SPACE}{unit}"


def tick_texts(values: list[float]) -> list[str]:
    """Return times in one unit, as exact as it takes to tell them apart."""
    largest = max((abs(value) for value in values), default=0.0)
    factor, unit = next(pair for pair in reversed(_UNITS) if largest >= pair[0] or pair[0] == 1)
    for decimals in range(10):
        numbers = [f"{value / factor:,.{decimals}f}" for value in values]
        if len(set(numbers)) == len(numbers) and all(
            abs(float(text.replace(",", "")) * factor - value) <= abs(value) * 1e-3 + 1e-9
            for text, value in zip(numbers, values, strict=True)
        ):
            break
    return [f"{text.replace('-', _MINUS)}{_NARROW_SPACE}{unit}" for text in numbers]


def digits(value: float) -> str:
    """Return a number of at least three digits; whole numbers below a thousand stay whole."""
    if value == int(value) and value < _THOUSANDS:
        return f"{int(value)}"
    decimals = 2 if value < _TENS else 1 if value < _HUNDREDS else 0
    return f"{value:,.{decimals}f}"


def number_text(value: float | None, *, digits: int = 4) -> str:
    """Return a number of unknown unit with so many digits; a dash for None and NaN."""
    if value is None or math.isnan(value):
        return "\N{EN DASH}"
    return f"{value:.{digits}g}".replace("-", _MINUS)


def share_text(share: float) -> str:
    """Return a share as per cent: 12.3 %; what is not nothing never reads 0."""
    percent = 100 * share
    if 0 < percent < 0.01:  # noqa: PLR2004
        return f"<{_NARROW_SPACE}0.01{_NARROW_SPACE}%"
    return f"{digits(percent)}{_NARROW_SPACE}%"


def counted(count: int, what: str, plural: str = "") -> str:
    """Return e.g. 1 overrun, 2 overruns, no overrun."""
    return counts.counted(count, what, plural) if count else f"no {what}"


def times(count: int) -> str:
    """Return once, 2 times, ..."""
    return "once" if count == 1 else f"{count:,} times"


def listed(words: list[str], *, limit: int = 6) -> str:
    """Return a, b and c; of a long list its first and how many more there are."""
    if len(words) > limit:
        words = [*words[: limit - 1], f"{len(words) - limit + 1} more"]
    if len(words) <= 1:
        return "".join(words)
    return f"{', '.join(words[:-1])} and {words[-1]}"
