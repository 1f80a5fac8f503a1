"""What a value of a file may be, and what is wrong with one that is not.

Nothing is converted: `1` and true are no text, "1" and true no number. A whole number is a number, too.
A kind is a value with its bounds, so that whoever needs the bounds of a setting finds them in it.
"""

import math
import re
import sys
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any

from mauve_rt.file_schema.json_schema import Definitions, JsonSchema, text_form
from mauve_rt.file_schema.words import listed
from mauve_rt.file_schema.yaml_file import Location


class Fault:
    """One thing wrong with a value. What it says in words is for who knows what the file is."""

    __slots__ = ("found", "hint", "known", "limit", "place", "what")

    def __init__(
        self, place: Location, what: str, *, limit: Any = None, found: Any = None, known: tuple[str, ...] = ()
    ) -> None:
        self.place = place
        # "unknown", "missing" (a key); "name" (a bad one); of a resource "foreign" (a key that its kind,
        # `limit`, does not have) and "lacks" (one that it needs); else what the value should be
        self.what = what
        self.limit = limit  # of "more", "least", "most", "few", "many"; text of "form", "rule" and "choice"
        self.found = found
        self.known = known  # keys, where one is unknown; kinds that have a foreign one; values of a choice
        self.hint = ""


Faults = list[Fault]


class Kind(ABC):
    """What a value may be."""

    @abstractmethod
    def read(self, value: Any, place: Location, faults: Faults) -> Any:
        """The value as the program takes it; what is wrong is added to `faults`."""

    @abstractmethod
    def json_schema(self, definitions: Definitions) -> JsonSchema:
        """The values that read() takes, as JSON Schema; parts with names go to `definitions`."""


class Flag(Kind):
    """True or false."""

    def read(self, value: Any, place: Location, faults: Faults) -> Any:
        """As Kind."""
        if not isinstance(value, bool):
            faults.append(Fault(place, "flag", found=value))
        return value

    def json_schema(self, definitions: Definitions) -> JsonSchema:  # noqa: ARG002
        """As Kind."""
        return {"type": "boolean"}


class Whole(Kind):
    """A whole number."""

    def __init__(self, least: int, most: int) -> None:
        self.least, self.most = least, most

    def read(self, value: Any, place: Location, faults: Faults) -> Any:
        """As Kind."""
        if not isinstance(value, int) or isinstance(value, bool):
            faults.append(Fault(place, "whole", found=value))
        elif value < self.least:
            faults.append(Fault(place, "least", limit=self.least, found=value))
        elif value > self.most:
            faults.append(Fault(place, "most", limit=self.most, found=value))
        return value

    def json_schema(self, definitions: Definitions) -> JsonSchema:  # noqa: ARG002
        """As Kind."""
        return {"type": "integer", "minimum": self.least, "maximum": self.most}


_LARGEST = sys.float_info.max


class Real(Kind):
    """A finite number: `least` or more, or more than `above`, and no more than `most`."""

    def __init__(self, *, least: float = -math.inf, above: float = -math.inf, most: float = math.inf) -> None:
        self.least, self.above, self.most = least, above, most

    def read(self, value: Any, place: Location, faults: Faults) -> Any:
        """As Kind."""
        if not isinstance(value, int | float) or isinstance(value, bool):
            faults.append(Fault(place, "number", found=value))
        elif not abs(value) <= _LARGEST:  # nor is that true of NaN
            faults.append(Fault(place, "finite", found=value))
        elif value < self.least:
            faults.append(Fault(place, "least", limit=self.least, found=value))
        elif value <= self.above:
            faults.append(Fault(place, "more", limit=self.above, found=value))
        elif value > self.most:
            faults.append(Fault(place, "most", limit=self.most, found=value))
        else:
            return float(value)
        return value

    def json_schema(self, definitions: Definitions) -> JsonSchema:  # noqa: ARG002
        """As Kind."""
        is_open = self.above > -math.inf
        low = {"exclusiveMinimum": self.above} if is_open else {"minimum": max(self.least, -_LARGEST)}
        return {"type": "number", **low, "maximum": min(self.most, _LARGEST)}


class Text(Kind):
    """Text, of a form where `pattern` says one; `expected` is the form in words. `made` makes it uniform."""

    def __init__(
        self, pattern: str = "", expected: str = "", *, without: str = "", made: Callable[[str], str] = str
    ) -> None:
        self.pattern, self.expected, self.without, self.made = pattern, expected, without, made

    def read(self, value: Any, place: Location, faults: Faults) -> Any:
        """As Kind."""
        if not isinstance(value, str):
            faults.append(Fault(place, "text", found=value))
        elif not self.fits(value):
            faults.append(Fault(place, "form", limit=self.expected, found=value))
        else:
            return self.made(value)
        return value

    def fits(self, value: str) -> bool:
        """Whether text has the form."""
        if self.without and self.without in value:
            return False
        return not self.pattern or re.fullmatch(self.pattern, value, re.ASCII) is not None

    def json_schema(self, definitions: Definitions) -> JsonSchema:  # noqa: ARG002
        """As Kind."""
        return {"type": "string", **self.json_form()}

    def json_form(self) -> JsonSchema:
        """The form of the text alone, as JSON Schema."""
        return text_form(self.pattern, without=self.without, expected=self.expected) if self.pattern else {}


class Choice(Kind):
    """One of a few words or numbers."""

    def __init__(self, *values: str | int) -> None:
        self.values = values

    def read(self, value: Any, place: Location, faults: Faults) -> Any:
        """As Kind."""
        if not any(type(value) is type(each) and value == each for each in self.values):
            words = tuple(map(str, self.values))
            faults.append(Fault(place, "choice", limit=listed(words), found=value, known=words))
        return value

    def json_schema(self, definitions: Definitions) -> JsonSchema:  # noqa: ARG002
        """As Kind."""
        return {"enum": [*self.values]}


class Scalar(Kind):
    """True, false, a number or text."""

    def read(self, value: Any, place: Location, faults: Faults) -> Any:
        """As Kind."""
        if not isinstance(value, bool | int | float | str):
            faults.append(Fault(place, "form", limit="true, false, a number or text", found=value))
        return value

    def json_schema(self, definitions: Definitions) -> JsonSchema:  # noqa: ARG002
        """As Kind."""
        return {"type": ["boolean", "number", "string"]}


class ListOf(Kind):
    """A list, with at least `few` and at most `many` elements."""

    def __init__(self, kind: Kind, *, few: int = 0, many: int | None = None) -> None:
        self.kind, self.few, self.many = kind, few, many

    def read(self, value: Any, place: Location, faults: Faults) -> Any:
        """As Kind."""
        if not isinstance(value, list):
            faults.append(Fault(place, "list", found=value))
            return value
        if len(value) < self.few:
            faults.append(Fault(place, "few", limit=self.few, found=value))
        if self.many is not None and len(value) > self.many:
            faults.append(Fault(place, "many", limit=self.many, found=value))
        return [self.kind.read(each, (*place, index), faults) for index, each in enumerate(value)]

    def json_schema(self, definitions: Definitions) -> JsonSchema:
        """As Kind."""
        most = {} if self.many is None else {"maxItems": self.many}
        least = {"minItems": self.few} if self.few else {}
        return {"type": "array", "items": self.kind.json_schema(definitions), **least, **most}


class TableOf(Kind):
    """A mapping of names that are no keys of ours, with at least `few` of them."""

    def __init__(self, kind: Kind, *, names: Text | None = None, few: int = 0) -> None:
        self.kind, self.names, self.few = kind, names or Text(), few

    def read(self, value: Any, place: Location, faults: Faults) -> Any:
        """As Kind."""
        if not isinstance(value, dict):
            faults.append(Fault(place, "mapping", found=value))
            return value
        if len(value) < self.few:
            faults.append(Fault(place, "few", limit=self.few, found=value))
        for name in value:
            if not self.names.fits(name):
                faults.append(Fault((*place, name), "name", limit=self.names.expected, found=name))
        return {name: self.kind.read(each, (*place, name), faults) for name, each in value.items()}

    def json_schema(self, definitions: Definitions) -> JsonSchema:
        """As Kind."""
        least = {"minProperties": self.few} if self.few else {}
        names = {"propertyNames": form} if (form := self.names.json_form()) else {}
        return {
            "type": "object",
            "additionalProperties": self.kind.json_schema(definitions),
            **names,
            **least,
        }
