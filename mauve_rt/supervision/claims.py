"""What a condition claims about one quantity: a range of its values."""

from dataclasses import dataclass
from math import inf, isinf
from typing import Any, NamedTuple

from mauve_rt.supervision.condition_table import choices, parameters_of, roles
from mauve_rt.supervision.when import When

_NAMING = ("topic", "resource", "component", "executor", "status")
_OF_NO_MATTER = ("type", "above", "below", "hysteresis")  # to what a condition is about


class Quantity(NamedTuple):
    """Something that has one value at an instant."""

    what: str  # such as "silence"
    target: str
    detail: str = ""  # the path of a field, or what is counted
    words: tuple[str, ...] = ()  # its values, where they are words

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
            return f"{self.quantity} = {self._shown(self.low)}"
        if self.high == inf:
            return f"{self.quantity} {'>=' if self.closed else '>'} {self._shown(self.low)}"
        if self.low == -inf:
            return f"{self.quantity} {'<=' if self.closed else '<'} {self._shown(self.high)}"
        return f"{self.quantity} in {self.low:g} to {self.high:g}"

    def _shown(self, value: float) -> str:
        words = self.quantity.words
        return words[int(value)] if words else f"{value:g}"


def claims(leaf: When, *, negated: bool) -> list[Claim]:
    """Claims, one of which holds where the condition does (or does not).

    What parameters mean follows from their names, so that a new condition that uses them needs nothing here;
    one that uses others claims that it holds.
    """
    told = leaf.parameters
    if "at_least" in told:  # a count of what befell
        return _at_least(_quantity(leaf, but="at_least"), int(told["at_least"]), negated=negated)
    for name in ("longer_than_s", "periods"):  # an age
        if told.get(name) is not None:
            limit, quantity = float(told[name]), _quantity(leaf, but=name)
            return [Claim(quantity, 0, limit) if negated else Claim(quantity, limit, closed=False)]
    if "is" in told and "longer_than_s" not in told:  # with both, `is` names one of several facts
        return _is(leaf, negated=negated)
    if "level" in told:
        words = choices(parameters_of(leaf.kind)["level"])
        quantity = _quantity(leaf, but="level")._replace(words=words)
        level = float(words.index(told["level"]))
        return [Claim(quantity, high=level, closed=False) if negated else Claim(quantity, level)]
    if "above" in told or "below" in told:
        low, high = _number(told.get("below"), -inf), _number(told.get("above"), inf)
        margin = 0.0 if negated else _number(told.get("hysteresis"), 0.0)
        return _beyond(_quantity(leaf), low + margin, high - margin, negated=negated)
    value = 0.0 if negated else 1.0
    return [Claim(_quantity(leaf)._replace(words=("false", "true")), value, value)]


def _at_least(quantity: Quantity, count: int, *, negated: bool) -> list[Claim]:
    return [Claim(quantity, 0, count - 1) if negated else Claim(quantity, count)]


def _is(leaf: When, *, negated: bool) -> list[Claim]:
    """Of one of a few values: it is this one, or one before or behind it."""
    words = choices(parameters_of(leaf.kind)["is"]) or ("false", "true")
    quantity = _quantity(leaf, but="is")._replace(words=words)
    said = leaf.parameters["is"]
    value = words.index(str(said).lower())
    if not negated:
        return [Claim(quantity, value, value)]
    return [Claim(quantity, each, each) for each in range(len(words)) if each != value]


def _beyond(quantity: Quantity, low: float, high: float, *, negated: bool) -> list[Claim]:
    """Of a value below one bound or above another; NaN is beyond both, and no number excludes it."""
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


def _quantity(leaf: When, *, but: str = "") -> Quantity:
    """What the condition is about: all that it was told but the parameter that is held against it."""
    role = roles(leaf.kind)
    told = {
        name: value
        for name, value in leaf.parameters.items()
        if value is not None and name not in (but, *_OF_NO_MATTER)
    }
    target = [
        f"resource {value}" if role[name] == "resource" else str(value)
        for name, value in told.items()
        if role[name] in _NAMING
    ]
    detail = [
        str(value) if name == "field" else f"{name} {value}"
        for name, value in told.items()
        if role[name] not in _NAMING
    ]
    return Quantity(leaf.kind, " ".join(target), " ".join(detail))
