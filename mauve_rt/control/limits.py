"""What requests may take, all of them together: settings of the executor. Knows no ROS."""

from dataclasses import dataclass

from mauve_rt._kernel import PluginRegistry
from mauve_rt.control.requests import Code, RefusalError, Request
from mauve_rt.model.resource_kinds import capacities, given_kinds, is_registered
from mauve_rt.model.schema import ComponentModel, ResourceModel

_TRACE_RECORD_BYTES = 48
_USUAL_TRACE_RECORDS = 2048


@dataclass(frozen=True, kw_only=True)
class RequestLimits:
    """Each is a parameter of the executor with the same name."""

    max_request_bytes: int = 262_144
    max_requested_bytes: int = 67_108_864
    max_requested_priority: int = 80

    def check_size(self, request: Request) -> None:
        """Whether a request is not too large as a whole.

        Raises:
            RefusalError: INVALID.
        """
        found = sum(len(text.encode("utf-8", "surrogatepass")) for text in request.texts())
        if found > self.max_request_bytes:
            remedy = "split it, or start the executor with a larger max_request_bytes"
            expected = f"expected at most {self.max_request_bytes:,} bytes, found {found:,}"
            raise RefusalError(Code.INVALID, f"the request is too large: {expected}; {remedy}")

    def check_priority(self, name: str, component: ComponentModel) -> None:
        """Whether a component may be added with its priority.

        Raises:
            RefusalError: INVALID.
        """
        if component.priority > self.max_requested_priority:
            remedy = "lower it, or start the executor with a higher max_requested_priority"
            expected = f"expected at most {self.max_requested_priority}, found {component.priority}"
            raise RefusalError(Code.INVALID, f"priority of component '{name}': {expected}; {remedy}")

    def check_bytes(self, name: str, wanted: int, taken: int) -> None:
        """Whether there is so much left of what requests may take.

        Raises:
            RefusalError: INVALID.
        """
        left = max(0, self.max_requested_bytes - taken)
        if wanted > left:
            remedy = "ask for less, remove what is not needed, or start the executor with a larger"
            expected = f"expected at most {left:,} bytes, found {wanted:,}"
            text = f"'{name}' needs more memory than requests may take: {expected}"
            raise RefusalError(Code.INVALID, f"{text}; {remedy} max_requested_bytes")


def bytes_of_component(component: ComponentModel) -> int:
    """What the thread of a component takes, at least."""
    return component.stack_bytes + (component.trace_records or _USUAL_TRACE_RECORDS) * _TRACE_RECORD_BYTES


def bytes_of_resource(resource: ResourceModel, registry: PluginRegistry) -> int:
    """What the values of a resource take, at least; the resources of plug-ins count for nothing."""
    kind = given_kinds().get(resource.kind)
    if kind is None:
        return 0
    told = {each.name: resource.parameters.get(each.name, each.initial) for each in kind.parameters}
    values = kind.values + sum(int(told[each.name]) * each.values_each for each in kind.parameters)
    depth = (resource.topic.qos.depth or 0) if resource.topic is not None and values else 0
    value_bytes = registry.value_bytes(resource.type, capacities(resource.parameters))
    if not value_bytes and not is_registered(resource.type, kind, registry):
        value_bytes = int(told.get("max_bytes", 0))
    return value_bytes * (values + depth)
