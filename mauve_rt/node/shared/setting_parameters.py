"""The table of a node's settings as its ROS parameters: declared, typed, read-only where they are."""

from collections.abc import Mapping
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.node import Node
from rclpy.parameter import Parameter

from mauve_rt.node.shared.settings import OF_RCLPY, Setting

_INT64_MAX = 2**63 - 1
_STRINGS = Parameter.Type.STRING_ARRAY


NO_SIMULATED_TIME = (Parameter("use_sim_time", value=False),)
"""For the node's constructor: whatever a file says to nodes of any name."""


def declare_settings(node: Node, settings: Mapping[str, Setting], values: Mapping[str, Any]) -> None:
    """Declare all of them with these values. What rclpy declares for every node is marked as well."""
    for name, setting in settings.items():
        _declare(node, name, setting, values[name])
    for name, setting in OF_RCLPY.items():
        if not node.describe_parameter(name).read_only:
            node.set_descriptor(name, _descriptor(setting))


def _declare(node: Node, name: str, setting: Setting, value: Any) -> None:
    if not isinstance(setting.default, list):
        node.declare_parameter(name, value, _descriptor(setting), ignore_override=True)
        return
    # rclpy takes an empty list for one of bytes.
    node.declare_parameter(name, _STRINGS, ParameterDescriptor(type=_STRINGS.value), ignore_override=True)
    node.set_parameters([Parameter(name, _STRINGS, list(value))])
    node.set_descriptor(name, _descriptor(setting))


def _descriptor(setting: Setting) -> ParameterDescriptor:
    descriptor = ParameterDescriptor(
        type=_STRINGS.value
        if isinstance(setting.default, list)
        else Parameter.Type.from_parameter_value(setting.default).value,
        description=setting.description,
        additional_constraints=setting.constraints,
        read_only=setting.is_fixed,
    )
    low, high = setting.minimum, setting.maximum
    if low <= high < float("inf") or low > float("-inf"):
        if isinstance(setting.default, float):
            descriptor.floating_point_range = [FloatingPointRange(from_value=low, to_value=high)]
        else:
            descriptor.integer_range = [
                IntegerRange(from_value=int(low), to_value=int(min(high, _INT64_MAX)))
            ]
    return descriptor
