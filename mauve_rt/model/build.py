"""From a checked architecture file to the kernel's architecture."""

from collections.abc import Iterator
from contextlib import contextmanager

from mauve_rt._kernel import Architecture, PluginRegistry
from mauve_rt.errors import ArchitectureFileError, MauveError
from mauve_rt.model.architecture_file import ArchitectureModel
from mauve_rt.model.checks import Checks
from mauve_rt.model.plugins import PluginIndex, PluginLoader
from mauve_rt.model.yaml_file import Location


def build(
    model: ArchitectureModel, registry: PluginRegistry, *, index: PluginIndex | None = None
) -> Architecture:
    """Load the plug-ins a model names, check it against them and put the architecture together, unconfigured.

    Raises:
        ArchitectureFileError: with every problem found; nothing was built.
    """
    loader = PluginLoader(registry, PluginIndex.installed() if index is None else index)
    if problems := Checks(model, loader).problems():
        raise ArchitectureFileError(model.path, problems)
    architecture = Architecture(registry)
    for name in model.components:
        with _errors_at(model, ("components", name)):
            _add_component(architecture, model, name=name, loader=loader)
    for name, resource in model.resources.items():
        with _errors_at(model, ("resources", name)):
            architecture.add_resource(
                name,
                kind=resource.kind,
                type=resource.type,
                capacity=resource.capacity or 0,
                overwrite=resource.overwrite,
            )
            if resource.topic is not None and resource.topic.direction == "publish":
                architecture.publish(name)
    for connection in model.connections:
        with _errors_at(model, connection.location):
            architecture.connect(
                connection.component, connection.port, connection.resource, connection.service
            )
    return architecture


def configure(model: ArchitectureModel, architecture: Architecture) -> None:
    """Configure an architecture that was built from `model`.

    Raises:
        ArchitectureFileError: a component or resource refused; the architecture is unconfigured.
    """
    with _errors_at(model, ()):
        architecture.configure()


def allowed_cores(model: ArchitectureModel, component: str, index: PluginIndex) -> list[str]:
    """The cores a component takes beside the one the file gives it."""
    description = model.components[component]
    if isinstance(description.alternatives, list):
        return list(dict.fromkeys(description.alternatives))
    return [core for core in index.cores_of(description.shell) if core != description.core]


def _add_component(
    architecture: Architecture, model: ArchitectureModel, *, name: str, loader: PluginLoader
) -> None:
    component = model.components[name]
    alternatives = allowed_cores(model, name, loader.index)
    for core in alternatives:
        loader.require("core", core)
    architecture.add_component(
        name,
        shell=component.shell,
        core=component.core,
        fsm=component.fsm,
        priority=component.priority,
        cpus=list(component.cpus or ()),
        offset_ns=component.offset_ns,
        period_ns=component.period_ns,
        overrun=component.overrun,
        max_backlog=component.max_backlog,
        stack_bytes=component.stack_bytes,
        alternatives=alternatives,
        reconfigurable=component.reconfigurable,
    )
    for key, value in model.properties(name).items():
        with _errors_at(model, model.property_place(name, key)):
            architecture.set_property(name, key, value)


@contextmanager
def _errors_at(model: ArchitectureModel, place: Location) -> Iterator[None]:
    """Give an error of the kernel the place in the file that it is about."""
    try:
        yield
    except ArchitectureFileError:
        raise
    except MauveError as error:
        at = place or _place_of(model, error)
        is_section = len(at) == 2  # noqa: PLR2004 - ("components", NAME)
        problem = (model.key_problem if is_section else model.problem)(at, str(error), code=error.code)
        raise ArchitectureFileError(model.path, [problem]) from error


def _place_of(model: ArchitectureModel, error: MauveError) -> Location:
    """The place of what an error of the kernel names."""
    if error.component in model.components:
        place: Location = ("components", error.component)
        component = model.components[error.component]
        if error.code in ("loop_without_wait", "bad_fsm"):
            return (*place, "fsm")
        if error.code == "bad_period":
            return (*place, "period_ns" if component.period_ns else "fsm")
        is_property = error.element in component.properties
        return model.property_place(error.component, error.element) if is_property else place
    for name in (error.component, error.element):
        if name in model.resources:
            return ("resources", name)
    return ()
