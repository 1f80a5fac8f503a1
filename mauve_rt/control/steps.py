"""The steps of a request, checked one after another and made into a transaction. Knows no ROS.

What a step before will have made of the architecture counts: step 3 may connect what step 1 adds. What needs
the kernel to tell (states, wiring, whether parts fit), the kernel tells at the commit.

What is loaded for a name that comes by request, and where the name has to be listed before:

| name                               | listed in the ament index as        | loaded                     |
| ---------------------------------- | ----------------------------------- | -------------------------- |
| core, fsm, shell, kind of resource | mauve_rt_plugins                    | its library, its module    |
| type of a resource                 | the same, else in rosidl_interfaces | its library, package.msg   |
| type of a topic to record          | rosidl_interfaces                   | package.msg                |
| type of a service                  | rosidl_interfaces                   | package.srv, type supports |
"""

from collections.abc import Collection, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from mauve_rt._kernel import (
    ComponentDescription,
    PortDescription,
    PropertyDescription,
    ResourceDescription,
    ShellDescription,
    Transaction,
)
from mauve_rt.control.limits import RequestLimits, bytes_of_component, bytes_of_resource
from mauve_rt.control.requests import Code, RefusalError, code_of
from mauve_rt.control.runtime import Runtime
from mauve_rt.errors import ArchitectureFileError, MauveError, one_line
from mauve_rt.file_schema.words import did_you_mean, shown, some
from mauve_rt.model.architecture_file import ArchitectureModel
from mauve_rt.model.build import add_component_step, add_resource_step, allowed_parts
from mauve_rt.model.bumpless import read_bumpless
from mauve_rt.model.checks import Checks, property_mismatch
from mauve_rt.model.declared_values import read_declared
from mauve_rt.model.fragment import fragment
from mauve_rt.model.message_shapes import REMEDY, mismatches
from mauve_rt.model.plugins import SOURCE_IT, PluginLoader
from mauve_rt.model.probation import read_probation
from mauve_rt.model.resource_parts import describe_resource
from mauve_rt.model.schema import ComponentModel, PropertyValue, ResourceModel
from mauve_rt.model.step_kinds import STEP_KINDS, StepKind
from mauve_rt.model.steps import Step
from mauve_rt.yaml.text import YamlError, read_yaml

_TOLD_PROBLEMS = 10
_MAX_BUDGET_US = 1_000_000


@dataclass
class _Sketch:
    """A component as the steps so far will have left it."""

    model: ComponentModel
    properties: dict[str, PropertyDescription] = field(default_factory=dict)
    is_new: bool = False


@dataclass
class Bound:
    """Resources that a plan binds to topics or services, and resources that it removes."""

    added: dict[str, ResourceModel] = field(default_factory=dict)
    described: dict[str, ResourceDescription] = field(default_factory=dict)
    removed: set[str] = field(default_factory=set)


class Plan:
    """The transaction that a request asks for, and what it will have added and removed."""

    def __init__(
        self,
        steps: Iterable[Step],
        runtime: Runtime,
        parts: Iterable[ComponentDescription],
        *,
        limits: RequestLimits,
        taken: Mapping[str, int],
        transaction: Any = None,
    ) -> None:
        """Check and translate every step for the present components; loads the plug-ins that they name.

        `transaction` takes the steps in the place of the kernel's, by its functions' names.
        `taken`: bytes that requests took before, by name of what they added; `self.taken`, those afterwards.

        Raises:
            RefusalError: naming the step, where there are several.
        """
        self.transaction = transaction if transaction is not None else Transaction()
        self.added: dict[str, ComponentModel] = {}
        self.removed: set[str] = set()
        self.bound = Bound()
        self.taken = {**taken}
        self._limits = limits
        self._runtime = runtime
        self._sketches: dict[str, _Sketch] = {}
        for part in parts:
            if (model := runtime.declared(part.name)) is not None:
                self._sketches[part.name] = _sketch_of(part, model)
        self._resources = set(runtime.resources())
        all_steps = tuple(steps)
        for number, step in enumerate(all_steps, start=1):
            where = f"step {number} ({step}): " if len(all_steps) > 1 else ""
            try:
                self._take(step)
            except RefusalError as refusal:
                raise RefusalError(refusal.code, f"{where}{refusal}") from None
            except MauveError as error:
                raise RefusalError(code_of(error), one_line(f"{where}{_words(error)}")) from None

    def _take(self, step: Step) -> None:
        kind = STEP_KINDS[step.kind]
        match kind.target:
            case "new component":
                self._add_component(step)
            case "new resource":
                self._add_resource(step)
            case "resource":
                self._change_resource(step, kind)
            case "all":
                self._change_all(step)
            case "component" if kind.name in ("core", "fsm", "shell"):
                self._replace(step, kind.name)
            case "component":
                self._change_component(step, kind)

    def _change_component(self, step: Step, kind: StepKind) -> None:
        component, name = self._component(step), step.target
        if kind.value == "promotion" and isinstance(self.transaction, Transaction):
            self._promote(step)
            return
        self.transaction.add(step.kind, name, step.name, _kernel_value(step, kind, component))
        if kind.removes:
            del self._sketches[name]
            self.removed.add(name)
            self.taken.pop(name, None)
            self.added.pop(name, None)

    def _component(self, step: Step) -> _Sketch:
        """The component that a step is about.

        Raises:
            RefusalError: UNKNOWN_COMPONENT or NOT_RECONFIGURABLE.
        """
        name = step.target
        sketch = self._sketches.get(name)
        if sketch is None:
            remedy = did_you_mean(name, self._sketches)
            text = f"component {shown(name)} is unknown; the executor has {', '.join(self._sketches)}"
            raise RefusalError(
                Code.UNKNOWN_COMPONENT, f"{text}; {remedy}" if remedy.startswith("did") else text
            )
        if not sketch.model.reconfigurable and not sketch.is_new:
            text = f"component '{name}' is protected: it was declared with reconfigurable: false"
            raise RefusalError(Code.NOT_RECONFIGURABLE, text)
        return sketch

    def _change_all(self, step: Step) -> None:
        if step.target:
            text = f"a step of kind '{step.kind}' is for all components; found target {shown(step.target)}"
            raise RefusalError(Code.INVALID, text)
        self.transaction.add(step.kind)

    def _replace(self, step: Step, kind: str) -> None:
        sketch = self._component(step)
        with self._runtime.loading() as loader:
            allowed = allowed_parts(sketch.model, kind, loader)
            if step.name not in allowed:
                raise _undeclared(step, kind, allowed, loader)
            loader.require(kind, step.name)
        if step.kind == "shadow":
            budget_ns, is_fresh = _shadow_options(step)
            self.transaction.shadow(step.target, step.name, budget_ns, fresh=is_fresh)
        elif step.value and kind == "core":
            self._replace_with_options(step, sketch)
        else:
            self.transaction.add(step.kind, step.target, step.name)
        if kind == "shell":
            shell = self._runtime.registry.describe_shell(step.name)
            _check_structs(shell)
            sketch.properties = {item.name: item for item in shell.properties}

    def _replace_with_options(self, step: Step, sketch: _Sketch) -> None:
        subject = f"step {step.kind} of '{step.target}'"
        value = _yaml(step, subject)
        try:
            trial = dict(value) if isinstance(value, dict) else value
            given = trial.pop("bumpless", None) if isinstance(trial, dict) else None
            bumpless = read_bumpless(given) if given is not None else None
            probation = read_probation(trial) if trial or bumpless is None else None
            ports = self._ports(step.target, sketch)
            if probation is not None:
                probation.require_outputs({step.target: ports})
        except ValueError as error:
            raise RefusalError(Code.INVALID, f"{subject}: {error}") from None
        if not isinstance(self.transaction, Transaction):
            what = "put a core on probation" if probation is not None else "make a bumpless change"
            text = f"{subject}: a rule of the executor cannot {what}"
            raise RefusalError(Code.UNSUPPORTED, f"{text}; give the rule `in: supervisor`")
        self.transaction.replace_core(
            step.target,
            step.name,
            None if probation is None else probation.options(step.target, ports),
            None if bumpless is None else bumpless.options(),
        )

    def _ports(self, component: str, sketch: _Sketch) -> Collection[PortDescription]:
        parts = self._runtime.components()
        shell = next((part.shell for part in parts if part.name == component), sketch.model.shell)
        return self._runtime.registry.describe_shell(shell).ports

    def _promote(self, step: Step) -> None:
        subject = f"step {step.kind} of '{step.target}'"
        value = _yaml(step, subject) if step.value else {}
        if not isinstance(value, dict) or not set(value) <= {"bumpless", "fresh"}:
            expected = "expected {bumpless: {outputs: ..., within_s: S}, fresh: true} or nothing"
            raise RefusalError(Code.INVALID, f"{subject}: {expected}, found {shown(step.value)}")
        try:
            bumpless = read_bumpless(value["bumpless"]).options() if "bumpless" in value else None
        except ValueError as error:
            raise RefusalError(Code.INVALID, f"{subject}: {error}") from None
        self.transaction.promote(step.target, bumpless, fresh=_is_fresh(value, subject))

    def _add_component(self, step: Step) -> None:
        name = step.target
        self._check_name(step)
        model = self._fragment(step, "components")
        self._limits.check_priority(name, model.components[name])
        self._take_bytes(name, bytes_of_component(model.components[name]))
        with self._runtime.loading() as loader:
            if problems := Checks(model, loader).problems():
                raise ArchitectureFileError(model.path, problems)
            add_component_step(self.transaction, model, name, loader)
        component = model.components[name]
        shell = self._runtime.registry.describe_shell(component.shell)
        properties = {item.name: item for item in shell.properties}
        self._sketches[name] = _Sketch(component, properties, is_new=True)
        self.added[name] = component

    def _add_resource(self, step: Step) -> None:
        name = step.target
        self._check_name(step)
        model = self._fragment(step, "resources")
        resource = model.resources[name]
        with self._runtime.loading() as loader:
            with suppress(MauveError):  # which the checks tell in their words
                loader.require_type(resource.type)
            self._take_bytes(name, bytes_of_resource(resource, loader.registry))  # before there is any of it
            if problems := Checks(model, loader).problems():
                raise ArchitectureFileError(model.path, problems)
            add_resource_step(self.transaction, model, name, loader.registry)
            if resource.ros_names:
                self.bound.added[name] = resource
                self.bound.described[name] = describe_resource(resource, loader.registry)
        self._resources.add(name)

    def _change_resource(self, step: Step, kind: StepKind) -> None:
        self.transaction.add(step.kind, step.target, step.name, _kernel_value(step, kind))
        if not kind.removes:
            return
        self._resources.discard(step.target)
        self.taken.pop(step.target, None)
        if self.bound.added.pop(step.target, None) is None:
            self.bound.removed.add(step.target)

    def _take_bytes(self, name: str, wanted: int) -> None:
        self._limits.check_bytes(name, wanted, sum(self.taken.values()))
        self.taken[name] = wanted

    def _check_name(self, step: Step) -> None:
        if step.target in self._sketches or step.target in self._resources:
            what = "component" if step.target in self._sketches else "resource"
            text = (
                f"there is a {what} '{step.target}' already; take another name, or remove it in a step before"
            )
            raise RefusalError(Code.INVALID, text)

    def _fragment(self, step: Step, section: str) -> ArchitectureModel:
        return fragment(self._runtime.model, step.value, section=section, name=step.target)


def _sketch_of(part: ComponentDescription, model: ComponentModel) -> _Sketch:
    return _Sketch(model, {item.name: item for item in part.properties})


def _undeclared(step: Step, kind: str, allowed: list[str], loader: PluginLoader) -> RefusalError:
    takes = f"component '{step.target}' takes {some(allowed)}"
    if loader.has(kind, step.name):
        text = f"{kind} '{step.name}' is installed, but not declared: {takes}"
        return RefusalError(Code.UNDECLARED_CORE, f"{text}; name it among its alternatives in the file")
    if package := loader.missing_package(step.name):
        text = f"{kind} {shown(step.name)}: {package}; {SOURCE_IT} before the executor starts"
        return RefusalError(Code.UNKNOWN_CORE, text)
    return RefusalError(Code.UNKNOWN_CORE, f"{kind} {shown(step.name)} is not installed; {takes}")


def _check_structs(shell: ShellDescription) -> None:
    """Refuse a shell in which a C++ struct is not the ROS message whose name it bears."""
    for port in shell.ports:
        for found in mismatches(port.messages):
            text = f"shell '{shell.name}', port '{port.name}': {found.what}"
            facts = f"expected {found.expected}, found {found.found}; {REMEDY}"
            raise RefusalError(Code.PREPARE_FAILED, f"{text}: {facts}")


def _words(error: MauveError) -> str:
    """An error without the place in a file, where it is about a step's own text."""
    if isinstance(error, ArchitectureFileError):
        told = [problem.text() for problem in error.problems[:_TOLD_PROBLEMS]]
        more = len(error.problems) - len(told)
        return "; ".join([*told, f"and {more:,} more"] if more else told)
    return str(error)


def _yaml(step: Step, subject: str, type_name: str = "") -> object:
    """The value of a step; of the declared type, if one is named."""
    try:
        return read_declared(step.value, type_name) if type_name else read_yaml(step.value)
    except YamlError:
        raise RefusalError(Code.INVALID, f"{subject}: the value {shown(step.value)} is not YAML") from None


def _shadow_options(step: Step) -> tuple[int, bool]:
    """The value of a step shadow: budget in ns, and whether the candidate is fresh."""
    subject = f"step {step.kind} of '{step.target}'"
    value = _yaml(step, subject)
    is_known = isinstance(value, dict) and set(value) <= {"budget_us", "fresh"}
    budget = value.get("budget_us") if isinstance(value, dict) and is_known else None
    if isinstance(budget, bool) or not isinstance(budget, int | float) or not 0 < budget <= _MAX_BUDGET_US:
        expected = f"expected {{budget_us: N}}, more than 0 to {_MAX_BUDGET_US:,} us"
        raise RefusalError(Code.INVALID, f"{subject}: {expected}, found {shown(step.value)}")
    assert isinstance(value, dict)  # noqa: S101 - it has a budget
    return round(budget * 1000), _is_fresh(value, subject)


def _is_fresh(value: Mapping[str, object], subject: str) -> bool:
    found = value.get("fresh", False)
    if isinstance(found, bool):
        return found
    raise RefusalError(Code.INVALID, f"{subject}: fresh: expected true or false, found {shown(str(found))}")


def _kernel_value(step: Step, kind: StepKind, component: _Sketch | None = None) -> PropertyValue | None:
    """What the kernel's step of this kind takes as its value."""
    match kind.value:
        case "scalar" if kind.name == "property" and component is not None:
            return _property_value(step, component)
        case "scalar":
            return _scalar(step, f"step {step.kind} of '{step.target}'")
        case "resource.service":
            return _service(step)
        case _:
            return None


def _service(step: Step) -> str:
    subject = f"port '{step.name}' of component '{step.target}'"
    value = _yaml(step, subject)
    resource, dot, service = value.partition(".") if isinstance(value, str) else ("", "", "")
    if not (resource and dot and service):
        text = f"{subject}: expected resource.service as the value, found {shown(step.value)}"
        raise RefusalError(Code.INVALID, text)
    return f"{resource}.{service}"


def _scalar(step: Step, subject: str, type_name: str = "") -> PropertyValue:
    value = _yaml(step, subject, type_name)
    if not isinstance(value, bool | int | float | str):
        expected = "expected true, false, a number or text in YAML"
        raise RefusalError(Code.INVALID, f"{subject}: {expected}, found {shown(step.value)}")
    return value


def _property_value(step: Step, component: _Sketch) -> PropertyValue:
    known = component.properties
    subject = f"property '{step.name}' of component '{step.target}'"
    if step.name not in known:
        text = f"component '{step.target}' has no property {shown(step.name)}"
        raise RefusalError(Code.INVALID, f"{text}; {did_you_mean(step.name, known)}")
    value = _scalar(step, subject, known[step.name].type)
    if facts := property_mismatch(known[step.name], value):
        text = f"{subject}: expected {facts['expected']}, found {facts['found']}"
        raise RefusalError(Code.INVALID, text)
    return value
