"""Write C++ structs for ROS interfaces, as CMake's mauve_generate_types() asks for them.

    mauve_generate_types.py --target NAME --output FOLDER --prefixes FOLDER... [--package NAME FOLDER...] --interfaces NAME...

An interface is PACKAGE/msg/NAME, PACKAGE/srv/NAME, PACKAGE/action/NAME, or PACKAGE for all that the package has. Nested messages
are written, too. Prints the .idl files that were read. Writes only files that change.
"""

import argparse
import hashlib
import json
import re
import sys
from ast import literal_eval
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path
from typing import Any

KINDS = ("msg", "srv", "action")
UNBOUNDED_TEXT = (
    255  # characters; a string in place needs a bound, and a name or a path has this one on Linux
)
BASIC_TYPES = {
    "boolean": "bool",
    "octet": "std::uint8_t",
    "float": "float",
    "double": "double",
    "short": "std::int16_t",
    "unsigned short": "std::uint16_t",
    "long": "std::int32_t",
    "unsigned long": "std::uint32_t",
    "long long": "std::int64_t",
    "unsigned long long": "std::uint64_t",
} | {f"{sign}int{bits}": f"std::{sign}int{bits}_t" for sign in ("", "u") for bits in (8, 16, 32, 64)}
KEYWORDS = set(
    [
        "alignas",
        "alignof",
        "and",
        "and_eq",
        "asm",
        "auto",
        "bitand",
        "bitor",
        "bool",
        "break",
        "case",
        "catch",
        "char",
        "char8_t",
        "char16_t",
        "char32_t",
        "class",
        "co_await",
        "co_return",
        "co_yield",
        "compl",
        "concept",
        "const",
        "const_cast",
        "consteval",
        "constexpr",
        "constinit",
        "continue",
        "decltype",
        "default",
        "delete",
        "do",
        "double",
        "dynamic_cast",
        "else",
        "enum",
        "explicit",
        "export",
        "extern",
        "false",
        "float",
        "for",
        "friend",
        "goto",
        "if",
        "inline",
        "int",
        "long",
        "mutable",
        "namespace",
        "new",
        "noexcept",
        "not",
        "not_eq",
        "nullptr",
        "operator",
        "or",
        "or_eq",
        "private",
        "protected",
        "public",
        "register",
        "reinterpret_cast",
        "requires",
        "return",
        "short",
        "signed",
        "sizeof",
        "static",
        "static_assert",
        "static_cast",
        "struct",
        "switch",
        "template",
        "this",
        "thread_local",
        "throw",
        "true",
        "try",
        "typedef",
        "typeid",
        "typename",
        "union",
        "unsigned",
        "using",
        "virtual",
        "void",
        "volatile",
        "wchar_t",
        "while",
        "xor",
        "xor_eq",
    ]
)


class Refusal(Exception):  # noqa: N818 - it is no fault of the program's
    """Why an interface has no struct, in a sentence."""


@dataclass(frozen=True, order=True)
class Interface:
    """The name of a message, a service or an action."""

    package: str
    kind: str
    name: str

    def __str__(self) -> str:
        return f"{self.package}/{self.kind}/{self.name}"

    @property
    def header(self) -> str:
        words = re.sub(r"(.)([A-Z][a-z]+)", r"\1_\2", self.name)  # as rosidl names its headers
        words = re.sub(r"([a-z0-9])([A-Z])", r"\1_\2", words).lower()
        return f"mauve_types/{self.package}/{self.kind}/{words}.hpp"


class Installed:
    """The .idl files of prefixes, and of the package that is being built."""

    def __init__(self, prefixes: Sequence[Path], package: str, folders: Sequence[Path]) -> None:
        self._prefixes = prefixes
        self._package = package
        self._folders = folders

    def packages(self) -> set[str]:
        index = "share/ament_index/resource_index/rosidl_interfaces"
        return {path.name for prefix in self._prefixes for path in (prefix / index).glob("*")}

    def of_package(self, package: str) -> dict[Interface, Path]:
        """Each interface of a package, with the folder that has msg/NAME.idl."""
        own = self._folders if package == self._package else ()
        found: dict[Interface, Path] = {}
        for folder in (*own, *(prefix / "share" / package for prefix in self._prefixes)):
            for kind in KINDS:
                for path in sorted((folder / kind).glob("*.idl")):
                    found.setdefault(Interface(package, kind, path.stem), folder)
        return found

    def named(self, name: str) -> list[Interface]:
        """What a word of the call stands for."""
        package, *rest = name.split("/")
        interfaces = self.of_package(package)
        if not interfaces:
            raise Refusal(
                f"no installed package {package} with interfaces{near(package, self.packages())}. "
                "Install the package, or source the workspace that has it, and name it in package.xml."
            )
        if not rest:
            return list(interfaces)
        if len(rest) != 2 or Interface(package, *rest) not in interfaces:
            raise Refusal(
                f"expected an interface of {package} such as {next(iter(interfaces))}, "
                f"found {name}{near(name, map(str, interfaces))}."
            )
        return [Interface(package, *rest)]


def near(word: str, words: Any) -> str:
    close = get_close_matches(word, sorted(words), cutoff=0.7)
    return f" (there is {', '.join(close)})" if close else ""


def cpp_name(namespaced: Sequence[str]) -> str:
    """std_srvs, srv, SetBool_Request: mauve::msg::std_srvs::SetBool::Request."""
    package, _, name = namespaced
    return f"mauve::msg::{package}::{name.replace('_', '::')}"


@dataclass
class Writer:
    """Writes the header of one interface."""

    interface: Interface
    needs: set[Interface] = field(default_factory=set)  # of which it has fields

    def refuse(self, name: str, found: str, remedy: str) -> Refusal:
        return Refusal(f"{self.interface}, field '{name}': {found}. {remedy}")

    # ---- types and values -------------------------------------------------------------------------------------------

    def type_of(self, name: str, idl: Any) -> str:
        """In C++."""
        from rosidl_parser import definition as d  # noqa: PLC0415 - loading it takes 0.2 s, for nothing when all is up to date

        if isinstance(idl, d.Array):
            return f"std::array<{self.type_of(name, idl.value_type)}, {idl.size}>"
        if isinstance(idl, d.BoundedSequence):
            return f"::mauve::BoundedVector<{self.type_of(name, idl.value_type)}, {idl.maximum_size}>"
        if isinstance(idl, d.UnboundedSequence):
            return f"::mauve::Sequence<{self.type_of(name, idl.value_type)}>"
        if isinstance(idl, d.AbstractString):
            return f"::mauve::BoundedString<{text_capacity(idl)}>"
        if isinstance(idl, d.NamespacedType):
            package, kind, message = idl.namespaced_name()
            self.needs.add(Interface(package, kind, message.partition("_")[0]))
            return f"::{cpp_name(idl.namespaced_name())}"
        typename = "wstring" if isinstance(idl, d.AbstractWString) else idl.typename
        if typename not in BASIC_TYPES:
            raise self.refuse(
                name,
                f"type {typename} has no C++ struct",
                "Use a number of up to 64 bits or a string, or exchange the message in Python.",
            )
        return BASIC_TYPES[typename]

    def value_of(self, name: str, idl: Any, value: Any) -> str:
        """In C++."""
        from rosidl_parser import definition as d  # noqa: PLC0415

        if isinstance(idl, d.AbstractNestedType):
            values = literal_eval(value) if isinstance(value, str) else value
            items = ", ".join(self.value_of(name, idl.value_type, each) for each in values)
            if isinstance(idl, d.Array):
                return f"{{{items}}}"
            if isinstance(idl, d.UnboundedSequence):
                raise self.refuse(
                    name,
                    f"default {value}, but a sequence without a bound comes empty, as its memory comes later",
                    "Remove the default or bound the sequence.",
                )
            item = self.type_of(name, idl.value_type)
            fill = (
                f"for (const {item}& item : std::initializer_list<{item}>{{{items}}}) items.push_back(item);"
            )
            return f"[] {{ {self.type_of(name, idl)} items; {fill} return items; }}()"
        if isinstance(idl, d.AbstractString):
            if len(value.encode()) > text_capacity(idl):
                raise self.refuse(
                    name,
                    f"default of {len(value.encode())} characters, expected at most {text_capacity(idl)}",
                    "Shorten it.",
                )
            return cpp_text(value)
        if idl.typename == "boolean":
            return "true" if value else "false"
        if idl.typename in ("float", "double"):
            return repr(float(value)) + ("F" if idl.typename == "float" else "")
        if value == -(2**63):
            return "-9223372036854775807 - 1"
        return f"{value}U" if BASIC_TYPES[idl.typename].startswith("std::u") else str(value)

    # ---- declarations -----------------------------------------------------------------------------------------------

    def constant(self, constant: Any) -> Iterator[str]:
        from rosidl_parser import definition as d  # noqa: PLC0415

        yield from comment(constant)
        if isinstance(constant.type, d.AbstractGenericString):
            if isinstance(constant.type, d.AbstractWString):
                raise self.refuse(constant.name, "constants of type wstring have no C++ form", "Use string.")
            yield f"static constexpr std::string_view {constant.name} = {cpp_text(constant.value)};"
        else:
            value = self.value_of(constant.name, constant.type, constant.value)
            yield f"static constexpr {self.type_of(constant.name, constant.type)} {constant.name} = {value};"

    def member(self, member: Any) -> Iterator[str]:
        from rosidl_parser import definition as d  # noqa: PLC0415

        yield from comment(member)
        initial = ""
        if member.has_annotation("default"):
            value = member.get_annotation_value("default")["value"]
            initial = self.value_of(member.name, member.type, value)
            initial = initial if initial.startswith("{") else f"{{{initial}}}"
        elif not isinstance(member.type, (d.NamespacedType, d.AbstractGenericString, d.AbstractSequence)):
            initial = "{}"
        yield f"{self.type_of(member.name, member.type)} {member_name(member)}{initial};"

    def message(self, message: Any, name: str) -> Iterator[str]:
        """A struct of this name."""
        yield from comment(message.structure)
        yield f"struct {name} {{"
        for constant in message.constants:
            yield from indented(self.constant(constant))
        for member in members(message):
            yield from indented(self.member(member))
        yield "};"

    def traits(self, message: Any) -> Iterator[str]:
        name = message.structure.namespaced_type.namespaced_name()
        fields = "".join(f", {member_name(member)}" for member in members(message))
        yield f'MAUVE_TYPE({cpp_name(name)}, "{"/".join(name)}"{fields})'

    def service(self, service: Any, name: str) -> Iterator[str]:
        yield f"struct {name} {{"
        yield from indented(self.message(service.request_message, "Request"))
        yield from indented(self.message(service.response_message, "Response"))
        yield "};"

    def service_traits(self, service: Any) -> Iterator[str]:
        yield from self.traits(service.request_message)
        yield from self.traits(service.response_message)
        name = service.namespaced_type.namespaced_name()
        yield f'MAUVE_CALL_TYPE({cpp_name(name)}, "{"/".join(name)}")'

    def action(self, action: Any, name: str) -> Iterator[str]:
        yield f"struct {name} {{"
        for part in ("goal", "result", "feedback"):
            yield from indented(self.message(getattr(action, part), part.capitalize()))
        yield from indented(self.service(action.send_goal_service, "SendGoal"))
        yield from indented(self.service(action.get_result_service, "GetResult"))
        yield from indented(self.message(action.feedback_message, "FeedbackMessage"))
        yield "};"

    def action_traits(self, action: Any) -> Iterator[str]:
        for part in ("goal", "result", "feedback"):
            yield from self.traits(getattr(action, part))
        yield from self.service_traits(action.send_goal_service)
        yield from self.service_traits(action.get_result_service)
        yield from self.traits(action.feedback_message)

    def write(self, content: Any) -> str:
        """The header, of a parsed .idl file."""
        from rosidl_parser import definition as d  # noqa: PLC0415

        kind, declare, describe = {
            "msg": (d.Message, self.message, self.traits),
            "srv": (d.Service, self.service, self.service_traits),
            "action": (d.Action, self.action, self.action_traits),
        }[self.interface.kind]
        [element] = content.get_elements_of_type(kind)
        declared = list(declare(element, self.interface.name))
        guard = re.sub(r"\W", "_", self.interface.header).upper()
        others = sorted(need.header for need in self.needs - {self.interface})
        call = ["#include <mauve_rt/data/call_type.hpp>"] if self.interface.kind != "msg" else []
        return "\n".join(
            [
                f"// Written by mauve_generate_types() from {self.interface}: change the interface, not this file.",
                f"#ifndef {guard}  // not `pragma once`: two packages may each have written this header",
                f"#define {guard}",
                "",
                "#include <array>",
                "#include <cstdint>",
                "#include <initializer_list>",
                "#include <string_view>",
                "",
                *call,
                "#include <mauve_rt/data/cdr.hpp>",
                *(f"#include <{header}>" for header in others),
                "",
                f"namespace mauve::msg::{self.interface.package} {{",
                "",
                *declared,
                "",
                f"}}  // namespace mauve::msg::{self.interface.package}",
                "",
                *describe(element),
                "",
                "#endif",
                "",
            ]
        )


def text_capacity(idl: Any) -> int:
    return int(idl.maximum_size) if idl.has_maximum_size() else UNBOUNDED_TEXT


def cpp_text(text: str) -> str:
    """A literal: what is not printable ASCII in octal, whose length is fixed."""
    bytes_ = text.encode()
    return '"' + "".join(chr(b) if 32 <= b < 127 and b not in b'"\\?' else f"\\{b:03o}" for b in bytes_) + '"'


def members(message: Any) -> list[Any]:
    from rosidl_parser.definition import EMPTY_STRUCTURE_REQUIRED_MEMBER_NAME  # noqa: PLC0415

    return [each for each in message.structure.members if each.name != EMPTY_STRUCTURE_REQUIRED_MEMBER_NAME]


def member_name(member: Any) -> str:
    return f"{member.name}_" if member.name in KEYWORDS else member.name


def comment(annotated: Any) -> Iterator[str]:
    """Lines of the interface, with the unit that rosidl takes out of them."""
    lines = annotated.get_comment_lines()
    if annotated.has_annotation("unit"):
        lines.append(f"[{annotated.get_annotation_value('unit')['value']}]")
    for line in lines:
        text = f"/// {line}".rstrip()
        yield text + "." if text.endswith("\\") else text  # else the next line would belong to the comment


def indented(lines: Iterator[str]) -> Iterator[str]:
    return (f"  {line}" for line in lines)


def generate(installed: Installed, interfaces: Sequence[Interface]) -> tuple[dict[str, str], list[Path]]:
    """Headers by their names, and the files that were read."""
    from rosidl_parser.definition import IdlLocator  # noqa: PLC0415
    from rosidl_parser.parser import parse_idl_file  # noqa: PLC0415

    pending = list(interfaces)
    headers: dict[str, str] = {}
    structs: dict[str, Interface] = {}
    read: list[Path] = []
    while pending:
        interface = pending.pop()
        if interface.header in headers:
            continue
        struct = f"mauve::msg::{interface.package}::{interface.name}"
        if structs.setdefault(struct, interface) != interface:
            raise Refusal(
                f"{structs[struct]} and {interface} would both be {struct}. Generate them into two libraries."
            )
        installed.named(str(interface))  # that of a nested message may be missing
        relative = Path(interface.kind) / f"{interface.name}.idl"
        folder = installed.of_package(interface.package)[interface]
        writer = Writer(interface)
        headers[interface.header] = writer.write(parse_idl_file(IdlLocator(folder, relative)).content)
        read.append(folder / relative)
        pending += writer.needs
    return headers, read


def digest_of(words: Sequence[str], files: Sequence[Path]) -> str:
    digest = hashlib.sha256("\0".join(words).encode())
    for path in (Path(__file__), *files):
        digest.update(path.read_bytes() if path.is_file() else b"")
    return digest.hexdigest()


def update(installed: Installed, target: str, output: Path, names: Sequence[str]) -> list[Path]:
    """Write the headers unless all that they are made of is as it was; the files that were read."""
    interfaces = [interface for name in names for interface in installed.named(name)]
    words = [*sys.argv, *map(str, interfaces)]
    stamp = output.parent / f"{target}.json"
    before = (
        json.loads(stamp.read_text("utf-8")) if stamp.is_file() else {"read": [], "written": [], "digest": ""}
    )
    read = [Path(path) for path in before["read"]]
    if before["digest"] == digest_of(words, read) and all(
        (output / header).is_file() for header in before["written"]
    ):
        return read
    headers, read = generate(installed, interfaces)
    for header, text in headers.items():
        path = output / header
        if not path.is_file() or path.read_text("utf-8") != text:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
    state = {"read": [str(path) for path in read], "written": list(headers), "digest": digest_of(words, read)}
    stamp.write_text(json.dumps(state), encoding="utf-8")
    return read


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--target", required=True)
    parser.add_argument("--output", type=Path, required=True)
    parser.add_argument("--prefixes", nargs="*", type=Path, default=[])
    parser.add_argument("--package", nargs="*", default=[""])
    parser.add_argument("--interfaces", nargs="+", required=True)
    given = parser.parse_args()

    package, *folders = given.package
    installed = Installed(given.prefixes, package, [Path(folder) for folder in folders])
    try:
        read = update(installed, given.target, given.output, given.interfaces)
    except Refusal as refusal:
        print(refusal, file=sys.stderr)
        return 1
    except ImportError as error:
        print(
            f"{sys.executable} cannot read interfaces ({error}). Source ROS, or set Python3_EXECUTABLE.",
            file=sys.stderr,
        )
        return 1
    print("\n".join(map(str, read)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
