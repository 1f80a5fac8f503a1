"""Axes of figures: where its ticks are."""

import math

_STEPS = (1, 2, 5, 10)
_DECADES_WITHOUT_HALVES = 2.5
_SPAN_FOR_LOG = 25


def linear_ticks(low: float, high: float, *, count: int = 5) -> list[float]:
    """About `count` round values within an interval."""
    span = high - low
    if span <= 0:
        return [low]
    raw = span / max(count, 1)
    power = 10 ** math.floor(math.log10(raw))
    step = next(power * factor for factor in _STEPS if power * factor >= raw * 0.999)
    first = math.ceil(low / step - 1e-9)
    return [index * step for index in range(first, math.floor(high / step + 1e-9) + 1)]


def log_ticks(low: float, high: float) -> list[float]:
    """Powers of ten within an interval; with their doubles and halves when it is short."""
    factors = (1,) if math.log10(high / low) > _DECADES_WITHOUT_HALVES else (1, 2, 5)
    exponents = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    found = [factor * 10.0**exponent for exponent in exponents for factor in factors]
    return [value for value in found if low <= value <= high]


def asks_for_log(low: float, high: float) -> bool:
    """Tell whether values span so much that only a logarithm shows them all."""
    return low > 0 and high / low > _SPAN_FOR_LOG
