"""`mauve plugins`: what installed packages offer, and of one part all that a user needs to know of it."""

import argparse
import sys
from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

from mauve_rt.cli.verb import OK
from mauve_rt.errors import one_line

if TYPE_CHECKING:
    from mauve_rt._kernel import (
        CoreDescription,
        DescribedState,
        PropertyDescription,
        ResourceParameter,
        ShellDescription,
    )
    from mauve_rt.model.plugins import PluginLoader

_FIELDS = ("kind", "name", "shell", "target", "prefix")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The part that is shown."""
    parser.add_argument(
        "name",
        nargs="?",
        help="show ports, properties and states of this shell, core, fsm, resource or type (default: a list)",
    )
    parser.add_argument("--json", action="store_true", help="print JSON")


def main(args: argparse.Namespace) -> int:
    """Show one plug-in, or list all."""
    from mauve_rt.cli.views import print_json  # noqa: PLC0415 - other verbs need not load it
    from mauve_rt.model import PluginIndex  # noqa: PLC0415

    index = PluginIndex.installed()
    if args.name is not None:
        from mauve_rt._kernel import PluginRegistry  # noqa: PLC0415
        from mauve_rt.model.plugins import PluginLoader  # noqa: PLC0415

        parts = [*_parts(PluginLoader(PluginRegistry(), index), args.name)]
        print_json(parts) if args.json else _print_parts(parts)
        return OK
    rows = [dict(zip(_FIELDS, row, strict=True)) for row in sorted(map(_row, index))]
    if args.json:
        print_json(rows)
    else:
        from mauve_rt.cli.tables import dict_table  # noqa: PLC0415 - rich takes its time to load
        from mauve_rt.cli.views import console  # noqa: PLC0415

        console().print(dict_table(rows, _FIELDS[:4]))
    for complaint in index.complaints:
        print(one_line(complaint), file=sys.stderr)
    return OK


def _row(plugin: Any) -> tuple[str, ...]:
    return plugin.kind, plugin.name, plugin.shell, plugin.target, str(plugin.prefix)


def _parts(loader: "PluginLoader", name: str) -> Iterator[dict[str, Any]]:
    """Each kind of plug-in that has the name.

    Raises:
        PluginError: there is none, or it cannot be loaded.
    """
    from mauve_rt.model.plugins import KINDS  # noqa: PLC0415

    registry = loader.registry
    kinds = [kind for kind in KINDS if loader.has(kind, name)]
    for kind in kinds or ["core"]:  # which then says what is near
        loader.require(kind, name)
        part: dict[str, Any] = {"kind": kind, "name": name}
        if kind == "core":
            part |= {"shell": registry.core_shell(name)}
        elif kind == "fsm":
            part |= {"shell": registry.fsm_shell(name)}
        if shell := name if kind == "shell" else part.get("shell"):
            loader.require("shell", shell)
            part |= _shell(registry.describe_shell(shell))
        if kind == "core":
            part |= _core(registry.describe_core(name))
        elif kind == "fsm":
            part |= {"states": [_state(each) for each in registry.describe_fsm(name)]}
        elif kind == "resource":
            given = registry.resource_kind(name).parameters
            part |= {"parameters": [_setting(one, None if one.required else one.initial) for one in given]}
        elif kind == "type":
            size = next(shape.bytes for shape in registry.type_shapes() if shape.type == name)
            part |= {"bytes": size, "capacities": registry.sequences(name)}
        yield part


def _core(core: "CoreDescription") -> dict[str, Any]:
    return {
        "python": core.is_python,
        "classes": core.classes,
        "budget_ns": core.budget_ns,
        "methods": [{"name": name, "wcet_ns": time_ns} for name, time_ns in core.wcet_ns.items()],
        "state": [{"name": name, "type": type_name} for name, type_name in core.state_fields],
    }


def _shell(shell: "ShellDescription") -> dict[str, Any]:
    ports = [
        {
            "name": port.name,
            "kind": port.kind,
            "type": port.type,
            "required": port.required,
            "on_commit": port.on_commit or None,
            "on_stop": port.on_stop or None,
        }
        for port in shell.ports
    ]
    properties = [_setting(one, one.value) | {"read once by": one.structural} for one in shell.properties]
    return {"ports": ports, "properties": properties}


def _setting(one: "PropertyDescription | ResourceParameter", default: Any) -> dict[str, Any]:
    return {
        "name": one.name,
        "type": one.type,
        "default": default,
        "unit": one.unit,
        "minimum": one.minimum,
        "maximum": one.maximum,
        "description": one.description,
    }


def _state(state: "DescribedState") -> dict[str, Any]:
    from mauve_rt.parts.time import FOREVER  # noqa: PLC0415

    kind = "wait for an event" if state.is_event_wait else "wait" if state.is_wait else "execution"
    is_timed = state.is_wait and state.duration_ns != FOREVER
    return {
        "name": state.name,
        "kind": kind,
        "initial": state.is_initial,
        "action": state.action,
        "duration_ns": state.duration_ns if is_timed else None,
        "duration_text": state.duration_text,
        "event_port": state.event_port,
        "min_interarrival_ns": state.min_interarrival_ns,
        "min_interarrival_text": state.min_interarrival_text,
        "max_execution_ns": state.max_execution_ns,
        "wcet_ns": state.wcet_ns,
        "guards": state.guards,
        "next": state.successors,
    }


def _print_parts(parts: Iterable[Mapping[str, Any]]) -> None:
    from mauve_rt.cli.tables import dict_table  # noqa: PLC0415 - rich takes its time to load
    from mauve_rt.cli.views import console  # noqa: PLC0415
    from mauve_rt.counts import duration  # noqa: PLC0415

    out = console()
    for part in parts:
        shell = f", shell {part['shell']}" if part.get("shell") else ""
        out.print(f"[bold]{part['kind']}[/] {part['name']}{shell}", soft_wrap=True)
        if ports := part.get("ports"):
            rows = [
                each | {"port": each["name"], "": "" if each["required"] else "optional"} for each in ports
            ]
            out.print(dict_table(rows, ("port", "kind", "type", "on_commit", "on_stop", "")))
        if settings := part.get("properties", part.get("parameters")):
            head = "property" if "properties" in part else "parameter"
            rows = [{head: each["name"], "range": _range(each)} | each for each in settings]
            out.print(dict_table(rows, (head, "type", "default", "unit", "range", "description")))
        if states := part.get("states"):
            rows = [
                {"state": each["name"] + (" (initial)" if each["initial"] else "")}
                | each
                | {"time": _time(each, duration(each["duration_ns"] or 0)), "next": _next(each)}
                for each in states
            ]
            out.print(dict_table(rows, ("state", "kind", "action", "time", "next")))
        if methods := part.get("methods"):
            rows = [{"method": each["name"], "wcet": duration(each["wcet_ns"])} for each in methods]
            out.print(dict_table(rows, ("method", "wcet")))
        if fields := part.get("state"):
            out.print(dict_table([{"state": each["name"]} | each for each in fields], ("state", "type")))
        if "bytes" in part:
            lists = ", ".join(part["capacities"])
            out.print(
                f"{part['bytes']:,} bytes" + (f", lists that need a capacity: {lists}" if lists else "")
            )


def _time(state: Mapping[str, Any], length: str) -> str:
    """As `5 * unit_ms = 50 ms`."""
    return f"{state['duration_text']} = {length}" if state["duration_text"] else length


def _next(state: Mapping[str, Any]) -> str:
    """As `if has_path: Following, Idle`."""
    guards = [f"if {guard}: " for guard in state["guards"]]
    return ", ".join(guard + to for guard, to in zip([*guards, ""], state["next"], strict=False))


def _range(setting: Mapping[str, Any]) -> str:
    least, most = setting["minimum"], setting["maximum"]
    if least is None and most is None:
        return ""
    if most is None:
        return f">= {least:g}"
    return f"<= {most:g}" if least is None else f"{least:g} to {most:g}"
