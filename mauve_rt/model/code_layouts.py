"""Layouts of types and shells in two builds of a library: whether both mean the same by the same memory.

As plain values, which the trial of new code answers with (`plugin_trial`).
"""

from collections.abc import Collection, Iterator, Mapping
from typing import Any

from mauve_rt._kernel import FieldShape, MessageShape, PluginRegistry, ShellDescription
from mauve_rt.errors import PluginError

Layout = dict[str, Any]
"""`bytes` of a struct, and its `fields`: path to type and place."""


def layout_of(shape: MessageShape) -> Layout:
    """The layout of a struct."""
    return {"bytes": shape.bytes, "fields": dict(_fields(shape.fields, path="", begin=0))}


def _fields(fields: Collection[FieldShape], *, path: str, begin: int) -> Iterator[tuple[str, str]]:
    for field in fields:
        name, place = f"{path}{field.name}", begin + field.offset
        if field.fields and not field.is_array:
            yield from _fields(field.fields, path=f"{name}.", begin=place)
            continue
        yield name, f"{field.item}{field.array} at byte {place}"
        yield from _fields(field.fields, path=f"{name}[].", begin=0)


def layouts_of(shell: ShellDescription) -> dict[str, Layout]:
    """The layouts of the types of a shell's ports."""
    return {shape.type: layout_of(shape) for port in shell.ports for shape in port.messages}


def shell_layout(shell: ShellDescription) -> list[Any]:
    """What code that was compiled for a shell relies on."""
    ports = [[port.name, port.kind, port.type] for port in shell.ports]
    return [shell.bytes, ports, [[item.name, item.type] for item in shell.properties]]


def is_same_shell(layout: list[Any], shell: ShellDescription) -> bool:
    """Whether code that was compiled for a shell of this layout can work with that one."""
    return layout == shell_layout(shell)


def registered_layouts(registry: PluginRegistry, shells: Collection[str]) -> dict[str, Layout]:
    """Of the types that a registry knows, and of those that these shells have beside them."""
    found: dict[str, Layout] = {}
    for shell in shells:
        found.update(layouts_of(registry.describe_shell(shell)))
    found.update({shape.type: layout_of(shape) for shape in registry.type_shapes()})
    return found


def check_types(
    new: Mapping[str, Layout], registry: PluginRegistry, names: Collection[tuple[str, str]]
) -> None:
    """Whether values of the types that are in use can go to the new code and back.

    Raises:
        PluginError: the layout of one has changed; the field is named.
    """
    shells = [name for kind, name in names if kind == "shell" and name in registry.names("shell")]
    old = registered_layouts(registry, shells)
    for name in sorted({*new} & {*old}):
        if change := _change(old[name], new[name]):
            text = f"type {name}: its layout has changed: {change}"
            raise PluginError(text, element=name, remedy="start the executor again")


def _change(old: Layout, new: Layout) -> str:
    for field in dict.fromkeys((*old["fields"], *new["fields"])):
        before, now = old["fields"].get(field, "none"), new["fields"].get(field, "none")
        if before != now:
            return f"field {field}: {before} before, {now} now"
    if old["bytes"] != new["bytes"]:
        return f"{old['bytes']} bytes before, {new['bytes']} now"
    return ""
