"""How the kernel makes the resources of an architecture file."""

from typing import Any

from mauve_rt._kernel import PluginRegistry, ResourceDescription
from mauve_rt.model.resource_kinds import has_key, is_registered
from mauve_rt.model.schema import ResourceModel
from mauve_rt.parts.message_types import action_class, is_message, is_promised

_IN_PLACE, _STAND_IN = "latest_value", "shared_data"
"""The kind that needs a struct in C++, and the one that checks take where a model only promises it."""


def resource_part(resource: ResourceModel, registry: PluginRegistry) -> dict[str, Any]:
    """How a resource is added: serialized where its type is a message that no library registered."""
    from mauve_rt.parts.resources import DataOfKind  # noqa: PLC0415 - it needs the model itself

    kind, name, parameters = resource.kind, resource.type, {**resource.parameters}
    for parameter in registry.resource_kind(kind).parameters:
        section, _, key = parameter.file_key.rpartition(".")
        of_section = getattr(getattr(resource, section, None), key, None) if section else None
        if of_section is not None:
            parameters[parameter.name] = round(of_section * 1e6)  # service.timeout_ms, action.answer_ms
    of_kind = registry.resource_kind(kind)
    if has_key(of_kind, "max_bytes") and not is_registered(name, of_kind, registry) and _is_known(name):
        return {"resource": DataOfKind(kind, name, **parameters)}
    if kind == _IN_PLACE and name not in registry.names("type") and is_promised(name):
        # Before the struct is generated: the same services. The file was checked for its limits.
        return {"resource": DataOfKind(_STAND_IN, name)}
    return {"kind": kind, "type": name, **parameters}


def _is_known(name: str) -> bool:
    """Whether Python knows the message or the action."""
    return is_message(name) or action_class(name) is not None


def describe_resource(resource: ResourceModel, registry: PluginRegistry) -> ResourceDescription:
    """Its services, before there is any.

    Raises:
        MauveError: there is no such type, or no such resource of it.
    """
    part = resource_part(resource, registry)
    if "resource" in part:
        return registry.describe_resource(part["resource"])
    return registry.describe_resource(resource.kind, resource.type)
