"""Sections of a file as classes: a table of settings, each one value with its bounds.

    class SenderModel(Section):
        priority: int = setting(Whole(1, 98), "priority of the thread", default=1, hint="1 is the lowest")
        cpus: list[int] | None = setting(ListOf(Whole(0, 65535), few=1), "allowed CPUs", default=None)

The text after the kind is the description of the key in the reference documentation.

Objects are immutable and compare by value. A setting whose default is None takes `null` in a file as well.
"""

from collections.abc import Mapping
from typing import Any, ClassVar, Self, dataclass_transform

from mauve_rt.file_schema.json_schema import (
    Definitions,
    JsonSchema,
    defined,
    document,
    first_sentence,
    mapping,
    or_null,
)
from mauve_rt.file_schema.kinds import Fault, Faults, Kind
from mauve_rt.file_schema.setting_words import described, unit_of
from mauve_rt.file_schema.yaml_file import Location

_REQUIRED = object()


class Setting:
    """The allowed values of a key, its description, its default, and a hint for a wrong value."""

    def __init__(self, kind: Kind, what: str, *, default: Any, hint: str, key: str = "") -> None:
        self.kind, self.what, self.default, self.hint = kind, what, default, hint
        self.key = key  # in a file, where that is no name in Python; empty: as the attribute
        self.attribute = ""  # set by the section

    @property
    def is_required(self) -> bool:
        """Whether there is no default."""
        return self.default is _REQUIRED

    def initial(self) -> Any:
        """The default, of its own for everybody."""
        return self.default.copy() if isinstance(self.default, list | dict) else self.default

    def read(self, value: Any, place: Location, faults: Faults) -> Any:
        """The value of the key; what is wrong is added to `faults`."""
        if value is None and self.default is None:
            return None
        before = len(faults)
        read = self.kind.read(value, place, faults)
        for fault in faults[before:]:
            if len(fault.place) <= len(place) + 1:  # of the value or of an element of it
                fault.hint = fault.hint or self.hint
        return read

    def json_schema(self, definitions: Definitions, *, unit: str) -> JsonSchema:
        """The values that read() takes, as JSON Schema, and in words what the key is for."""
        schema = self.kind.json_schema(definitions)
        if self.default is None:
            schema = or_null(schema)
        elif not self.is_required and self.default != "":
            schema = {**schema, "default": _plain(self.default)}
        return {**schema, "description": described(self.what, self.kind, unit, schema.get("default"))}


def setting(kind: Kind, what: str, *, default: Any = _REQUIRED, hint: str = "", key: str = "") -> Any:
    """A setting that `what` describes; `key` is its key in a file, where that is no name in Python."""
    return Setting(kind, what, default=default, hint=hint, key=key)


@dataclass_transform(kw_only_default=True, frozen_default=True, field_specifiers=(setting,))
class Section:
    """A mapping of known keys."""

    settings: ClassVar[Mapping[str, Setting]] = {}
    given: frozenset[str]  # the settings that do not have their value by default

    def __init_subclass__(cls) -> None:
        own = {name: each for name, each in vars(cls).items() if isinstance(each, Setting)}
        for name, each in own.items():
            each.attribute = name
            delattr(cls, name)
        cls.settings = {**cls.settings, **{each.key or name: each for name, each in own.items()}}

    def __init__(self, **values: Any) -> None:
        """From values as a file has them, or as the program does.

        Raises:
            ValueError: one of them is not what its setting takes.
        """
        faults: Faults = []
        self._take(values, (), faults)
        if faults:
            wrong = ", ".join(".".join(map(str, fault.place)) or fault.what for fault in faults)
            raise ValueError(f"bad {type(self).__name__}: {wrong}")

    @classmethod
    def read(cls, value: Any, place: Location, faults: Faults) -> Self:
        """From a part of a file; what is wrong is added to `faults`, and makes the result useless."""
        section = cls.__new__(cls)
        if isinstance(value, dict):
            section._take(value, place, faults)  # noqa: SLF001 - of this class
        else:
            faults.append(Fault(place, "mapping", found=value))
        return section

    def misfit(self) -> Fault | None:
        """What is wrong where settings, each good by itself, do not fit each other; mostly nothing."""
        return None

    @classmethod
    def json_schema(cls, definitions: Definitions) -> JsonSchema:
        """A reference to its definition, which is added to `definitions`."""
        return defined(cls.__name__.lstrip("_"), definitions, cls.json_definition)

    @classmethod
    def json_document(cls, name: str) -> JsonSchema:
        """The JSON Schema of a file that has this section at its top."""
        definitions: Definitions = {}
        return document(cls.json_definition(definitions), definitions, name=name)

    @classmethod
    def json_definition(cls, definitions: Definitions) -> JsonSchema:
        """The mappings that read() takes, as JSON Schema."""
        known = cls.settings
        keys = {key: each.json_schema(definitions, unit=unit_of(key)) for key, each in known.items()}
        required = [key for key, each in known.items() if each.is_required]
        schema = mapping(keys, required=required, description=first_sentence(cls.__doc__))
        return {**schema, **cls.json_rules(definitions)}

    @classmethod
    def json_rules(cls, definitions: Definitions) -> JsonSchema:  # noqa: ARG003
        """What misfit() demands, as far as JSON Schema can say it."""
        return {}

    def changed(self, **values: Any) -> Self:
        """The same, but with these settings."""
        return type(self)(**{**{key: self._value(key) for key in self.given}, **values})

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"a {type(self).__name__} does not change: {name}")

    def __eq__(self, other: object) -> bool:
        names = [each.attribute for each in self.settings.values()]
        same = type(other) is type(self)
        return same and all(getattr(self, name) == getattr(other, name) for name in names)

    __hash__ = None  # type: ignore[assignment] # there are lists in it

    def __repr__(self) -> str:
        values = ", ".join(f"{key}={self._value(key)!r}" for key in self.settings if key in self.given)
        return f"{type(self).__name__}({values})"

    def _value(self, key: str) -> Any:
        return getattr(self, self.settings[key].attribute)

    def _take(self, values: Mapping[str, Any], place: Location, faults: Faults) -> None:
        before = len(faults)
        known = self.settings
        mine = vars(self)
        mine["given"] = frozenset(key for key in known if key in values)
        for key, each in known.items():
            if key in values:
                mine[each.attribute] = each.read(values[key], (*place, key), faults)
            elif each.is_required:
                faults.append(Fault(place, "missing", limit=key))
            else:
                mine[each.attribute] = each.initial()
        for key in values:
            if key not in known:
                faults.append(Fault((*place, key), "unknown", known=tuple(known)))
        if len(faults) == before and (misfit := self.misfit()):
            found = values if misfit.found is None else misfit.found
            inside = (*place, *misfit.place)
            faults.append(Fault(inside, misfit.what, limit=misfit.limit, found=found, known=misfit.known))
            faults[-1].hint = misfit.hint


class Part(Kind):
    """A section within a section."""

    def __init__(self, section: type[Section]) -> None:
        self.section = section

    def read(self, value: Any, place: Location, faults: Faults) -> Any:
        """As Kind."""
        return value if isinstance(value, self.section) else self.section.read(value, place, faults)

    def json_schema(self, definitions: Definitions) -> JsonSchema:
        """As Kind."""
        return self.section.json_schema(definitions)


def _plain(default: Any) -> Any:
    """A default as a file has it."""
    if isinstance(default, Section):
        return {key: _plain(getattr(default, default.settings[key].attribute)) for key in default.given}
    return default
