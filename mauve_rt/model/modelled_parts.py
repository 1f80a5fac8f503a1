"""The parts that a model describes, before any of their algorithms is written.

The kernel runs what is generated from the model in Python; actions do nothing, and no guard holds. So checks,
drawings and the timing analysis of a model take what the generated code will be, not a second picture of it.
"""

from collections.abc import Iterable
from types import ModuleType, SimpleNamespace
from typing import Any

from mauve_rt._kernel import PluginRegistry
from mauve_rt.model.plugins import PluginIndex
from mauve_rt.modelling.checks import abstract_class
from mauve_rt.modelling.generate import python_module
from mauve_rt.modelling.package_model import PackageModel
from mauve_rt.modelling.python import own_types, parts_module
from mauve_rt.modelling.schema import CoreModel, CppCall, ParameterModel, ResourceModel
from mauve_rt.parts import resources
from mauve_rt.parts.message_types import promise


def add_modelled_parts(
    models: Iterable[PackageModel], registry: PluginRegistry, index: PluginIndex
) -> PluginIndex:
    """Register the parts of models in the place of installed ones; returns the index of all others.

    Parts of models that these use, and that are not among them, are the installed ones.
    """
    given = {model.package: model for model in models}
    order = {one.package: one for model in given.values() for one in (*model.closure(), model)}
    for package, model in order.items():  # a shell before what needs it
        if package in given:
            _add(model, registry)
            index = index.without(package)
    return index


def _module(model: PackageModel) -> ModuleType:
    """The generated module, as if it were installed."""
    module = ModuleType(f"{parts_module(model.package)}.model")
    for one in model.closure():
        setattr(module, parts_module(one.package), SimpleNamespace(model=_module(one)))
    exec(python_module(model, has_imports=False), vars(module))  # noqa: S102 - its names were checked
    return module


def _add(model: PackageModel, registry: PluginRegistry) -> None:
    promise(own_types(model))
    module = _module(model)
    for name in model.content.shells:
        registry.shell(model.registered(name), getattr(module, name))
    for name, core in model.content.cores.items():
        for each in core.implementations:
            part = _without_algorithm(each, core, getattr(module, abstract_class(name)))
            registry.core(model.registered(each), part, model.registered(core.shell))
    for name, fsm in model.content.fsms.items():
        shell = model.core_of(fsm).shell
        registry.fsm(model.registered(name), getattr(module, name), model.registered(shell))
    for name, resource in model.content.resources.items():
        registry.resource(model.registered(name), _resource(name, resource))


def _without_algorithm(name: str, core: CoreModel, abstract: type[Any]) -> type[Any]:
    actions = {action: lambda _self: None for action in core.actions}
    guards = {guard: lambda _self: False for guard in core.guards}
    return type(name, (abstract,), {**actions, **guards, "__module__": abstract.__module__})


def _resource(name: str, model: ResourceModel) -> type[resources.Resource]:
    members: dict[str, Any] = {}
    for each, service in model.services.items():
        call = service.call.name if isinstance(service.call, CppCall) else service.call
        members[each] = resources.service(call)(lambda _self, *_args: None)
    members |= {each: _parameter(one) for each, one in model.parameters.items()}
    return type(name, (resources.Resource,), members)


def _parameter(one: ParameterModel) -> Any:
    return resources.parameter(
        one.default,
        unit=one.unit,
        description=one.description,
        minimum=one.minimum,
        maximum=one.maximum,
        required=one.required,
    )
