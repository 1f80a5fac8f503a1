"""The types of topics, services and actions that resources are bound to, and whether they can be loaded."""

from collections.abc import Collection, Iterator

from mauve_rt._kernel import Architecture, ResourceDescription
from mauve_rt.errors import MauveError, Problem
from mauve_rt.model import ArchitectureModel
from mauve_rt.model.schema import ResourceModel


def bound_types(resource: ResourceModel, described: ResourceDescription) -> Iterator[tuple[str, str]]:
    """The key in the file that binds the resource, and the ROS type."""
    if resource.topic is not None:
        yield "topic", resource.topic_type
    if resource.service is not None:
        offered = {each.name: each.type for each in described.services}
        yield "service", offered.get(resource.service.offers or "", described.type)
    if resource.action is not None:
        yield "action", resource.type


def type_problems(
    model: ArchitectureModel, architecture: Architecture, promised: Collection[str]
) -> Iterator[Problem]:
    """Types that an executor could not load, in its words. What a model promises need not exist yet."""
    described = {resource.name: resource for resource in architecture.resources()}
    for name, resource in model.resources.items():
        for key, type_name in bound_types(resource, described[name]):
            if type_name in promised:
                continue
            from mauve_rt._bridge import require_type_support  # noqa: PLC0415 - loads libraries of ROS

            try:
                require_type_support(type_name)
            except MauveError as error:
                yield model.key_problem(("resources", name, key), f"resource '{name}': {error}")
