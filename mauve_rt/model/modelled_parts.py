"""The parts that a model describes, before any of their algorithms is written.

The kernel runs what is generated from the model in Python; actions do nothing, and no guard holds. So checks,
drawings and the timing analysis of a model take what the generated code will be, not a second picture of it.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
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
from mauve_rt.parts.cores import Core, Shell
from mauve_rt.parts.message_types import promise


@dataclass(frozen=True)
class ModelledParts:
    """Parts of models in a registry, the index of installed parts, and the types that the models declare."""

    registry: PluginRegistry
    index: PluginIndex
    types: frozenset[str] = frozenset()


def modelled_parts(models: Sequence[PackageModel]) -> ModelledParts:
    """The parts of models in the place of installed ones.

    Parts of models that these use, and that are not among them, are the installed ones.
    """
    registry, index = PluginRegistry(), PluginIndex.installed()
    given = {model.package for model in models}
    modules: dict[str, object] = {}
    types: set[str] = set()
    for model in _used_first(models):
        types |= {*own_types(model)}
        promise(own_types(model))
        if model.package in given:
            modules[model.package] = _add(model, modules, registry)
            index = index.without(model.package)
        else:
            modules[model.package] = _bases(model)
    return ModelledParts(registry, index, frozenset(types))


def _used_first(models: Sequence[PackageModel]) -> Iterable[PackageModel]:
    return {one.package: one for model in models for one in (*model.closure(), model)}.values()


def _bases(model: PackageModel) -> object:
    """What parts of an installed package are, in C++ or in Python."""
    shells = dict.fromkeys(model.content.shells, Shell)
    return SimpleNamespace(**shells, **{abstract_class(name): Core for name in model.content.cores})


def _add(model: PackageModel, used: Mapping[str, object], registry: PluginRegistry) -> object:
    """Register the parts of a model; returns its module, for models that use it."""
    module = ModuleType(f"{parts_module(model.package)}.model")
    vars(module).update({parts_module(one): SimpleNamespace(model=part) for one, part in used.items()})
    exec(python_module(model, has_imports=False), vars(module))  # noqa: S102 - its names were checked
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
    return module


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
