"""Settings in words, for the reference documentation and for schemas: unit, range, sentence."""

import math
from typing import Any

from mauve_rt.file_schema.kinds import Kind, Real, Whole
from mauve_rt.file_schema.words import shown

_UNITS = {"ns": "ns", "us": "µs", "ms": "ms", "s": "s", "bytes": "bytes", "records": "records"}
_HUGE = 1e12  # a bound that only keeps numbers within 64 bits


def unit_of(key: str) -> str:
    """The unit that the end of a name says: `period_ns` is in ns."""
    return _UNITS.get(key.rpartition("_")[2], "") if "_" in key else ""


def range_of(kind: Kind) -> str:
    """The range of a number; empty where it has none."""
    if isinstance(kind, Real) and kind.above > -math.inf:
        return f"more than {kind.above:g}" + (
            f", at most {_number(kind.most)}" if _is_bound(kind.most) else ""
        )
    return limits(kind.least, kind.most) if isinstance(kind, Whole | Real) else ""


def described(what: str, kind: Kind, unit: str, default: Any = None) -> str:
    """Sentences: what a value is for, its unit, its range and its default."""
    facts = [what, unit and f"unit: {unit}", (bounds := range_of(kind)) and f"range: {bounds}"]
    if isinstance(default, bool | int | float | str) and default != "":
        facts.append(f"default: {default if isinstance(default, str) else shown(default)}")
    return " ".join(sentence(fact) for fact in facts if fact)


def limits(low: float | None, high: float | None) -> str:
    """A range in words."""
    if _is_bound(low) and _is_bound(high):
        return f"{_number(low)} to {_number(high)}"
    if _is_bound(low):
        return f"{_number(low)} or more"
    return f"{_number(high)} or less" if _is_bound(high) else ""


def sentence(text: str) -> str:
    """With a capital letter and a full stop."""
    return text[0].upper() + text[1:] + ("" if text.endswith(".") else ".")


def _is_bound(value: float | None) -> bool:
    return value is not None and abs(value) < _HUGE


def _number(value: Any) -> str:
    return f"{value:,}" if isinstance(value, int) else f"{value:g}"
