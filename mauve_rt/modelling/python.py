"""How the code in Python writes what a model says."""

from collections.abc import Callable, Iterator
from typing import Any

from mauve_rt.modelling.checks import abstract_class
from mauve_rt.modelling.cpp import snake
from mauve_rt.modelling.durations import Duration
from mauve_rt.modelling.package_model import PackageModel
from mauve_rt.modelling.schema import CoreModel, CppCall, PortModel, PropertyModel
from mauve_rt.modelling.type_names import NUMBERS


def module(model: PackageModel, render: Callable[..., str], *, has_imports: bool = True) -> str:
    """The module with shells, abstract cores and fsms.

    Without imports it takes `other_parts` of a package `other` that it uses from its globals.
    """
    return render(
        model,
        "python/model.py",
        model=model,
        imports=[f"{parts_module(each)}.model" for each in _packages_of_parts(model)] if has_imports else [],
        abstract=abstract_class,
        part=_part,
        port=lambda one: _port(model, one),
        property_call=_property,
        duration=_duration,
        state_fields=state_fields,
        wcet=wcet,
        docstring=docstring,
    )


def _packages_of_parts(model: PackageModel) -> list[str]:
    """Of shells and cores that the model's own cores and fsms name."""
    cores = [*model.content.cores.values(), *map(model.core_of, model.content.fsms.values())]
    names = [*(core.shell for core in cores), *(fsm.core for fsm in model.content.fsms.values())]
    return sorted({name.partition("/")[0] for name in names if "/" in name})


def _part(name: str) -> str:
    """The class of a shell or of an abstract core."""
    package, separator, own = name.rpartition("/")
    return f"{parts_module(package)}.model.{own}" if separator else own


def docstring(value: str) -> str:
    """What a class or a module says of itself."""
    escaped = value.replace("\\", "\\\\").replace('"', '\\"')
    return f'"""{escaped}"""'


def parts_module(package: str) -> str:
    """The module of a package's parts: its messages have that of its own name."""
    return f"{package}_parts"


def index(model: PackageModel, mark: str) -> str:
    """The lines of the plug-in index."""
    return "".join(f"{line}\n" for line in (f"# {mark}", *_lines(model)))


def _lines(model: PackageModel) -> Iterator[str]:
    content, package = model.content, model.package
    for name in content.shells:
        yield f"shell; {package}/{name}; ; {parts_module(package)}.model:{name}"
    for core in content.cores.values():
        for name, one in core.implementations.items():
            target = one.module or f"{parts_module(package)}.{snake(name)}"
            yield f"core; {package}/{name}; {model.registered(core.shell)}; {target}:{name}"
    for name, resource in content.resources.items():
        target = resource.module or f"{parts_module(package)}.{snake(name)}"
        yield f"resource; {package}/{name}; ; {target}:{name}"
    for name, fsm in content.fsms.items():
        shell = model.registered(model.core_of(fsm).shell)
        yield f"fsm; {package}/{name}; {shell}; {parts_module(package)}.model:{name}"


def _property(one: PropertyModel) -> str:
    facts: dict[str, Any] = {
        "unit": one.unit or None,
        "description": one.description or None,
        "minimum": one.minimum,
        "maximum": one.maximum,
        "structural": tuple(one.read_by) or None,
    }
    given = [f"{key}={value!r}" for key, value in facts.items() if value is not None]
    default = float(one.default) if one.type == "float64" else one.default
    return f"api.property({', '.join([repr(default), *given])})"


def _port(model: PackageModel, one: PortModel) -> str:
    optional = ["optional=True"] if one.optional else []
    frames = {"frame": one.frame, "child_frame": one.child_frame}
    optional += [f"{key}={name!r}" for key, name in frames.items() if name]
    if one.event:
        return f"api.event_port({', '.join(optional)})"
    if one.call is not None:
        name = one.call.name if isinstance(one.call, CppCall) else one.call
        is_of_kernel = name.startswith("mauve_msgs/srv/")  # such as a transform_tree's, in C++
        return f"api.{'request_port' if is_of_kernel else 'call_port'}({name!r})"
    if one.read_type is not None:
        return f"api.read_port({', '.join([repr(model.registered_type(one.read_type.item)), *optional])})"
    written = repr(model.registered_type(one.write.item)) if one.write is not None else ""
    policies = {"on_commit": one.on_commit, "on_stop": one.on_stop}
    given = [f"{key}={policy!r}" for key, policy in policies.items() if policy]
    return f"api.write_port({', '.join([written, *given, *optional])})"


def _duration(one: Duration) -> str:
    if one.property_name:
        return f"api.times({one.factor}, self.shell.{one.property_name})"
    return "api.FOREVER" if one.is_forever else str(one.ns)


def state_fields(core: CoreModel) -> dict[str, str]:
    """What a core in Python hands over: numbers, text and lists of them; structs only those in C++ do."""
    return {name: of.text for name, of in core.state.items() if of.item in (*NUMBERS, "string")}


def wcet(core: CoreModel) -> dict[str, dict[str, int]]:
    """Worst-case execution times in ns, by implementation and method."""
    return {
        name: {method: time.ns for method, time in one.wcet.items()}
        for name, one in core.implementations.items()
        if one.wcet
    }


def own_types(model: PackageModel) -> list[str]:
    """By their registered names, the types that the model declares."""
    return [model.registered_type(name) for name in model.content.types]
