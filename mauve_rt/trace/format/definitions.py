"""Message definitions and type hashes from the installed interface packages, as a bag stores them."""

import json
import os
import re
import sys
from pathlib import Path
from typing import NamedTuple

from mauve_rt.trace.errors import TraceError

SEPARATOR = "=" * 80
_PRIMITIVES = frozenset(
    {"bool", "byte", "char", "string", "wstring", "float32", "float64"}
    | {f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)}
)
_FIELD = re.compile(r"\s*(?P<type>[A-Za-z][\w/]*)(?:<=\d+)?(?:\[[^\]]*\])?\s+[A-Za-z]")
_MESSAGE_NAME_PARTS = 3  # package/msg/Name
_SECTIONS = ("Goal", "Result", "Feedback")  # of an .action file, between lines of ---
_PART_OF_ACTION = re.compile(rf"(?P<action>[^/]+/action/[^/_]+)_(?P<part>{'|'.join(_SECTIONS)})")


class Definition(NamedTuple):
    """A message type as it goes into a bag."""

    type_name: str
    """package/msg/Name, or package/action/Name_Goal, _Result or _Feedback"""
    text: str
    """The .msg file, then each type it uses, behind a line of 80 '=' and one `MSG: package/Name`."""
    type_hash: str
    """RIHS01_..., or empty when the package does not tell."""


def find_definition(type_name: str) -> Definition:
    """Definition of a type, e.g. geometry_msgs/msg/Pose2D. Looks in AMENT_PREFIX_PATH, then in sys.prefix.

    Of a part of an action (package/action/Name_Goal) the text is a section of the .action file.

    Raises:
        TraceError: the type, or one that it uses, is in no installed package; says what to install or source.

    """
    texts: dict[str, str] = {}
    pending = [_full_name(type_name, "")]
    while pending:
        name = pending.pop()
        if name in texts:
            continue
        texts[name] = _text(name, used_by=type_name)
        package = name.split("/", 1)[0]
        pending += [_full_name(used, package) for used in reversed(_used_types(texts[name]))]
    (first, main), *others = texts.items()
    parts = [main.rstrip("\n")]
    for name, text in others:
        package, _, short = name.split("/")
        parts.append(f"{SEPARATOR}\nMSG: {package}/{short}\n{text.rstrip(chr(10))}")
    return Definition(first, "\n".join(parts) + "\n", _type_hash(first))


def _text(name: str, *, used_by: str) -> str:
    """Return the .msg file of a type, or its section of an .action file."""
    part = _PART_OF_ACTION.fullmatch(name)
    if part is None:
        return _share_file(name, ".msg", used_by=used_by).read_text(encoding="utf-8")
    file = _share_file(part["action"], ".action", used_by=name)
    sections = re.split(r"^---[ \t]*$\n?", file.read_text(encoding="utf-8"), flags=re.MULTILINE)
    if len(sections) != len(_SECTIONS):
        msg = f"{file}: expected {len(_SECTIONS)} sections between lines of ---, found {len(sections)}"
        raise TraceError(msg)
    return sections[_SECTIONS.index(part["part"])]


def _used_types(text: str) -> list[str]:
    """Names of the types of a .msg file's fields and constants that are messages themselves, in order."""
    matches = (_FIELD.match(line) for line in text.splitlines())
    return [name for match in matches if match and (name := match["type"]) not in _PRIMITIVES]


def _full_name(name: str, package: str) -> str:
    parts = name.split("/")
    if len(parts) == 1 and package:
        parts = [package, "msg", *parts]
    elif len(parts) == _MESSAGE_NAME_PARTS - 1:
        parts.insert(1, "msg")
    is_part = _PART_OF_ACTION.fullmatch(name) is not None
    if not is_part and (len(parts) != _MESSAGE_NAME_PARTS or parts[1] != "msg" or not all(parts)):
        msg = f"message type '{name}': expected package/msg/Name"
        raise TraceError(msg)
    return "/".join(parts)


def _prefixes() -> list[Path]:
    listed = [Path(entry) for entry in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if entry]
    return [*listed, Path(sys.prefix)]


def _share_file(name: str, suffix: str, *, used_by: str) -> Path:
    searched = _prefixes()
    for prefix in searched:
        path = prefix / "share" / f"{name}{suffix}"
        if path.is_file():
            return path
    package = name.split("/", 1)[0]
    needed = "" if used_by == name else f" (used by {used_by})"
    msg = (
        f"message type '{name}'{needed}: no share/{name}{suffix} under {', '.join(map(str, searched))}; "
        f"install or build the package {package} and source its workspace's setup file"
    )
    raise TraceError(msg)


def _type_hash(name: str) -> str:
    try:
        part = _PART_OF_ACTION.fullmatch(name)
        file = _share_file(part["action"] if part else name, ".json", used_by=name)
        described = json.loads(file.read_text(encoding="utf-8"))
        hashes = {entry["type_name"]: str(entry["hash_string"]) for entry in described["type_hashes"]}
    except (TraceError, OSError, ValueError, KeyError, TypeError):
        return ""  # an interface package older than type hashes; a bag may leave it empty
    return hashes.get(name, "")
