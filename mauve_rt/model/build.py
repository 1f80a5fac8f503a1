"""From a checked architecture file to the kernel's architecture."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from mauve_rt._kernel import Architecture, DescribedState, PluginRegistry, Transaction
from mauve_rt.errors import ArchitectureFileError, MauveError
from mauve_rt.file_schema.yaml_file import Location
from mauve_rt.model.architecture_file import ArchitectureModel, load_architecture
from mauve_rt.model.checks import Checks
from mauve_rt.model.plugins import PluginIndex, PluginLoader
from mauve_rt.model.resource_parts import resource_part
from mauve_rt.model.schema import ComponentModel


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
    transaction, places = _deployment(model, loader)
    architecture = Architecture(registry)
    with _errors_at(model, *places):
        architecture.commit(transaction)
    return architecture


def open_architecture(path: str | Path, registry: PluginRegistry | None = None) -> Architecture:
    """The architecture of a file, configured and ready for a `Deployer` or a `Simulation`.

    Raises:
        ArchitectureFileError: the file, or a plug-in that it names, cannot be used; `problems` has all.
    """
    model = load_architecture(Path(path))
    architecture = build(model, PluginRegistry() if registry is None else registry)
    configure(model, architecture)
    return architecture


def _deployment(model: ArchitectureModel, loader: PluginLoader) -> tuple[Transaction, list[Location]]:
    """The transaction that makes an empty architecture that of the file, and the place of each step."""
    transaction = Transaction()
    places: list[Location] = []
    for name in model.components:
        places.append(("components", name))
        with _errors_at(model, places[-1]):
            add_component_step(transaction, model, name, loader)
    for name in model.resources:
        places.append(("resources", name))
        add_resource_step(transaction, model, name, loader.registry)
    for connection in model.connections:
        places.append(connection.location)
        transaction.connect(connection.component, connection.port, connection.resource, connection.service)
    return transaction, places


def configure(model: ArchitectureModel, architecture: Architecture) -> None:
    """Configure an architecture that was built from `model`.

    Raises:
        ArchitectureFileError: a component or resource refused; the architecture is unconfigured.
    """
    for name, resource in model.resources.items():
        if resource.log_level is not None:
            architecture.set_log_level(name, resource.log_level)
    with _errors_at(model):
        architecture.configure()


def previewed_states(model: ArchitectureModel, architecture: Architecture) -> dict[str, list[DescribedState]]:
    """The states of each component's fsm, of an architecture built from `model`; nothing is configured.

    Raises:
        ArchitectureFileError: an fsm cannot be so.
    """
    states = {}
    for name in model.components:
        with _errors_at(model, ("components", name)):
            states[name] = architecture.previewed_states(name)
    return states


_ANY_CORE = "*"  # to the kernel; what is installed may be another thing every day


def allowed_parts(component: ComponentModel, kind: str, loader: PluginLoader) -> list[str]:
    """The cores, fsms or shells (`kind`) that a component takes: its own, its fallback, its alternatives."""
    own = {"core": component.core, "fsm": component.fsm, "shell": component.shell}[kind]
    fallback = [component.fallback] if kind == "core" and component.fallback is not None else []
    if isinstance(component.alternatives, list):
        others = [name for name in component.alternatives if loader.has(kind, name)]
    else:
        others = loader.index.names(kind)
    return list(dict.fromkeys([own, *fallback, *others]))


def add_component_step(
    transaction: Transaction, model: ArchitectureModel, name: str, loader: PluginLoader
) -> None:
    """Let a transaction add a component that `model` describes; it was checked against its plug-ins.

    Raises:
        MauveError: an alternative cannot be loaded.
    """
    component = model.components[name]
    transaction.add_component(
        name,
        component.shell,
        component.core,
        component.fsm,
        **_settings(component, loader),
        properties=model.properties(name),
        fallback=component.fallback or "",
        frames=model.frames(name),
    )


def add_resource_step(
    transaction: Transaction, model: ArchitectureModel, name: str, registry: PluginRegistry
) -> None:
    """Let a transaction add a resource that `model` describes."""
    resource = model.resources[name]
    direction = resource.topic.direction if resource.topic is not None else ""
    frame, child_frame = model.resource_frames(name)
    transaction.add_resource(
        name,
        **resource_part(resource, registry),
        topic=direction,
        longest_hold_ns=resource.longest_hold_ns or 0,
        frame=frame,
        child_frame=child_frame,
    )


def _settings(component: ComponentModel, loader: PluginLoader) -> dict[str, Any]:
    """What adding a component by file and by transaction have in common; loads the alternatives."""
    installed = not isinstance(component.alternatives, list)
    for kind in ("core", "fsm", "shell"):
        for name in allowed_parts(component, kind, loader):
            plugin = loader.index.find(kind, name)
            # Of all that is installed only the cores that fit now; others when somebody asks for them.
            if not installed or (plugin is not None and kind == "core" and plugin.shell == component.shell):
                loader.require(kind, name)
    return {
        **component.task_settings(),
        "alternatives": [_ANY_CORE]
        if installed
        else [core for core in component.alternatives if loader.has("core", core) and core != component.core],
        "reconfigurable": component.reconfigurable,
    }


@contextmanager
def _errors_at(model: ArchitectureModel, *places: Location) -> Iterator[None]:
    """Give an error of the kernel the place in the file that it is about; `places`: those of its steps."""
    try:
        yield
    except ArchitectureFileError:
        raise
    except MauveError as error:
        step: int = getattr(error, "step", 0)
        place = places[max(step, 1) - 1] if places else ()
        at = _place_of(model, error) if place in ((), ("components", error.component)) else place
        is_section = len(at) == 2  # noqa: PLR2004 - ("components", NAME)
        text = str(error).removeprefix(f"step {step} ({getattr(error, 'step_name', '')}): ")
        problem = (model.key_problem if is_section else model.problem)(at, text, code=error.code)
        raise ArchitectureFileError(model.path, [problem]) from error


def _place_of(model: ArchitectureModel, error: MauveError) -> Location:
    """The place of what an error of the kernel names."""
    if error.component in model.components:
        place: Location = ("components", error.component)
        component = model.components[error.component]
        if error.found in component.states:
            return (*place, "states", error.found)
        if error.code in ("loop_without_wait", "bad_fsm"):
            return (*place, "fsm")
        if error.code == "bad_period":
            return (*place, "period_ns" if component.period_ns else "fsm")
        name = error.element.removeprefix("property ")
        return model.property_place(error.component, name) if name in component.properties else place
    for name in (error.component, error.element):
        if name in model.resources:
            return ("resources", name)
    return ()
