"""What `mauve analyze` takes its model from: an architecture file, the node of an executor, or a bag."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mauve_rt.analysis.chains import Channel
from mauve_rt.analysis.machines import ExecutionTime, Machine
from mauve_rt.analysis.threads import machines_of
from mauve_rt.cli.bag_arguments import is_bag
from mauve_rt.model.threads import ThreadList

if TYPE_CHECKING:
    from mauve_rt._kernel import PluginRegistry
    from mauve_rt.model import ArchitectureModel
    from mauve_rt.model.schema import ResourceModel
    from mauve_rt.modelling.package_model import PackageModel
    from mauve_rt.trace.reading.trace import Trace


@dataclass(frozen=True)
class Analyzed:
    """What is analyzed."""

    components: list[Machine]
    threads: ThreadList | None
    """Beside the components; None: nothing tells of them."""
    model: "ArchitectureModel | None" = None
    """Of a file."""
    registry: "PluginRegistry | None" = None
    """With the parts of a file."""
    described: Sequence[Any] = ()
    """The components with their ports, as mauve_msgs/msg/ComponentInfo or with its fields."""
    channels: Sequence[Channel] = ()
    """What is known of the resources."""


def analyzed(target: str, models: Sequence[Path]) -> Analyzed:
    """The components of what is named, and the threads beside them."""
    path = Path(target)
    if not path.exists() and target.startswith("/"):
        return _of_node(target)
    return _of_bag(path) if is_bag(path) else _of_file(path, models)


def machines_beside(target: str) -> list[Machine]:
    """Components and threads of another executor on this computer, as threads that are not judged."""
    found = analyzed(target, ())
    name = target if not Path(target).exists() else Path(target).name
    threads = [] if found.threads is None else machines_of(found.threads.tasks, ())
    return [_beside(machine, name) for machine in (*found.components, *threads)]


def _beside(machine: Machine, executor: str) -> Machine:
    """With resources of its own; where the interpreter's lock decides, its times are not known."""
    return replace(
        machine,
        name=f"{executor}:{machine.name}",
        is_component=False,
        states=tuple(
            replace(state, time=ExecutionTime()) if machine.is_python else state for state in machine.states
        ),
        holds=(),
        undeclared_locks=(),
        clients=(),
        remedy=f"declare the times of {machine.name} in {executor}",
    )


def _of_file(path: Path, models: Sequence[Path]) -> Analyzed:
    from mauve_rt.model import build, load_architecture, previewed_states  # noqa: PLC0415
    from mauve_rt.model.component_machines import is_python_part  # noqa: PLC0415
    from mauve_rt.model.modelled_parts import modelled_parts  # noqa: PLC0415
    from mauve_rt.model.threads import thread_list, uses_of  # noqa: PLC0415
    from mauve_rt.modelling.loading import ModelLoader  # noqa: PLC0415

    model = load_architecture(path, runs_here=False)
    loader = ModelLoader(models)
    found = [loader.load(each) for each in models]
    parts = modelled_parts(found)
    in_python = {name: is_one for each in found for name, is_one in _modelled(each).items()}
    architecture = build(model, parts.registry, index=parts.index)
    states = previewed_states(model, architecture)
    kinds = {name: resource.kind for name, resource in model.resources.items()}
    machines = [
        Machine.of(
            part,
            states=states[part.name],
            is_python=is_python_part(part, parts.index, in_python),
            kinds=kinds,
        )
        for part in architecture.components()
    ]
    machines = [
        replace(machine, period_ns=machine.period_ns or model.components[machine.name].period_ns)
        for machine in machines
    ]
    if models:
        machines = [
            machine if machine.is_python else machine.without_locks(_wait_free(part, kinds))
            for machine, part in zip(machines, architecture.components(), strict=True)
        ]
    has_bounds = any(state.is_watched for machine in machines for state in machine.states)
    threads = thread_list(
        model.executor, uses_of(model), components=len(model.components), has_bounds=has_bounds
    )
    channels = [_channel(name, one, model.namespace) for name, one in model.resources.items()]
    return Analyzed(machines, threads, model, parts.registry, architecture.components(), channels)


def _channel(name: str, one: "ResourceModel", namespace: str) -> Channel:
    from mauve_rt.supervision.rule_names import full_name  # noqa: PLC0415

    topic = () if one.topic is None else (full_name(one.topic.name, namespace),)
    return Channel(
        name,
        one.kind,
        capacity=int(one.parameters.get("capacity", 0)),
        overwrites=bool(one.parameters.get("overwrite", False)),
        writers=topic if one.topic is not None and one.topic.direction == "subscribe" else (),
        topics=topic,
    )


def _wait_free(part: Any, kinds: Mapping[str, str]) -> set[str]:
    """Resources that a part reads without a lock when it is in C++, as the parts of a model will be."""
    locking = {port.resource for port in part.ports if port.kind != "read"}
    return {port.resource for port in part.ports if kinds.get(port.resource) == "shared_data"} - locking


def _of_node(node: str) -> Analyzed:
    from mauve_msgs.srv import ListComponents, ListTasks  # noqa: PLC0415
    from mauve_rt.cli.client import connected  # noqa: PLC0415
    from mauve_rt.trace.reading.architecture import ComponentInfo  # noqa: PLC0415

    with connected(first=True) as client:
        reply = client.call(ListComponents, f"{node}/list_components", ListComponents.Request())
        threads = client.call(ListTasks, f"{node}/list_tasks", ListTasks.Request()).list
    kinds = {resource.name: resource.kind for resource in reply.resources}
    channels = [
        Channel(
            one.name,
            one.kind,
            writers=(one.subscribes,) if one.subscribes else (),
            topics=tuple(filter(None, (one.publishes, one.subscribes))),
        )
        for one in reply.resources
    ]
    described = [*map(ComponentInfo.of_message, reply.components)]
    machines = _of_told(reply.components, kinds)
    return Analyzed(machines, _threads_of(threads), described=described, channels=channels)


def _threads_of(told: Any) -> ThreadList:
    """Of a mauve_msgs/msg/TaskList."""
    return ThreadList(int(told.wakeup_ns), int(told.overhead_ns), tuple(told.tasks))


def _of_bag(path: Path) -> Analyzed:
    import mauve_rt.trace  # noqa: PLC0415
    from mauve_rt.trace.errors import TraceError  # noqa: PLC0415

    trace = mauve_rt.trace.open(path)
    if not trace.architecture:
        raise TraceError(f"bag {path}: it does not tell the architecture; record it again with this version")
    return of_trace(trace)


def of_trace(trace: "Trace") -> Analyzed:
    """What a bag tells."""
    threads = None if trace.threads is None else _threads_of(trace.threads)
    return Analyzed(_of_told(trace.architecture, {}), threads, described=trace.architecture)


def _of_told(components: Iterable[Any], kinds: Mapping[str, str]) -> list[Machine]:
    from mauve_rt.model import PluginIndex  # noqa: PLC0415
    from mauve_rt.model.component_machines import component_machines  # noqa: PLC0415

    return component_machines(components, kinds, PluginIndex.installed())


def _modelled(model: "PackageModel") -> dict[str, bool]:
    """The parts of a model by their names, and whether they are said to be in Python."""
    content = model.content
    parts = dict.fromkeys((*content.shells, *content.fsms), False)
    for core in content.cores.values():
        parts |= {name: bool(one.module) for name, one in core.implementations.items()}
    return {model.registered(name): is_python for name, is_python in parts.items()}
