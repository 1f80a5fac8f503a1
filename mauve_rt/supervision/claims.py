"""What a condition claims about one quantity: a range of its values."""

from dataclasses import dataclass
from math import inf, isinf
from typing import Any, NamedTuple

from mauve_rt.supervision.condition_table import roles
from mauve_rt.supervision.when import When


class Quantity(NamedTuple):
    """Something that has one value at an instant."""

    what: str  # such as "silence"
    target: str
    detail: str = ""  # the path of a field

    def __str__(self) -> str:
        return f"{self.what} of {' '.join(word for word in (self.target, self.detail) if word) or 'anything'}"


@dataclass(frozen=True)
class Claim:
    """A quantity lies between two bounds, which belong to the range where it is `closed`."""

    quantity: Quantity
    low: float = -inf
    high: float = inf
    closed: bool = True

    def excludes(self, other: "Claim") -> bool:
        """Whether both cannot be true; itself, where there is nothing in the range."""
        if self.quantity != other.quantity:
            return False
        low, high = max(self.low, other.low), min(self.high, other.high)
        return low > high or (low == high and not (self.closed and other.closed))

    def __str__(self) -> str:
        if self.low == self.high:
            return f"{self.quantity} = {self.low:g}"
        if self.high == inf:
            return f"{self.quantity} {'>=' if self.closed else '>'} {self.low:g}"
        if self.low == -inf:
            return f"{self.quantity} {'<=' if self.closed else '<'} {self.high:g}"
        return f"{self.quantity} in {self.low:g} to {self.high:g}"


def claims(leaf: When, *, negated: bool) -> list[Claim] | None:
    """Claims, one of which holds where the condition does (or does not); None: it claims nothing known.

    What parameters mean follows from their names, so that a new condition that uses them needs nothing here.
    """
    told = leaf.parameters
    quantity = _quantity(leaf)
    if "longer_than_s" in told:
        limit = float(told["longer_than_s"])
        return [Claim(quantity, 0, limit) if negated else Claim(quantity, limit, closed=False)]
    if "is" in told:
        value = float(bool(told["is"]) is not negated)
        return [Claim(quantity, value, value)]
    low, high = _number(told.get("below"), -inf), _number(told.get("above"), inf)
    margin = 0.0 if negated else _number(told.get("hysteresis"), 0.0)
    return _beyond(quantity, low + margin, high - margin, negated=negated)


def _beyond(quantity: Quantity, low: float, high: float, *, negated: bool) -> list[Claim] | None:
    """Of a value below one bound or above another; NaN is beyond both, and no number excludes it."""
    if isinf(low) and isinf(high):
        return None
    if negated:
        return [Claim(quantity, low, high)]
    found = []
    if not isinf(low):
        found.append(Claim(quantity, high=low, closed=False))
    if not isinf(high):
        found.append(Claim(quantity, high, closed=False))
    return found


def _number(value: Any, usual: float) -> float:
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return float(value) if is_number else usual


def _quantity(leaf: When) -> Quantity:
    by_role = {role: leaf.parameters.get(name) for name, role in roles(leaf.kind).items()}
    named = (by_role.get(role) for role in ("topic", "resource", "component", "peer", "name"))
    target = next((str(name) for name in named if name), "")
    return Quantity(leaf.kind, target, str(by_role.get("field") or ""))
