"""What can be told of a request without touching a component: form, time and target. Knows no ROS."""

import math

from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from mauve_rt._kernel import ComponentDescription
from mauve_rt.errors import one_line
from mauve_rt.model.checks import property_mismatch
from mauve_rt.model.schema import PropertyValue
from mauve_rt.model.words import did_you_mean, shown
from mauve_rt.node.executor_requests import Code, Request, Step
from mauve_rt.node.executor_runtime import Runtime

SUPPORTED = ("replace_core", "set_property", "start", "stop")
KNOWN = (
    *SUPPORTED,
    "replace_fsm",
    "replace_shell",
    "connect",
    "disconnect",
    "add_component",
    "remove_component",
    "add_resource",
    "remove_resource",
)
MAX_TIMEOUT_S = 10.0
MAX_TEXT = 1000


class RefusalError(Exception):
    """A request that is not carried out, and why."""

    def __init__(self, code: Code, message: str) -> None:
        super().__init__(message)
        self.code = code


def well_formed(request: Request) -> Step:
    """The one step of a request that makes sense.

    Raises:
        RefusalError: INVALID or UNSUPPORTED.
    """
    if not math.isfinite(request.timeout_s) or not 0.0 <= request.timeout_s <= MAX_TIMEOUT_S:
        text = f"bad timeout: expected 0 (the default) to {MAX_TIMEOUT_S:g} s, found {request.timeout_s:g}"
        raise RefusalError(Code.INVALID, text)
    if request.clock_ns < 0:
        text = f"bad clock_ns: expected 0 or an instant, found {request.clock_ns}"
        raise RefusalError(Code.INVALID, text)
    texts = [request.request_id, request.requested_by, request.cause]
    texts += [text for step in request.steps for text in (step.kind, step.target, step.name, step.value)]
    if any(len(text) > MAX_TEXT for text in texts):
        raise RefusalError(Code.INVALID, f"a text of the request is longer than {MAX_TEXT} characters")
    if not request.steps:
        raise RefusalError(Code.INVALID, "a transaction without a step: expected at least one")
    for step in request.steps:
        _check_kind(step)
    if len(request.steps) > 1:
        text = f"a transaction of {len(request.steps)} steps is not supported; send them one by one"
        raise RefusalError(Code.UNSUPPORTED, text)
    return request.steps[0]


def target_of(step: Step, runtime: Runtime, *, expected_epoch: int) -> ComponentDescription:
    """The component that a step is about, now.

    Raises:
        RefusalError: NOT_ACTIVE, WRONG_EPOCH, UNKNOWN_COMPONENT or NOT_RECONFIGURABLE.
    """
    if not runtime.active:
        text = "the executor is not active; activate it first (lifecycle)"
        raise RefusalError(Code.NOT_ACTIVE, text)
    epoch = runtime.epoch
    if expected_epoch not in (0, epoch):
        text = f"the architecture is at epoch {epoch}, the request expected {expected_epoch}"
        raise RefusalError(Code.WRONG_EPOCH, f"{text}; look at ~/state and decide again")
    components = {component.name: component for component in runtime.components()}
    if step.target not in components:
        remedy = did_you_mean(step.target, components)
        text = f"component {shown(step.target)} is unknown; the executor has {', '.join(components)}"
        raise RefusalError(Code.UNKNOWN_COMPONENT, f"{text}; {remedy}" if remedy.startswith("did") else text)
    component = components[step.target]
    if not component.reconfigurable:
        text = f"component '{step.target}' is protected: the architecture file says reconfigurable: false"
        raise RefusalError(Code.NOT_RECONFIGURABLE, text)
    return component


def checked(step: Step, component: ComponentDescription, runtime: Runtime) -> PropertyValue | None:
    """Whether the component can do what the step asks; of set_property the value.

    Raises:
        RefusalError: FAULTED, NOT_RUNNING, ALREADY_RUNNING, UNKNOWN_CORE, UNDECLARED_CORE or INVALID.
    """
    name, state = component.name, component.state
    if state == "FAULTED":
        remedy = "clean up and configure the executor first (lifecycle)"
        text = one_line(f"component '{name}' is faulted ({component.fault}); {remedy}")
        raise RefusalError(Code.FAULTED, text)
    match step.kind:
        case "stop" if state in ("STOPPED", "UNCONFIGURED"):
            raise RefusalError(Code.NOT_RUNNING, f"component '{name}' is already stopped")
        case "start" if state in ("RUNNING", "HELD"):
            raise RefusalError(Code.ALREADY_RUNNING, f"component '{name}' is already running")
        case "replace_core":
            _check_core(step.name, component, runtime)
        case "set_property":
            return _property_value(step, component)
    return None


def _check_kind(step: Step) -> None:
    if step.kind not in KNOWN:
        text = f"unknown kind of step {shown(step.kind)}; {did_you_mean(step.kind, KNOWN)}"
        raise RefusalError(Code.INVALID, text)
    if step.kind not in SUPPORTED:
        text = f"steps of kind {step.kind} are not supported; supported: {', '.join(SUPPORTED)}"
        raise RefusalError(Code.UNSUPPORTED, text)


def _check_core(core: str, component: ComponentDescription, runtime: Runtime) -> None:
    name = component.name
    allowed = [runtime.model.components[name].core, *runtime.alternatives(name), component.core]
    if core in allowed:
        return
    takes = f"component '{name}' takes {', '.join(dict.fromkeys(allowed))}"
    if runtime.index.find("core", core) is None:
        raise RefusalError(Code.UNKNOWN_CORE, f"core {shown(core)} is not installed; {takes}")
    text = f"core '{core}' is installed, but not declared: {takes}"
    raise RefusalError(Code.UNDECLARED_CORE, f"{text}; name it among its alternatives in the file")


def _property_value(step: Step, component: ComponentDescription) -> PropertyValue:
    known = {description.name: description for description in component.properties}
    subject = f"property '{step.name}' of component '{component.name}'"
    if step.name not in known:
        text = f"component '{component.name}' has no property {shown(step.name)}"
        raise RefusalError(Code.INVALID, f"{text}; {did_you_mean(step.name, known)}")
    try:
        value = YAML(typ="safe", pure=True).load(step.value)
    except (YAMLError, ValueError, RecursionError):
        raise RefusalError(Code.INVALID, f"{subject}: the value {shown(step.value)} is not YAML") from None
    if not isinstance(value, bool | int | float | str):
        expected = "expected true, false, a number or text in YAML"
        raise RefusalError(Code.INVALID, f"{subject}: {expected}, found {shown(step.value)}")
    if facts := property_mismatch(known[step.name], value):
        text = f"{subject}: expected {facts['expected']}, found {facts['found']}"
        raise RefusalError(Code.INVALID, text)
    return value
