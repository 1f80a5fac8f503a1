"""The parameter services of an executor, in the place of rclpy's.

Components' properties are set by the kernel, as requests: all or none, refused with the kernel's reason, told
on ~/events. Who only asks, or changes the node's state, does not wait for that.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    GetParameterTypes,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)
from rclpy.callback_groups import CallbackGroup
from rclpy.lifecycle import LifecycleNode
from rclpy.parameter import Parameter
from rclpy.qos import qos_profile_parameters

from mauve_rt.control.requests import Outcome, Request
from mauve_rt.file_schema.words import did_you_mean, shown
from mauve_rt.model.declared_values import declared_value
from mauve_rt.model.schema import PropertyValue
from mauve_rt.model.steps import Step
from mauve_rt.node.executor.parameters import PROPERTY_TYPES, Parameters
from mauve_rt.node.shared.settings import QOS_OVERRIDES, no_qos_overrides

_ARRAYS = [kind for kind in Parameter.Type if kind.name.endswith("_ARRAY")]
_TYPE_NAMES = {kind: name for name, kind in PROPERTY_TYPES.items()}


class ParameterServices:
    """The six services; the node has to be made without rclpy's."""

    def __init__(
        self,
        node: LifecycleNode,
        parameters: Parameters,
        handle: Callable[[Request], Outcome],
        *,
        refusal: Callable[[str], str],
        control_group: CallbackGroup,
        query_group: CallbackGroup,
    ) -> None:
        """`handle` carries out a request and lets `parameters` follow it.

        `refusal` says why a parameter of the node's own is not set now, or nothing.
        """
        self._node = node
        self._lock = parameters.lock
        self._handle = handle
        self._refusal = refusal
        for service, name, callback, group in (
            (ListParameters, "list_parameters", self._list, query_group),
            (DescribeParameters, "describe_parameters", self._describe, query_group),
            (GetParameters, "get_parameters", self._get, query_group),
            (GetParameterTypes, "get_parameter_types", self._get_types, query_group),
            (SetParameters, "set_parameters", self._set, control_group),
            (SetParametersAtomically, "set_parameters_atomically", self._set_atomically, control_group),
        ):
            node.create_service(
                service, f"~/{name}", callback, qos_profile=qos_profile_parameters, callback_group=group
            )

    # ---- asking; a name that is not declared empties the reply, as rclcpp and rclpy have it

    def _list(self, request: Any, response: Any) -> Any:
        with self._lock:
            response.result = self._node.list_parameters(list(request.prefixes), request.depth)
        return response

    def _describe(self, request: Any, response: Any) -> Any:
        response.descriptors = self._of_each(request.names, self._node.describe_parameter)
        return response

    def _get(self, request: Any, response: Any) -> Any:
        response.values = self._of_each(
            request.names, lambda name: self._node.get_parameter_or(name).get_parameter_value()
        )
        return response

    def _get_types(self, request: Any, response: Any) -> Any:
        response.types = self._of_each(request.names, self._node.get_parameter_type)
        return response

    def _of_each(self, names: Sequence[str], look: Callable[[str], Any]) -> list[Any]:
        with self._lock:
            are_known = all(self._node.has_parameter(name) for name in names)
            return [look(name) for name in names] if are_known else []

    # ---- setting

    def _set(self, request: Any, response: Any) -> Any:
        response.results = [self._carry_out([message]) for message in request.parameters]
        return response

    def _set_atomically(self, request: Any, response: Any) -> Any:
        response.result = self._carry_out(request.parameters)
        return response

    def _carry_out(self, messages: Sequence[Any]) -> SetParametersResult:
        """All or none of them."""
        try:
            parameters = [self._declared(Parameter.from_parameter_msg(message)) for message in messages]
        except (ValueError, TypeError) as error:
            return _refused(f"no value of a parameter: {error}")
        of_components = [parameter for parameter in parameters if _is_property(parameter.name)]
        if not of_components:
            return self._set_own(parameters)
        if len(of_components) < len(parameters):
            text = "all or none cannot be had of properties and the executor's own parameters together"
            return _refused(f"{text}; set them apart")
        try:
            steps = tuple(_step(parameter) for parameter in parameters)
        except ValueError as error:
            return _refused(str(error))
        names = ", ".join(parameter.name for parameter in parameters)
        outcome = self._handle(Request(steps=steps, cause=f"parameters set: {names[:900]}"))
        return SetParametersResult(successful=True) if outcome.success else _refused(outcome.message)

    def _declared(self, parameter: Parameter) -> Parameter:
        """The parameter in its declared type: ros2cli sends the type that a value's text looks like.

        Raises:
            ValueError: text is declared, and what the text was is not known any longer.
        """
        with self._lock:
            if not self._node.has_parameter(parameter.name):
                return parameter
            declared = Parameter.Type(self._node.get_parameter_type(parameter.name))
        value, name = parameter.value, parameter.name
        if parameter.type_ in _ARRAYS and len(value) == 0 and declared in _ARRAYS:
            return Parameter(name, declared, [])
        if declared == Parameter.Type.STRING and isinstance(value, bool | int | float):
            raise ValueError(
                f"{shown(name)}: expected text, found {shown(value)}, as ros2 reads some text. "
                "Put the text in quotes of its own, as in \"'007'\""
            )
        value = declared_value(value, _TYPE_NAMES.get(declared, "str"))
        if declared == Parameter.Type.DOUBLE and type(value) is int:
            value = float(value)
        return parameter if value is parameter.value else Parameter(name, declared, value)

    def _set_own(self, parameters: Sequence[Parameter]) -> SetParametersResult:
        with self._lock:
            for parameter in parameters:
                if parameter.name.startswith(QOS_OVERRIDES):
                    return _refused(no_qos_overrides("executor"))
                if not self._node.has_parameter(parameter.name):
                    known = self._node.list_parameters([], 0).names
                    remedy = did_you_mean(parameter.name, known)
                    return _refused(f"there is no parameter {shown(parameter.name)}; {remedy}")
                if not self._is_present(parameter) and (reason := self._refusal(parameter.name)):
                    return _refused(reason)
            changed = [parameter for parameter in parameters if not self._is_present(parameter)]
            return self._node.set_parameters_atomically(changed)

    def _is_present(self, parameter: Parameter) -> bool:
        """Whether it has this value already, as in a parameter file that `ros2 param load` gives back."""
        present = self._node.get_parameter(parameter.name)
        return (present.type_, present.value) == (parameter.type_, parameter.value)


def _refused(reason: str) -> SetParametersResult:
    return SetParametersResult(successful=False, reason=reason)


def _is_property(name: str) -> bool:
    return "." in name and not name.startswith(QOS_OVERRIDES)


def _step(parameter: Parameter) -> Step:
    component, _, name = parameter.name.partition(".")
    value = parameter.value
    if not isinstance(value, bool | int | float | str):
        found = "nothing" if value is None else f"a {parameter.type_.name.lower().replace('_', ' ')}"
        expected = "expected true, false, a number or text"
        raise ValueError(f"property '{name}' of component '{component}': {expected}, found {found}")  # noqa: TRY004
    return Step("set_property", component, name, _yaml(value))


def _yaml(value: PropertyValue) -> str:
    """A value as YAML text that says exactly that."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        plain = (c if c.isprintable() and c not in '"\\' else f"\\U{ord(c):08x}" for c in value)
        return f'"{"".join(plain)}"'
    if isinstance(value, float) and not math.isfinite(value):
        return ".nan" if math.isnan(value) else f"{'-' if value < 0 else ''}.inf"
    return repr(value)
