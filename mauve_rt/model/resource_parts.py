"""How the kernel makes the resources of an architecture file."""

from typing import Any

from mauve_rt._kernel import PluginRegistry, ResourceDescription
from mauve_rt.model.schema import ResourceModel
from mauve_rt.parts.message_types import message_class


def resource_part(resource: ResourceModel, registry: PluginRegistry) -> dict[str, Any]:
    """How a resource is added: serialized where its type is a message that no library registered."""
    from mauve_rt.parts.resources import RingBuffer, SharedData  # noqa: PLC0415 - they need the model themselves

    kind, name, capacity = resource.kind, resource.type, resource.capacity or 0
    if kind in ("shared_data", "ring_buffer") and name not in registry.names("type") and message_class(name):
        if kind == "shared_data":
            return {"resource": SharedData(name, max_bytes=resource.max_bytes)}
        ring: RingBuffer[Any] = RingBuffer(
            name, capacity=capacity, overwrite=resource.overwrite, max_bytes=resource.max_bytes
        )
        return {"resource": ring}
    return {
        "kind": kind,
        "type": name,
        "capacity": capacity,
        "overwrite": resource.overwrite,
        "max_readers": resource.max_readers,
        **({"timeout_ns": round(resource.service.timeout_ms * 1e6)} if resource.service else {}),
    }


def describe_resource(resource: ResourceModel, registry: PluginRegistry) -> ResourceDescription:
    """Its services, before there is any.

    Raises:
        MauveError: there is no such type, or no such resource of it.
    """
    part = resource_part(resource, registry)
    if "resource" in part:
        return registry.describe_resource(part["resource"])
    return registry.describe_resource(resource.kind, resource.type)
