"""A node's own parameters as a table: what each one is, when it is read, how it is refused. Knows no ROS."""

import math
from collections.abc import Iterable, Mapping
from typing import Any, Literal, NamedTuple

from mauve_rt.errors import ParameterError
from mauve_rt.file_schema.words import did_you_mean, shown
from mauve_rt.node.shared.ros_arguments import RosArguments

QOS_OVERRIDES = "qos_overrides."
NO_SIMULATED_TIME = "expected false: components run by the monotonic clock; leave it out"


class Setting(NamedTuple):
    """A parameter, and when its value is read: what is set after that would change nothing."""

    default: bool | int | float | str | list[str]
    description: str
    read: Literal["at the start", "when configured"] = "at the start"
    minimum: float = -math.inf
    maximum: float = math.inf
    constraint: str = ""  # in the place of what `read` says of later changes

    @property
    def is_fixed(self) -> bool:
        """Whether nothing may ever set it while the node is there."""
        return self.read == "at the start"

    @property
    def constraints(self) -> str:
        """When it can be changed, in words."""
        if self.constraint:
            return self.constraint
        return "read once, at the start" if self.is_fixed else "read when configured: set it before"


OF_RCLPY = {
    "use_sim_time": Setting(
        default=False,
        description="simulated time is refused",
        constraint="components run by the monotonic clock",
    ),
    "start_type_description_service": Setting(
        default=True,
        description="offer ~/get_type_description",
    ),
}


def check_given(arguments: RosArguments, settings: Mapping[str, Setting], *, namespace: str) -> list[str]:
    """Check the names that are given to this very node; returns those of components' properties.

    Raises:
        ParameterError: a name that the table has not, `qos_overrides`, or `use_sim_time` for it alone.
    """
    names = [*settings, *OF_RCLPY]
    properties = []
    for name in arguments.meant_for_it(namespace):
        if name.startswith(QOS_OVERRIDES):
            raise ParameterError(f"parameter {name}: {no_qos_overrides(arguments.default_node)}")
        if "." in name:
            properties.append(name)
        elif name not in names:
            what = f"parameter {name}: {_article(arguments.default_node)} has none of that name"
            raise ParameterError(f"{what}; {did_you_mean(name, names)}")
    if arguments.meant_for_it(namespace).get("use_sim_time"):
        raise ParameterError(f"use_sim_time: {NO_SIMULATED_TIME}")
    return properties


def near_misses(
    arguments: RosArguments, settings: Mapping[str, Setting], *, namespace: str
) -> tuple[str, ...]:
    """What to say of names given to nodes of any name, as launch files do, that are almost the table's."""
    names = [*settings, *OF_RCLPY]
    its_own = arguments.meant_for_it(namespace)
    unknown = [name for name in arguments.within(namespace) if name not in its_own and name not in names]
    remedies = {name: did_you_mean(name, names) for name in unknown if "." not in name}
    who = _article(arguments.default_node)
    remarks = [
        f"parameter {name}: given to nodes of any name, and {who} has none of it; {remedy}"
        for name, remedy in remedies.items()
        if remedy.startswith("did you mean")
    ]
    if arguments.within(namespace).get("use_sim_time"):
        remarks.append(
            f"parameter use_sim_time: given to nodes of any name, and ignored; {NO_SIMULATED_TIME}"
        )
    return tuple(remarks)


def values_of(given: Mapping[str, Any], settings: Mapping[str, Setting]) -> dict[str, Any]:
    """The value of each setting: what is given, or its default.

    Raises:
        ParameterError: a value of another type, or out of range. An integer is a number, too.
    """
    return {name: _value_of(name, given.get(name), setting) for name, setting in settings.items()}


def _value_of(name: str, value: Any, setting: Setting) -> Any:
    if value is None or (value == [] and isinstance(setting.default, list)):
        return setting.default
    if isinstance(setting.default, float) and type(value) is int:
        value = float(value)
    fits = type(value) is type(setting.default)
    if isinstance(value, list):
        fits = fits and all(isinstance(one, str) for one in value)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        fits = fits and setting.minimum <= value <= setting.maximum
    if not fits:
        raise ParameterError(f"parameter {name}: expected {_expected(setting)}, found {shown(value)}")
    return value


def _expected(setting: Setting) -> str:
    words = {
        bool: "true or false",
        int: "a whole number",
        float: "a number",
        str: "text",
        list: "a list of texts",
    }
    text = words[type(setting.default)]
    if setting.minimum > -math.inf:
        text += f" of at least {setting.minimum:g}"
    if setting.maximum < math.inf:
        text += f" and at most {setting.maximum:g}"
    return text


def no_qos_overrides(node: str) -> str:
    """Why and what instead."""
    where = "a bound topic's quality of service is in the architecture file, as `topic: {qos: ...}`"
    other = "its topics have the quality of service that those who talk with it expect"
    return f"{_article(node)} takes no qos_overrides: {where if node == 'executor' else other}; leave it out"


def refusal(name: str, setting: Setting, *, configured: bool) -> str:
    """Why a parameter is not set now; empty: it is."""
    if setting.constraint:
        return f"parameter {name}: {setting.constraint}"
    if setting.is_fixed:
        return f"parameter {name} is read once, at the start: start the node again with -p {name}:=VALUE"
    if configured:
        text = f"parameter {name} is read when the executor is configured"
        return f"{text}: clean it up first (ros2 lifecycle set NODE cleanup)"
    return ""


def usage(command: str, settings: Mapping[str, Setting], *, more: Iterable[tuple[str, str]] = ()) -> str:
    """What --help says: the command line and the parameters with type, default and description.

    `more`: further lines, each a name with its values and what it is.
    """
    rows = [
        (f"{name}:={type_name(setting)}", f"{setting.description} (default: {_shown(setting.default)})")
        for name, setting in settings.items()
    ]
    rows += more
    width = max(len(name) for name, _ in rows)
    lines = [f"  -p {name:<{width}}  {text}" for name, text in rows]
    options = "[-r __ns:=NAMESPACE] [-r __node:=NAME] [-p NAME:=VALUE] [--params-file FILE]"
    return "\n".join([f"usage: {command} --ros-args {options}", "", "parameters:", *lines, ""])


def type_name(setting: Setting) -> str:
    """The type of its values, as ROS calls it."""
    names = {bool: "bool", int: "integer", float: "double", str: "string", list: "string_array"}
    return names[type(setting.default)]


def _shown(default: object) -> str:
    if isinstance(default, bool):
        return str(default).lower()
    return repr(default).replace("'", '"')


def _article(node: str) -> str:
    return f"{'an' if node[0] in 'aeiou' else 'a'} {node}"
