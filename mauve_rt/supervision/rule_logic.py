"""What conditions say together: whether a tree can ever hold, and whether two can hold at once.

Every condition is a claim about one quantity, such as the age of the last sample of a topic: a range of its
values. A tree is the ways in which it can hold, each a set of claims that hold at one instant. What need hold
only at some other instant (`within_s`) claims nothing about this one. Where this says that something is
impossible it is; not all that is impossible is found.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import combinations, product
from typing import TypeAlias

from mauve_rt.supervision.claims import Claim, claims
from mauve_rt.supervision.when import ALL, ANY, AT_LEAST, NOT, When

_MOST_WAYS = 2_000

Way: TypeAlias = tuple[Claim, ...]  # claims, all of which hold


class _TooManyWaysError(Exception):
    """A tree with more ways to hold than anybody should go through."""


@dataclass(frozen=True)
class Clash:
    """Two claims that exclude each other; the same twice: one that excludes itself."""

    first: Claim
    second: Claim

    def __str__(self) -> str:
        if self.first == self.second:
            return f"{self.first} is nothing that there is"
        return f"{self.first} and {self.second} exclude each other"


def clash_in(tree: When) -> Clash | None:
    """Why the tree can never hold; None when it can, as far as can be told."""
    search = _Search()
    try:
        return search.clash if not search.ways(tree, negated=False) else None
    except _TooManyWaysError:
        return None


def can_meet(one: When, other: When) -> bool:
    """Whether both trees can hold at one instant, as far as can be told."""
    search = _Search()
    try:
        pairs = product(search.ways(one, negated=False), search.ways(other, negated=False))
        return any(_clash((*first, *second)) is None for first, second in pairs)
    except _TooManyWaysError:
        return True


class _Search:
    """The ways of a tree that are no contradiction in themselves, and the first that is one."""

    def __init__(self) -> None:
        self.clash: Clash | None = None

    def ways(self, tree: When, *, negated: bool) -> list[Way]:
        if negated and tree.for_s > 0:
            return [()]  # it may hold, but not for so long
        found = self._ways_now(tree, negated=negated)
        if tree.within_s > 0 and not negated:
            return [()] if found else []  # it held then
        return found

    def _ways_now(self, tree: When, *, negated: bool) -> list[Way]:
        if tree.kind == NOT:
            return self.ways(tree.parts[0], negated=not negated)
        if tree.kind in (ALL, ANY, AT_LEAST):
            return self._ways_of_parts(tree.parts, _needed(tree, negated=negated), negated=negated)
        return self._possible((each,) for each in claims(tree, negated=negated))

    def _ways_of_parts(self, parts: Sequence[When], needed: int, *, negated: bool) -> list[Way]:
        ways = [self.ways(part, negated=negated) for part in parts]
        found: list[Way] = []
        for chosen in combinations(ways, needed):
            for picked in product(*chosen):
                found += self._possible([tuple(each for way in picked for each in way)])
                if len(found) > _MOST_WAYS:
                    raise _TooManyWaysError
        return found

    def _possible(self, ways: Iterable[Way]) -> list[Way]:
        found = []
        for way in ways:
            clash = _clash(way)
            if clash is None:
                found.append(way)
            else:
                self.clash = self.clash or clash
        return found


def _needed(tree: When, *, negated: bool) -> int:
    """How many parts must hold; negated: how many must not."""
    total = len(tree.parts)
    least = {ALL: total, ANY: 1, AT_LEAST: tree.count}[tree.kind]
    return total - least + 1 if negated else least


def _clash(way: Way) -> Clash | None:
    pairs = ((one, other) for index, one in enumerate(way) for other in way[index:])
    return next((Clash(one, other) for one, other in pairs if one.excludes(other)), None)
