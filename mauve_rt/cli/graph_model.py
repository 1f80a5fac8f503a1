"""Drawings of a model: shells with ports, cores with algorithms, fsms; or one fsm."""

from collections.abc import Iterator

from mauve_rt.cli.graph_file import require
from mauve_rt.graph.drawing import Drawing, Edge, Node
from mauve_rt.graph.fsms import fsm_drawing
from mauve_rt.model.modelled_parts import modelled_parts
from mauve_rt.modelling.package_model import PackageModel
from mauve_rt.modelling.schema import CoreModel, FsmModel, ModelFile, PortModel, ShellModel
from mauve_rt.modelling.scope import Scope


def drawing_of_model(model: PackageModel) -> Drawing:
    """The parts of a model: an arrow says which part uses which."""
    content = model.content
    shells, cores = _with_used(content, model.scope)
    nodes = [
        *(_shell(name, one) for name, one in shells.items()),
        *(_core(name, one) for name, one in cores.items()),
        *(_fsm(name, one) for name, one in content.fsms.items()),
    ]
    edges = [_uses("core", name, "shell", one.shell) for name, one in cores.items()]
    edges += [_uses("fsm", name, "core", one.core) for name, one in content.fsms.items()]
    return Drawing(title=f"model of {content.package}", nodes=tuple(nodes), edges=tuple(edges))


def _with_used(content: ModelFile, scope: Scope) -> tuple[dict[str, ShellModel], dict[str, CoreModel]]:
    """Own shells and cores, and those of other models that own cores and fsms use."""
    cores = content.cores | {fsm.core: scope.cores[fsm.core] for fsm in content.fsms.values()}
    return content.shells | {one.shell: scope.shells[one.shell] for one in cores.values()}, cores


def fsm_of_model(model: PackageModel, name: str) -> Drawing:
    """One fsm of a model, as the kernel takes the code that is generated from it.

    Raises:
        ParameterError: there is no such fsm.
    """
    require(name, model.content.fsms, f"{model.path}: fsm")
    registry = modelled_parts([*model.closure(), model]).registry
    registered = model.registered(name)
    return fsm_drawing(registered, registry.describe_fsm(registered))


def _uses(kind: str, name: str, used_kind: str, used: str) -> Edge:
    return Edge(start=f"{kind} {name}", end=f"{used_kind} {used}", kind="use", tip=f"{name} uses {used}")


def _shell(name: str, one: ShellModel) -> Node:
    ports = [f"{port_name}: {_port(port)}" for port_name, port in one.ports.items()]
    return Node(key=f"shell {name}", kind="shell", lines=(name, *ports), tip=one.description or name)


def _port(port: PortModel) -> str:
    kinds = {"read": port.read_type, "write": port.write, "call": port.call, "event": port.event}
    return next(kind for kind, value in kinds.items() if value)


def _core(name: str, one: CoreModel) -> Node:
    return Node(key=f"core {name}", kind="core", lines=(name, *_methods(one)), tip=one.description or name)


def _methods(one: CoreModel) -> Iterator[str]:
    yield f"actions: {', '.join(one.actions)}"
    if one.guards:
        yield f"guards: {', '.join(one.guards)}"
    yield from (f"algorithm {name}" for name in one.implementations)


def _fsm(name: str, one: FsmModel) -> Node:
    return Node(
        key=f"fsm {name}", kind="fsm", lines=(name, ", ".join(one.states)), tip=one.description or name
    )
