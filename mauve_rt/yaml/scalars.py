"""What a plain scalar of YAML 1.2 means: `on`, `yes` and dates are text, `010` is ten, `1e-3` is a number.

PyYAML alone reads YAML 1.1, in which these are true, true, dates, eight and text.
"""

import re
from typing import Any

_BOOLS = {"true": True, "True": True, "TRUE": True, "false": False, "False": False, "FALSE": False}
_NULLS = frozenset(("", "~", "null", "Null", "NULL"))
_NUMBER_BEGINS = frozenset("+-.0123456789")
# Digits may be set off with underscores, as in 1_000_000.
_WHOLE = re.compile(r"[-+]?(?:0b[01][01_]*|0o[0-7][0-7_]*|0x[0-9a-fA-F][0-9a-fA-F_]*|[0-9][0-9_]*)")
_REAL = re.compile(
    r"[-+]?(?:[0-9][0-9_]*\.[0-9_]*(?:[eE][-+]?[0-9]+)?|[0-9][0-9_]*[eE][-+]?[0-9]+"
    r"|\.[0-9][0-9_]*(?:[eE][-+]?[0-9]+)?|\.(?:inf|Inf|INF))|\.(?:nan|NaN|NAN)"
)
_BASES = {"0b": 2, "0o": 8, "0x": 16}
_MAX_DIGITS = 4000  # Python refuses to read 4300
_EXACT = 2**53  # below it a float holds every whole number
_TAG = "tag:yaml.org,2002:"


def plain_value(text: str) -> Any:
    """The value of a scalar without quotes and tag.

    Raises:
        ValueError: a whole number of too many digits; in words.
    """
    if text.isascii() and text.isdigit() and len(text) <= _MAX_DIGITS:
        return int(text)  # what most numbers are, the shortest way
    if may_be_number(text):
        if _WHOLE.fullmatch(text):
            return _whole(text)
        return _real(text) if _REAL.fullmatch(text) else text
    return None if text in _NULLS else _BOOLS.get(text, text)


def may_be_number(text: str) -> bool:
    """Whether text begins as numbers do."""
    return text[:1] in _NUMBER_BEGINS


def tagged_value(text: str, tag: str) -> Any:
    """The value of a scalar with a tag such as `!!str`.

    Raises:
        ValueError: an unknown tag, or text that it does not fit; in words.
    """
    kind = tag.removeprefix(_TAG)
    value = text if kind == "str" else plain_value(text)
    if kind == "float" and type(value) is int and abs(value) < _EXACT:
        value = float(value)
    if kind != {bool: "bool", int: "int", float: "float", str: "str"}.get(type(value), "null"):
        raise ValueError(f"the tag {_short(tag)} does not fit here")
    return value


def is_tag_of(tag: str | None, kind: str) -> bool:
    """Whether a collection may have that tag: none, or that of its kind, `map` or `seq`."""
    return tag in (None, "!", _TAG + kind)


def _short(tag: str) -> str:
    return f"!!{tag.removeprefix(_TAG)}" if tag.startswith(_TAG) else tag


def _whole(text: str) -> int:
    if len(text) > _MAX_DIGITS:
        raise ValueError("a number of too many digits")
    sign, digits = (-1 if text[0] == "-" else 1), text.lstrip("+-").replace("_", "")
    base = _BASES.get(digits[:2])
    return sign * (int(digits) if base is None else int(digits[2:], base))


def _real(text: str) -> float:
    digits = text.replace("_", "").lower()
    return float(digits.replace(".inf", "inf").replace(".nan", "nan"))
