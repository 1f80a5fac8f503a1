"""Write C++ structs for ROS interfaces, as CMake's mauve_generate_types() asks for them.

    mauve_generate_types.py --target NAME --output FOLDER --prefixes FOLDER...
                            [--package NAME FOLDER...]... --interfaces NAME...

An interface is PACKAGE/msg/NAME, PACKAGE/srv/NAME, PACKAGE/action/NAME, or PACKAGE for all that the package
has. Nested messages are written, too. Prints the .idl files that were read. Writes only files that change.
"""

import argparse
import hashlib
import json
import re
import sys
from ast import literal_eval
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from mauve_rt.modelling import keywords

try:
    from rosidl_parser import definition as d
except ImportError as error:
    sys.exit(f"{sys.executable} cannot read interfaces ({error}). Source ROS, or set Python3_EXECUTABLE.")

KINDS = ("msg", "srv", "action")
INT64_MIN, INT64_MAX = -(2**63), 2**63 - 1
MOST_FIELDS = 150  # that MAUVE_TYPE takes
UNBOUNDED_TEXT = 255  # characters of a string that has no bound: a file's name on Linux has no more
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
        """Name the header, as rosidl names its own."""
        words = re.sub(r"(.)([A-Z][a-z]+)", r"\1_\2", self.name)  # as rosidl names its headers
        words = re.sub(r"([a-z0-9])([A-Z])", r"\1_\2", words).lower()
        return f"mauve_types/{self.package}/{self.kind}/{words}.hpp"


class Installed:
    """The .idl files of prefixes, and of packages that are being built, by their names."""

    def __init__(self, prefixes: Sequence[Path], built: Mapping[str, Sequence[Path]]) -> None:
        self._prefixes = prefixes
        self._built = built

    def packages(self) -> set[str]:
        """List the installed packages with interfaces."""
        index = "share/ament_index/resource_index/rosidl_interfaces"
        return {path.name for prefix in self._prefixes for path in (prefix / index).glob("*")}

    def of_package(self, package: str) -> dict[Interface, Path]:
        """Each interface of a package, with the folder that has msg/NAME.idl."""
        own = self._built.get(package, ())
        found: dict[Interface, Path] = {}
        for folder in (*own, *(prefix / "share" / package for prefix in self._prefixes)):
            for kind in KINDS:
                for path in sorted((folder / kind).glob("*.idl")):
                    found.setdefault(Interface(package, kind, path.stem), folder)
        return found

    def named(self, name: str) -> list[Interface]:
        """Find what a word of the call stands for."""
        package, has_name, _ = name.partition("/")
        interfaces = {str(each): each for each in self.of_package(package)}
        if not interfaces:
            raise Refusal(
                f"no installed package {package} with interfaces{near(package, self.packages())}. "
                "Install the package, or source the workspace that has it, and name it in package.xml."
            )
        if not has_name:
            return list(interfaces.values())
        if name not in interfaces:
            raise Refusal(
                f"expected an interface of {package} such as {next(iter(interfaces))}, "
                f"found {name}{near(name, interfaces)}."
            )
        return [interfaces[name]]


def near(word: str, words: Iterable[str]) -> str:
    """Name those of the words that the caller may have meant."""
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
        """Say why a field has no C++."""
        return Refusal(f"{self.interface}, field '{name}': {found}. {remedy}")

    # ---- types and values ----

    def type_of(self, name: str, idl: Any) -> str:
        """Write the type of a field or constant in C++."""
        if isinstance(idl, d.AbstractNestedType):
            item = self.type_of(name, idl.value_type)
            if isinstance(idl, d.Array):
                return f"std::array<{item}, {idl.size}>"
            if isinstance(idl, d.BoundedSequence):
                return f"::mauve::BoundedVector<{item}, {idl.maximum_size}>"
            return f"::mauve::Sequence<{item}>"
        if isinstance(idl, d.AbstractGenericString):
            kind = "BoundedWString" if isinstance(idl, d.AbstractWString) else "BoundedString"
            return f"::mauve::{kind}<{text_capacity(idl)}>"
        if isinstance(idl, d.NamespacedType):
            package, kind, message = idl.namespaced_name()
            self.needs.add(Interface(package, kind, message.partition("_")[0]))
            return f"::{cpp_name(idl.namespaced_name())}"
        if idl.typename not in BASIC_TYPES:
            raise self.refuse(
                name,
                f"type {idl.typename} has no C++ struct",
                "Use a number of up to 64 bits or a string, or exchange the message in Python.",
            )
        return BASIC_TYPES[idl.typename]

    def initial(self, name: str, idl: Any, value: Any) -> str:
        """Write the default of a field in C++, with braces."""
        if not isinstance(idl, d.AbstractNestedType):
            return f"{{{self.value(name, idl, value)}}}"
        items = ", ".join(self.value(name, idl.value_type, each) for each in literal_eval(value))
        if isinstance(idl, d.Array):
            return f"{{{items}}}"
        if isinstance(idl, d.UnboundedSequence):
            raise self.refuse(
                name,
                f"default {value}, but a sequence without a bound comes empty, as its memory comes later",
                "Remove the default, or bound the sequence.",
            )
        item = self.type_of(name, idl.value_type)
        fill = f"for (const auto& item : std::initializer_list<{item}>{{{items}}}) items.push_back(item);"
        return f"{{[] {{ {self.type_of(name, idl)} items; {fill} return items; }}()}}"

    def value(self, name: str, idl: Any, value: Any) -> str:
        """Write a number or a text in C++."""
        if isinstance(idl, d.AbstractGenericString):
            is_wide = isinstance(idl, d.AbstractWString)
            size = len(value.encode("utf-16-le")) // 2 if is_wide else len(value.encode())
            if size > text_capacity(idl):
                expected = f"expected at most {text_capacity(idl)} characters, found a value of {size}"
                raise self.refuse(name, expected, "Shorten the value.")
            return wide_text(value) if is_wide else narrow_text(value)
        if idl.typename == "boolean":
            return str(bool(value)).lower()
        if idl.typename in ("float", "double"):
            return repr(float(value)) + ("F" if idl.typename == "float" else "")
        if value == INT64_MIN:
            return f"{value + 1} - 1"  # C++ has no literal for it
        return f"{value}U" if value > INT64_MAX else str(value)

    # ---- declarations ----

    def constant(self, constant: Any) -> Iterator[str]:
        """Declare a constant."""
        if isinstance(constant.type, d.AbstractWString):
            kind, value = "std::u16string_view", wide_text(constant.value)
        elif isinstance(constant.type, d.AbstractString):
            kind, value = "std::string_view", narrow_text(constant.value)
        else:
            kind = self.type_of(constant.name, constant.type)
            value = self.value(constant.name, constant.type, constant.value)
        yield from comment(constant)
        yield f"static constexpr {kind} {constant.name} = {value};"

    def member(self, member: Any) -> Iterator[str]:
        """Declare a field."""
        initial = ""
        if member.has_annotation("default"):
            value = member.get_annotation_value("default")["value"]
            initial = self.initial(member.name, member.type, value)
        elif isinstance(member.type, (d.BasicType, d.Array)):
            initial = "{}"
        yield from comment(member)
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
        """Describe a message to the kernel."""
        name = message.structure.namespaced_type.namespaced_name()
        if len(message.structure.members) > MOST_FIELDS:
            found = f"expected at most {MOST_FIELDS} fields, found {len(message.structure.members)}"
            raise Refusal(f"{'/'.join(name)}: {found}. Divide it into messages.")
        fields = "".join(f", {member_name(member)}" for member in members(message))
        yield f'MAUVE_TYPE({cpp_name(name)}, "{"/".join(name)}"{fields})'

    def service(self, service: Any, name: str) -> Iterator[str]:
        """Declare a service of this name."""
        yield f"struct {name} {{"
        yield from indented(self.message(service.request_message, "Request"))
        yield from indented(self.message(service.response_message, "Response"))
        yield "};"

    def service_traits(self, service: Any) -> Iterator[str]:
        """Describe a service to the kernel."""
        yield from self.traits(service.request_message)
        yield from self.traits(service.response_message)
        name = service.namespaced_type.namespaced_name()
        yield f'MAUVE_CALL_TYPE({cpp_name(name)}, "{"/".join(name)}")'

    def action(self, action: Any, name: str) -> Iterator[str]:
        """Declare an action of this name."""
        yield f"struct {name} {{"
        for part in ("goal", "result", "feedback"):
            yield from indented(self.message(getattr(action, part), part.capitalize()))
        yield from indented(self.service(action.send_goal_service, "SendGoal"))
        yield from indented(self.service(action.get_result_service, "GetResult"))
        yield from indented(self.message(action.feedback_message, "FeedbackMessage"))
        yield "};"

    def action_traits(self, action: Any) -> Iterator[str]:
        """Describe an action to the kernel."""
        for part in ("goal", "result", "feedback"):
            yield from self.traits(getattr(action, part))
        yield from self.service_traits(action.send_goal_service)
        yield from self.service_traits(action.get_result_service)
        yield from self.traits(action.feedback_message)
        name = action.namespaced_type.namespaced_name()
        yield f'MAUVE_ACTION_TYPE({cpp_name(name)}, "{"/".join(name)}")'

    def write(self, content: Any) -> str:
        """The header, of a parsed .idl file."""
        kind, declare, describe = {
            "msg": (d.Message, self.message, self.traits),
            "srv": (d.Service, self.service, self.service_traits),
            "action": (d.Action, self.action, self.action_traits),
        }[self.interface.kind]
        [element] = content.get_elements_of_type(kind)
        declared = list(declare(element, self.interface.name))
        guard = re.sub(r"\W", "_", self.interface.header).upper()
        others = sorted(need.header for need in self.needs - {self.interface})
        described = {
            "msg": ["cdr"],
            "srv": ["call_type", "cdr"],
            "action": ["action_type", "call_type", "cdr"],
        }
        return "\n".join(
            [
                f"// Written by mauve_generate_types() from {self.interface}. Change that one.",
                f"#ifndef {guard}  // not `pragma once`: two packages may each have written this header",
                f"#define {guard}",
                "",
                "#include <array>",
                "#include <cstdint>",
                "#include <initializer_list>",
                "#include <string_view>",
                "",
                *(f"#include <mauve_rt/data/{each}.hpp>" for each in described[self.interface.kind]),
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
    """Say how many characters a string has at most."""
    return int(idl.maximum_size) if idl.has_maximum_size() else UNBOUNDED_TEXT


def narrow_text(text: str) -> str:
    """Write a literal. Octal codes have a fixed length."""
    return f'"{"".join(plain(byte) or f"{chr(92)}{byte:03o}" for byte in text.encode())}"'


def wide_text(text: str) -> str:
    """Write a literal of UTF-16."""
    return f'u"{"".join(plain(code) or universal(code) for code in map(ord, text))}"'


def universal(code: int) -> str:
    """Write a character as C++ names it; those below U+00A0 have no such name."""
    return f"\\U{code:08x}" if code >= 0xA0 else f"\\{code:03o}"  # noqa: PLR2004


def plain(code: int) -> str:
    """Write a printable character of ASCII that means itself in a literal; of others nothing."""
    return chr(code) if chr(code).isprintable() and code < 0x7F and chr(code) not in '"\\?' else ""  # noqa: PLR2004


def members(message: Any) -> list[Any]:
    """List the fields, without the one that rosidl gives an empty message."""
    return [each for each in message.structure.members if each.name != d.EMPTY_STRUCTURE_REQUIRED_MEMBER_NAME]


def member_name(member: Any) -> str:
    """Name the member of a field, of a C++ keyword with one character more."""
    return f"{member.name}_" if member.name in keywords.CPP else member.name


def comment(annotated: Any) -> Iterator[str]:
    """Lines of the interface, with the unit that rosidl takes out of them."""
    lines = annotated.get_comment_lines()
    if annotated.has_annotation("unit"):
        last = lines.pop() if lines else ""
        lines.append(f"{last} [{annotated.get_annotation_value('unit')['value']}]".lstrip())
    for line in lines:
        text = f"/// {line}".rstrip()
        yield text + "." if text.endswith("\\") else text  # else the next line would belong to the comment


def indented(lines: Iterator[str]) -> Iterator[str]:
    """Indent lines of a struct."""
    return (f"  {line}" for line in lines)


def generate(installed: Installed, interfaces: Sequence[Interface]) -> tuple[dict[str, str], list[Path]]:
    """Headers by their names, and the files that were read."""
    from rosidl_parser.parser import parse_idl_file  # noqa: PLC0415 - 0.3 s, for nothing when all is up to date

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
        headers[interface.header] = writer.write(parse_idl_file(d.IdlLocator(folder, relative)).content)
        read.append(folder / relative)
        pending += sorted(writer.needs)
    return headers, read


def digest_of(words: Sequence[str], files: Sequence[Path]) -> str:
    """Digest all that headers are made of."""
    digest = hashlib.sha256("\0".join(words).encode())
    for path in (Path(__file__), Path(keywords.__file__), *files):
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
    """Run for one call of mauve_generate_types()."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--target", required=True)
    parser.add_argument("--output", type=Path, required=True)
    parser.add_argument("--prefixes", nargs="*", type=Path, default=[])
    parser.add_argument("--package", nargs="+", action="append", default=[])
    parser.add_argument("--interfaces", nargs="+", required=True)
    given = parser.parse_args()

    built = {name: [Path(folder) for folder in folders] for name, *folders in given.package}
    installed = Installed(given.prefixes, built)
    try:
        read = update(installed, given.target, given.output, given.interfaces)
    except Refusal as refusal:
        print(refusal, file=sys.stderr)
        return 1
    print("\n".join(map(str, read)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
