"""counted(): one is singular, all other numbers plural."""

import pytest

from mauve_rt.counts import counted


@pytest.mark.parametrize(
    ("count", "words"), [(0, "0 steps"), (1, "1 step"), (2, "2 steps"), (2000, "2,000 steps")]
)
def test_a_count_in_words(count: int, words: str) -> None:
    assert counted(count, "step") == words


def test_an_irregular_plural_is_given() -> None:
    assert [counted(count, "entry", "entries") for count in (1, 2)] == ["1 entry", "2 entries"]
