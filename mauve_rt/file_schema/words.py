"""Small helpers for messages that people read."""

from collections.abc import Iterable

_SHORT = 60
_SHOWN_WORDS = 30


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """The remedy for an unknown word: the nearest known one, else those that are known."""
    names = sorted(set(known))
    if near := nearest(word, names):
        return f"did you mean {near}?"
    return f"known: {some(names)}" if names else "there are none"


def some(words: Iterable[str], limit: int = _SHOWN_WORDS) -> str:
    """`a, b, c`; of many the first ones and the number of the others."""
    names = list(words)
    more = len(names) - limit
    return ", ".join(names) if more <= 0 else f"{', '.join(names[:limit])} and {more:,} more"


def nearest(word: str, known: Iterable[str], *, likeness: float = 0.6) -> str:
    """The known word that is most like it; empty: none is, to a `likeness` of 0 to 1."""
    import difflib  # noqa: PLC0415 - only when something is wrong

    by_lower = {name.lower(): name for name in known}
    close = difflib.get_close_matches(word.lower(), by_lower, n=1, cutoff=likeness)
    return by_lower[close[0]] if close else ""


def shown(value: object, limit: int = _SHORT) -> str:
    """A value as the file has it, shortened: text in quotes, booleans as in YAML."""
    if isinstance(value, bool):
        text = str(value).lower()
    elif value is None:
        text = "nothing"
    elif isinstance(value, dict):
        text = "a mapping"
    elif isinstance(value, list):
        text = f"a list of {len(value)}"
    else:
        text = repr(value) if isinstance(value, str) else str(value)
    return cut(text, limit)


def cut(text: str, limit: int) -> str:
    """Text of at most so many characters."""
    return text if len(text) <= limit else text[: limit - 3] + "..."


def listed(words: Iterable[str], *, last: str = "or") -> str:
    """`a, b or c`."""
    items = list(words)
    return items[0] if len(items) == 1 else f"{', '.join(items[:-1])} {last} {items[-1]}" if items else ""
