"""Properties of components as parameters of the node, `<component>.<property>`: what the kernel has."""

import copy
import math
import threading

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.lifecycle import LifecycleNode
from rclpy.parameter import Parameter

from mauve_rt._kernel import PropertyDescription
from mauve_rt.control.runtime import Runtime

PROPERTY_TYPES = {
    "bool": Parameter.Type.BOOL,
    "int": Parameter.Type.INTEGER,
    "float": Parameter.Type.DOUBLE,
    "str": Parameter.Type.STRING,
}
"""Types of properties as ROS has them."""
_Present = dict[str, tuple[PropertyDescription, ParameterDescriptor]]
_INT64 = (-(2**63), 2**63 - 1)
_PROTECTED = "protected (reconfigurable: false): to be set by the architecture file or at the start"
_STRUCTURAL = "structural: read by {} when configured; set it in one ~/reconfigure with the replacement of {}"


class Parameters:
    """The declared ones follow the architecture. Of the node's own parameters it knows nothing.

    | member      | written by             | guarded by |
    | ----------- | ---------------------- | ---------- |
    | `_declared` | follow(): any thread   | `lock`     |

    Who looks at the node's parameters from another thread holds `lock`: rclpy has none of its own.
    """

    def __init__(self, node: LifecycleNode, runtime: Runtime) -> None:
        self._node = node
        self._runtime = runtime
        self._declared: dict[str, ParameterDescriptor] = {}
        self.lock = threading.RLock()

    def follow(self) -> None:
        """Declare, change and undeclare parameters until they are what the architecture has now."""
        with self.lock:
            present: _Present = {
                f"{part.name}.{item.name}": (item, _descriptor(item, is_protected=not part.reconfigurable))
                for part in self._runtime.components()
                for item in part.properties
            }
            for name, descriptor in list(self._declared.items()):
                if name not in present or present[name][1] != descriptor or self._is_outdated(name, present):
                    self._undeclare(name)
            changed = []
            for name, (item, descriptor) in present.items():
                if name not in self._declared:
                    self._declare(name, item, descriptor)
                elif self._differs(name, item):
                    changed.append(Parameter(name, PROPERTY_TYPES[item.type], item.value))
            if changed:
                self._node.set_parameters_atomically(changed)

    def _is_outdated(self, name: str, present: _Present) -> bool:
        """Whether it has another value now and is read-only to ROS: then it is declared anew."""
        item, descriptor = present[name]
        return descriptor.read_only and self._differs(name, item)

    def _differs(self, name: str, item: PropertyDescription) -> bool:
        # By repr, in which a NaN is equal to itself.
        return repr(self._node.get_parameter(name).value) != repr(item.value)

    def _declare(self, name: str, item: PropertyDescription, descriptor: ParameterDescriptor) -> None:
        # rclpy writes name and type into the one it gets. What the command line says, the value has in it.
        own = copy.copy(descriptor)
        self._node.declare_parameter(name, item.value, own, ignore_override=True)
        self._declared[name] = descriptor

    def _undeclare(self, name: str) -> None:
        """By way of one that may be unset: undeclare_parameter() tells /parameter_events nothing."""
        if self._declared[name].read_only:
            self._node.describe_parameter(name).read_only = False  # its own; else it is kept for ever
        self._node.set_descriptor(name, ParameterDescriptor(dynamic_typing=True))
        self._node.set_parameters([Parameter(name)])
        del self._declared[name]


def _descriptor(item: PropertyDescription, *, is_protected: bool) -> ParameterDescriptor:
    unit = f"[{item.unit}]" if item.unit else ""
    parts = " and ".join(f"the {part}" for part in item.structural)
    constraint = _STRUCTURAL.format(parts, parts) if parts else ""
    descriptor = ParameterDescriptor(
        type=PROPERTY_TYPES[item.type].value,
        description=" ".join(word for word in (item.description, unit) if word),
        additional_constraints=_PROTECTED if is_protected else constraint,
        read_only=is_protected or bool(parts),
    )
    low = -math.inf if item.minimum is None else item.minimum
    high = math.inf if item.maximum is None else item.maximum
    # A default may lie outside of the range, and rclpy would not declare it.
    is_limited = (item.minimum is not None or item.maximum is not None) and _is_within(item.value, low, high)
    if is_limited and item.type == "float":
        descriptor.floating_point_range = [FloatingPointRange(from_value=low, to_value=high)]
    elif is_limited and item.type == "int":
        from_value = _INT64[0] if low < _INT64[0] else math.ceil(low)
        to_value = _INT64[1] if high >= _INT64[1] else math.floor(high)
        descriptor.integer_range = [IntegerRange(from_value=from_value, to_value=to_value)]
    return descriptor


def _is_within(value: object, low: float, high: float) -> bool:
    return isinstance(value, int | float) and low <= value <= high
