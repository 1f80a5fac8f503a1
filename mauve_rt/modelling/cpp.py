"""How the code in C++ writes what a model says."""

import json
import re
from collections.abc import Iterator, Mapping

from mauve_rt.modelling.durations import Duration
from mauve_rt.modelling.package_model import PackageModel
from mauve_rt.modelling.schema import CppCall, CppType, PortModel, PropertyModel
from mauve_rt.modelling.type_names import NUMBERS, TypeName
from mauve_rt.parts.message_types import action_of

_INT64_MIN = -(2**63)


def snake(name: str) -> str:
    """`planned_guidance` of `PlannedGuidance`, as rosidl names its headers."""
    words = re.sub(r"(.)([A-Z][a-z]+)", r"\1_\2", name)
    return re.sub(r"([a-z0-9])([A-Z])", r"\1_\2", words).lower()


def text(value: str) -> str:
    """A literal of text."""
    return json.dumps(value, ensure_ascii=False)


def comment(value: str) -> str:
    """The rest of a line; a backslash at its end would take the next line in."""
    return value.rstrip("\\ ")


class CppNames:
    """Types of a model in C++, and the headers that they need."""

    def __init__(self, model: PackageModel) -> None:
        self._model = model

    def type(self, of: TypeName) -> str:
        """A type of a port, or of a value that is handed over."""
        item = NUMBERS.get(of.item) or self._item(of)
        if not of.is_list:
            return item
        return f"{'std::array' if of.is_fixed else 'mauve::BoundedVector'}<{item}, {of.count}>"

    def _item(self, of: TypeName) -> str:
        if of.item == "string":
            return f"mauve::BoundedString<{of.length}>"
        known = self._model.scope.types.get(of.item)
        if isinstance(known, CppType):
            return known.cpp
        if known is not None and not of.is_of_model:
            return of.item
        return struct(self._model.registered_type(of.item))

    def header(self, of: TypeName) -> Iterator[str]:
        """The header of a type; none of a number or text."""
        known = self._model.scope.types.get(of.item)
        if isinstance(known, CppType):
            yield known.include
        elif known is not None and not of.is_of_model:
            yield f"{self._model.package}/model/types.hpp"
        elif of.item != "string" and of.item not in NUMBERS:
            name = self._model.registered_type(of.item)
            yield interface_header(action_of(name) or name)

    def part(self, name: str) -> str:
        """The class of a shell or of an abstract core."""
        return f"::{name.replace('/', '::')}" if "/" in name else name

    def part_header(self, name: str) -> str:
        """The generated header of a shell or of an abstract core, as it is included."""
        package, _, own = self._model.registered(name).partition("/")
        path = f"{package}/model/{snake(own)}.hpp"
        return f"<{path}>" if "/" in name else f'"{path}"'

    def port(self, name: str, port: PortModel) -> str:
        """The declaration of a port."""
        optional = ".optional()" if port.optional else ""
        if port.frame or port.child_frame:
            frames = [port.frame or "", *([port.child_frame] if port.child_frame else [])]
            optional += f".in_frame({', '.join(map(text, frames))})"
        if port.call is not None:
            return f"{self._call(name, port.call)};"
        if port.read_type is not None:
            of = self.type(port.read_type)
            return f"mauve::ReadPort<{of}>& {name} = read_port<{of}>({text(name)}){optional};"
        if port.write is not None:
            of = self.type(port.write)
            policies = {"on_commit": port.on_commit, "on_stop": port.on_stop}
            given = [f".{key} = mauve::OutputPolicy::{policy}" for key, policy in policies.items() if policy]
            output = f", {{{', '.join(given)}}}" if given else ""
            return f"mauve::WritePort<{of}>& {name} = write_port<{of}>({text(name)}{output}){optional};"
        return f"mauve::EventPort& {name} = event_port({text(name)}){optional};"

    @staticmethod
    def _call(name: str, call: str | CppCall) -> str:
        if isinstance(call, CppCall):
            words = f"{text(name)}, {text(call.name)}"
            return f"mauve::CallPort<{call.cpp}>& {name} = call_port<{call.cpp}>({words})"
        of = struct(call)
        return f"mauve::CallPort<mauve::CallOf<{of}>>& {name} = call_port<{of}>({text(name)})"

    def shell_headers(self, ports: Mapping[str, PortModel]) -> list[str]:
        """What the declarations of ports need."""
        found: set[str] = set()
        for port in ports.values():
            if isinstance(port.call, CppCall):
                found.add(port.call.include)
            elif port.call is not None:
                found.add(interface_header(port.call))
            elif port.data_type is not None:
                found.update(self.header(port.data_type))
        return sorted(found)


def struct(name: str) -> str:
    """The struct of an interface, or of a part of an action."""
    if action := action_of(name):
        return f"{struct(action)}::{name.removeprefix(f'{action}_')}"
    package, _, interface = name.split("/")
    return f"mauve::msg::{package}::{interface}"


def interface_header(name: str) -> str:
    """The header that mauve_generate_types() writes for an interface."""
    package, kind, interface = name.split("/")
    return f"mauve_types/{package}/{kind}/{snake(interface)}.hpp"


def property_declaration(name: str, one: PropertyModel) -> str:
    """The declaration of a property."""
    types = {"bool": "bool", "int64": "std::int64_t", "float64": "double", "string": "std::string"}
    return (
        f"mauve::Property<{types[one.type]}>& {name} = property({text(name)}, {_value(one)}{_options(one)});"
    )


def _value(one: PropertyModel) -> str:
    value = one.default
    if one.type == "string":
        return text(str(value))
    if one.type == "bool":
        return str(value).lower()
    if one.type == "float64":
        return repr(float(value))
    return "INT64_MIN" if value == _INT64_MIN else f"std::int64_t{{{value}}}"


def _options(one: PropertyModel) -> str:
    read_by = " | ".join(f"mauve::ReadBy::{part}" for part in one.read_by)
    options = {
        "unit": text(one.unit) if one.unit else "",
        "description": text(one.description) if one.description else "",
        "minimum": "" if one.minimum is None else repr(one.minimum),
        "maximum": "" if one.maximum is None else repr(one.maximum),
        "structural": read_by,
    }
    given = [f".{key} = {value}" for key, value in options.items() if value]
    return f", {{{', '.join(given)}}}" if given else ""


def duration(one: Duration) -> str:
    """A length of time, as fsms take it."""
    if one.property_name:
        return f"mauve::times({one.factor}, shell().{one.property_name})"
    return "mauve::kForever" if one.is_forever else f"mauve::time_ns_t{{{one.ns}}}"
