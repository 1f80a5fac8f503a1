"""Requests carried out or refused. Knows nothing of ROS: `executor_services` is its ROS face."""

import math
import threading
from collections.abc import Mapping
from dataclasses import replace

from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from mauve_rt._kernel import ComponentDescription, StepReport, monotonic_ns
from mauve_rt.errors import MauveError, error_code, one_line
from mauve_rt.model.checks import property_mismatch
from mauve_rt.model.schema import PropertyValue
from mauve_rt.model.words import did_you_mean, shown
from mauve_rt.node.executor_requests import Code, Outcome, Report, Request, RequestLog, Step
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
DEFAULT_TIMEOUT_S = 1.0
MAX_TIMEOUT_S = 10.0
MAX_TEXT = 1000
_STOP_SLICE_NS = 100_000_000

_CODES: Mapping[str, Code] = {
    "unknown_component": Code.UNKNOWN_COMPONENT,
    "unknown_core": Code.UNKNOWN_CORE,
    "undeclared_core": Code.UNDECLARED_CORE,
    "not_running": Code.NOT_RUNNING,
    "already_running": Code.ALREADY_RUNNING,
    "faulted": Code.FAULTED,
    "not_reconfigurable": Code.NOT_RECONFIGURABLE,
    "adopt_refused": Code.ADOPT_REFUSED,
    "timeout": Code.TIMEOUT,
    "not_configured": Code.NOT_ACTIVE,
    "invalid_argument": Code.INVALID,
    "type_mismatch": Code.INVALID,
    "out_of_range": Code.INVALID,
    "unknown_property": Code.INVALID,
}  # of the kernel's errors; any other one comes from preparing


class _RefusalError(Exception):
    def __init__(self, code: Code, message: str) -> None:
        super().__init__(message)
        self.code = code


class Control:
    """Carries out one request at a time. handle() may be called from any thread."""

    def __init__(self, runtime: Runtime, *, phase_timeout_s: float = 1.0) -> None:
        """Args:

        runtime: what requests change.
        phase_timeout_s: how long the reply to a commit may wait for the next release, whose phase it reports.
        """
        self._runtime = runtime
        self._phase_timeout_ns = round(phase_timeout_s * 1e9)
        self._log = RequestLog()
        self._lock = threading.Lock()

    def handle(self, request: Request) -> Outcome:
        """Do what is asked, or nothing at all. Never raises: every request gets its outcome."""
        with self._lock:
            known = self._log.find(request)
            if known is not None:
                if known.code is Code.REQUEST_ID_REUSED:
                    return replace(known, epoch=self._runtime.epoch)
                return replace(known, replayed=True)
            outcome = self._outcome(request)
            self._log.add(request, outcome)
            return outcome

    def _outcome(self, request: Request) -> Outcome:
        from_core = to_core = ""
        try:
            step = self._checked(request)
            component = self._component(step)
            if step.kind == "replace_core":
                from_core, to_core = component.core, step.name
            action = self._prepared(step, component)
            if request.dry_run:
                outcome = Outcome(code=Code.OK, message=f"dry run: '{step}' would be accepted")
            else:
                outcome = self._commit(step, action, request)
        except _RefusalError as refusal:
            outcome = Outcome(code=refusal.code, message=str(refusal))
        except MauveError as error:
            code = _CODES.get(error_code(error), Code.PREPARE_FAILED)
            outcome = Outcome(code=code, message=one_line(str(error)))
        except Exception as error:  # noqa: BLE001 - an error of ours must not cost the requester the answer
            text = one_line(f"internal error: {type(error).__name__}: {error}")
            outcome = Outcome(code=Code.PREPARE_FAILED, message=text)
        self._runtime.observe()
        return replace(outcome, epoch=self._runtime.epoch, from_core=from_core, to_core=to_core)

    # ---- checks -----------------------------------------------------------------------------------------------------

    def _checked(self, request: Request) -> Step:
        """The one step of a well-formed request that comes at the right time."""
        timeout = request.timeout_s
        if not math.isfinite(timeout) or not 0.0 <= timeout <= MAX_TIMEOUT_S:
            text = f"bad timeout: expected 0 (for {DEFAULT_TIMEOUT_S:g} s) to {MAX_TIMEOUT_S:g} s, found {timeout:g}"
            raise _RefusalError(Code.INVALID, text)
        if request.clock_ns < 0:
            raise _RefusalError(Code.INVALID, f"bad clock_ns: expected 0 or an instant, found {request.clock_ns}")
        texts = [request.request_id, request.requested_by, request.cause]
        texts += [text for step in request.steps for text in (step.kind, step.target, step.name, step.value)]
        if any(len(text) > MAX_TEXT for text in texts):
            raise _RefusalError(Code.INVALID, f"a text of the request is longer than {MAX_TEXT} characters")
        if not request.steps:
            raise _RefusalError(Code.INVALID, "a transaction without a step: expected at least one")
        for step in request.steps:
            if step.kind not in KNOWN:
                remedy = did_you_mean(step.kind, KNOWN)
                raise _RefusalError(Code.INVALID, f"unknown kind of step {shown(step.kind)}; {remedy}")
            if step.kind not in SUPPORTED:
                text = f"steps of kind {step.kind} are not supported; supported: {', '.join(SUPPORTED)}"
                raise _RefusalError(Code.UNSUPPORTED, text)
        if len(request.steps) > 1:
            text = f"a transaction of {len(request.steps)} steps is not supported; send them one by one"
            raise _RefusalError(Code.UNSUPPORTED, text)
        if not self._runtime.active:
            raise _RefusalError(Code.NOT_ACTIVE, "the executor is not active; activate it first (lifecycle)")
        if request.expected_epoch not in (0, self._runtime.epoch):
            text = (
                f"the architecture is at epoch {self._runtime.epoch}, the request expected {request.expected_epoch}; "
                "look at ~/state and decide again"
            )
            raise _RefusalError(Code.WRONG_EPOCH, text)
        return request.steps[0]

    def _component(self, step: Step) -> ComponentDescription:
        components = {component.name: component for component in self._runtime.components()}
        if step.target not in components:
            names = ", ".join(components)
            near = did_you_mean(step.target, components)
            near = f"; {near}" if near.startswith("did") else ""
            text = f"component {shown(step.target)} is unknown; the executor has {names}{near}"
            raise _RefusalError(Code.UNKNOWN_COMPONENT, text)
        component = components[step.target]
        if not component.reconfigurable:
            text = f"component '{step.target}' is protected: the architecture file says reconfigurable: false"
            raise _RefusalError(Code.NOT_RECONFIGURABLE, text)
        return component

    def _prepared(self, step: Step, component: ComponentDescription) -> PropertyValue | None:
        """Everything that can be told without touching the component; of set_property the value."""
        name, state = component.name, component.state
        if state == "FAULTED":
            text = f"component '{name}' is faulted ({component.fault}); "
            remedy = "clean up and configure the executor first (lifecycle)"
            raise _RefusalError(Code.FAULTED, one_line(text + remedy))
        match step.kind:
            case "stop" if state in ("STOPPED", "UNCONFIGURED"):
                raise _RefusalError(Code.NOT_RUNNING, f"component '{name}' is already stopped")
            case "start" if state in ("RUNNING", "HELD"):
                raise _RefusalError(Code.ALREADY_RUNNING, f"component '{name}' is already running")
            case "replace_core":
                self._check_core(step.name, component)
            case "set_property":
                return self._property_value(step, component)
        return None

    def _check_core(self, core: str, component: ComponentDescription) -> None:
        name = component.name
        original = self._runtime.model.components[name].core
        allowed = list(dict.fromkeys([original, *self._runtime.alternatives(name), component.core]))
        if core in allowed:
            return
        takes = f"component '{name}' takes {', '.join(allowed)}"
        if self._runtime.index.find("core", core) is None:
            raise _RefusalError(Code.UNKNOWN_CORE, f"core {shown(core)} is not installed; {takes}")
        text = f"core '{core}' is installed, but not declared: {takes}; name it among its alternatives in the file"
        raise _RefusalError(Code.UNDECLARED_CORE, text)

    def _property_value(self, step: Step, component: ComponentDescription) -> PropertyValue:
        known = {description.name: description for description in component.properties}
        if step.name not in known:
            text = f"component '{component.name}' has no property {shown(step.name)}; {did_you_mean(step.name, known)}"
            raise _RefusalError(Code.INVALID, text)
        try:
            value = YAML(typ="safe", pure=True).load(step.value)
        except (YAMLError, ValueError, RecursionError):
            raise _RefusalError(Code.INVALID, f"the value {shown(step.value)} is not YAML") from None
        if not isinstance(value, bool | int | float | str):
            text = f"the value {shown(step.value)}: expected true, false, a number or text in YAML"
            raise _RefusalError(Code.INVALID, text)
        if facts := property_mismatch(known[step.name], value):
            text = f"property '{step.name}' of component '{component.name}'"
            raise _RefusalError(Code.INVALID, f"{text}: expected {facts['expected']}, found {facts['found']}")
        return value

    # ---- commit -----------------------------------------------------------------------------------------------------

    def _commit(self, step: Step, value: PropertyValue | None, request: Request) -> Outcome:
        deployer = self._runtime.deployer
        timeout_ns = round((request.timeout_s or DEFAULT_TIMEOUT_S) * 1e9)
        report = Report(step=str(step.kind), component=step.target)
        match step.kind:
            case "stop":
                self._stop(step.target, timeout_ns)
                message = f"component '{step.target}' is stopped"
            case "start":
                deployer.start(step.target, request.clock_ns or None)
                message = f"component '{step.target}' is started"
            case "replace_core":
                measured = deployer.replace_core(
                    step.target, step.name, commit_timeout_ns=timeout_ns, phase_timeout_ns=self._phase_timeout_ns
                )
                report = _report(f"{step.kind} {step.name}", measured)
                message = f"component '{step.target}' runs {measured.to_core}, before {measured.from_core}"
                if measured.from_core == measured.to_core:
                    self._runtime.touch()
            case _:
                assert value is not None  # noqa: S101 - _prepared() gives set_property its value
                measured = deployer.set_property(step.target, step.name, value, commit_timeout_ns=timeout_ns)
                report = _report(f"{step.kind} {step.name}", measured)
                message = f"property '{step.name}' of component '{step.target}' is {shown(value)}"
                self._runtime.touch()
        return Outcome(code=Code.OK, message=message, report=(report,))


    def _stop(self, component: str, timeout_ns: int) -> None:
        """Stop in short waits, between which the kernel is free for others - for the end of the process above all."""
        deadline_ns = monotonic_ns() + timeout_ns
        while True:
            left_ns = deadline_ns - monotonic_ns()
            try:
                self._runtime.deployer.stop(component, max(0, min(left_ns, _STOP_SLICE_NS)))
            except MauveError as error:
                if error_code(error) == "timeout" and left_ns > _STOP_SLICE_NS and self._runtime.active:
                    continue  # a stop that timed out stays pending
                raise
            return


def _report(step: str, measured: StepReport) -> Report:
    return Report(
        step=step,
        component=measured.component,
        prepare_ns=measured.prepare_ns,
        blackout_ns=measured.blackout_ns,
        missed_releases=measured.missed_releases,
        phase_nominal_ns=measured.phase_nominal_ns,
        phase_actual_ns=measured.phase_actual_ns,
    )


