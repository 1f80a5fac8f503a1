"""The parts that a model describes, before any of their algorithms is written.

The kernel runs what is generated from the model in Python; actions do nothing, and no guard holds. So checks,
drawings and the timing analysis of a model take what the generated code will be, not a second picture of it.
"""

from types import ModuleType
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


def add_modelled_parts(model: PackageModel, registry: PluginRegistry, index: PluginIndex) -> PluginIndex:
    """Register the parts of a model in the place of installed ones; returns the index of all others."""
    promise(own_types(model))
    module = ModuleType(f"{parts_module(model.package)}.model")
    exec(python_module(model), vars(module))  # noqa: S102 - its names were checked
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
    return index.without(model.package)


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
