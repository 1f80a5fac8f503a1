"""`mauve types`: the structs of data that installed plug-ins register, and the messages they stand for."""

import argparse
import sys
from collections.abc import Collection, Iterator
from typing import TYPE_CHECKING, Any

from mauve_rt.cli.verb import OK
from mauve_rt.errors import MauveError, one_line

_MSG = "msg"

if TYPE_CHECKING:
    from mauve_rt._kernel import FieldShape, MessageShape
    from mauve_rt.model.plugins import PluginLoader


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The type, and what is shown of it."""
    parser.add_argument(
        "words",
        nargs="*",
        action=_Words,
        metavar="TYPE",
        help="TYPE: its fields; msg TYPE: the type as a .msg file, an action as an .action file "
        "(default: a list of all types)",
    )
    parser.add_argument("--json", action="store_true", help="print JSON")


class _Words(argparse.Action):
    """Takes nothing, TYPE, or msg TYPE."""

    def __call__(self, parser: argparse.ArgumentParser, namespace: Any, values: Any, *_: Any) -> None:
        *form, name = values or [None]
        if form not in ([], [_MSG]):
            parser.error(f"expected TYPE or {_MSG} TYPE, found {' '.join(values)}")
        namespace.is_file, namespace.type = bool(form), name


def main(args: argparse.Namespace) -> int:
    """Show one type, or all."""
    from mauve_rt._kernel import PluginRegistry, message_files  # noqa: PLC0415 - other verbs need not load it
    from mauve_rt.cli.views import print_json  # noqa: PLC0415
    from mauve_rt.model import PluginIndex  # noqa: PLC0415
    from mauve_rt.model.plugins import PluginLoader  # noqa: PLC0415

    loader = PluginLoader(PluginRegistry(), PluginIndex.installed())
    if args.type is None:
        rows = [*_all(loader)]
        print_json(rows) if args.json else _print_table(rows)
        return OK
    names = _names(loader, args.type)
    shapes = {shape.type: shape for shape in loader.registry.type_shapes()}
    found = [shapes[name] for name in names]
    if args.is_file:
        print("---\n".join(message_files(shape)[0].text for shape in found), end="")
    elif args.json:
        described = [{**_row(loader, shape), "fields": [*_fields(shape.fields)]} for shape in found]
        print_json(described[0] if args.type in names else described)
    else:
        for shape in found:
            print(f"{shape.type}: {shape.bytes:,} bytes")
            print("\n".join(_lines(shape.fields)))
    return OK


def _names(loader: "PluginLoader", name: str) -> list[str]:
    """The type of this name, or the parts of an action; they are loaded."""
    from mauve_rt.parts.message_types import PARTS_OF_ACTIONS  # noqa: PLC0415

    if not loader.has("action_type", name):
        loader.require("type", name)
        return [name]
    loader.require("action_type", name)
    return [f"{name}_{part}" for part in PARTS_OF_ACTIONS]


def _all(loader: "PluginLoader") -> Iterator[dict[str, Any]]:
    """Each type; what cannot be loaded is named on stderr."""
    for name in sorted(plugin.name for plugin in loader.index if plugin.kind == "type"):
        try:
            loader.require("type", name)
        except MauveError as error:
            print(f"mauve: {one_line(str(error))}", file=sys.stderr)
    for shape in sorted(loader.registry.type_shapes(), key=lambda each: each.type):
        yield _row(loader, shape)


def _row(loader: "PluginLoader", shape: "MessageShape") -> dict[str, Any]:
    plugin = loader.index.find("type", shape.type)
    return {
        "type": shape.type,
        "bytes": shape.bytes,
        "capacities": loader.registry.sequences(shape.type),
        "library": "" if plugin is None else plugin.target,
    }


def _fields(fields: "Collection[FieldShape]") -> Iterator[dict[str, Any]]:
    for field in fields:
        yield {
            "name": field.name,
            "type": f"{field.item}{field.array}",
            "offset": field.offset,
            "fields": [*_fields(field.fields)],
        }


def _lines(fields: "Collection[FieldShape]", indent: str = "  ") -> Iterator[str]:
    for field in fields:
        yield f"{indent}{field.item}{field.array} {field.name}"
        yield from _lines(field.fields, f"{indent}  ")


def _print_table(rows: Collection[dict[str, Any]]) -> None:
    from mauve_rt.cli.tables import dict_table  # noqa: PLC0415 - rich takes its time to load
    from mauve_rt.cli.views import console  # noqa: PLC0415

    shown = [row | {"bytes": f"{row['bytes']:,}", "capacities": ", ".join(row["capacities"])} for row in rows]
    console().print(dict_table(shown, ("type", "bytes", "capacities", "library")))
