"""`mauve get NODE COMPONENT.PROPERTY|RESOURCE.FIELD`: one present value of an executor, alone on a line."""

import argparse
import sys
from typing import Any

from mauve_rt.cli.arguments import add_executor
from mauve_rt.cli.completion import complete_properties, complete_values, completed_by
from mauve_rt.cli.verb import OK, REFUSED
from mauve_rt.errors import MauveError


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Of `mauve get`."""
    add_executor(parser)
    name = parser.add_argument(
        "name",
        help="COMPONENT.PROPERTY, or a resource or COMPONENT.PORT with a field, e.g. pose.position.x",
    )
    completed_by(name, lambda *a, **k: [*complete_properties(*a, **k), *complete_values(*a, **k)])
    parser.add_argument("--json", action="store_true", help="print the value as JSON")


def main(args: argparse.Namespace) -> int:
    """Print the value. 1: there is none."""
    from mauve_rt.cli.client import connected  # noqa: PLC0415 - ROS takes its time to load
    from mauve_rt.cli.echo_verb import value_text  # noqa: PLC0415
    from mauve_rt.cli.views import print_json  # noqa: PLC0415
    from mauve_rt.fields import json_value  # noqa: PLC0415

    try:
        with connected(first=True) as client:
            value = _value(client, args.executor, args.name)
    except (MauveError, ValueError) as error:
        print(f"refused: {error}", file=sys.stderr)
        return REFUSED
    if args.json:
        print_json(value)
    else:
        plain = value if isinstance(value, bool | int | float | str) else json_value(value)
        print(value_text(plain))
    return OK


def _value(client: Any, executor: str, name: str) -> Any:
    """Of a property, else the field of a resource's newest value.

    Raises:
        MauveError, ValueError: there is none; which names there are.
    """
    from mauve_msgs.srv import ListComponents  # noqa: PLC0415
    from mauve_rt.file_schema.words import did_you_mean  # noqa: PLC0415
    from mauve_rt.yaml.text import read_yaml  # noqa: PLC0415

    listed = client.call(ListComponents, f"{executor}/list_components", ListComponents.Request())
    properties = {
        f"{each.name}.{key}": text
        for each in listed.components
        for key, _, text in (item.partition("=") for item in each.properties)
    }
    if name in properties:
        return read_yaml(properties[name])
    values = [resource.name for resource in listed.resources]
    values += [f"{each.name}.{port.name}" for each in listed.components for port in each.ports]
    found = next((each for each in values if name == each or name.startswith((f"{each}.", f"{each}["))), None)
    if found is None:
        remedy = did_you_mean(name, [*properties, *values])
        raise MauveError(f"no property, resource or port is named '{name}'; {remedy}")
    return _read(client, executor, found, name[len(found) :].removeprefix("."))


def _read(client: Any, executor: str, name: str, path: str) -> Any:
    from mauve_msgs.srv import ReadValues  # noqa: PLC0415
    from mauve_rt.fields import field_at  # noqa: PLC0415
    from mauve_rt.trace.format.message_decoding import Decoder  # noqa: PLC0415

    request = ReadValues.Request(names=[name], with_definitions=True)
    (value,) = client.call(ReadValues, f"{executor}/read_values", request).values
    if value.problem:
        raise MauveError(value.problem)
    if value.status == value.NONE:
        raise MauveError(f"{name} ({value.type}): nothing was written yet")
    message = Decoder(value.type, value.definition).decode(bytes(value.data))
    return field_at(message, path) if path else message
