"""Requests carried out or refused. Knows nothing of ROS: `executor_services` is its ROS face."""

import threading
from collections.abc import Mapping
from dataclasses import replace

from mauve_rt._kernel import StepReport, monotonic_ns
from mauve_rt.errors import MauveError, error_code, one_line
from mauve_rt.model.schema import PropertyValue
from mauve_rt.model.words import shown
from mauve_rt.node.executor_checks import RefusalError, checked, target_of, well_formed
from mauve_rt.node.executor_requests import Code, Outcome, Report, Request, RequestLog, Step
from mauve_rt.node.executor_runtime import Runtime

DEFAULT_TIMEOUT_S = 1.0
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


class Control:
    """Carries out one request at a time. handle() may be called from any thread."""

    def __init__(self, runtime: Runtime, *, phase_timeout_s: float = 1.0) -> None:
        """The reply to a commit waits up to `phase_timeout_s` for the next release, to report its phase."""
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
            step = well_formed(request)
            component = target_of(step, self._runtime, expected_epoch=request.expected_epoch)
            if step.kind == "replace_core":
                from_core, to_core = component.core, step.name
            value = checked(step, component, self._runtime)
            if request.dry_run:
                outcome = Outcome(code=Code.OK, message=f"dry run: '{step}' would be accepted")
            else:
                outcome = self._commit(step, value, request)
        except RefusalError as refusal:
            outcome = Outcome(code=refusal.code, message=str(refusal))
        except MauveError as error:
            code = _CODES.get(error_code(error), Code.PREPARE_FAILED)
            outcome = Outcome(code=code, message=one_line(str(error)))
        except Exception as error:  # noqa: BLE001 - an error of ours must not cost the requester the answer
            text = one_line(f"internal error: {type(error).__name__}: {error}")
            outcome = Outcome(code=Code.PREPARE_FAILED, message=text)
        self._runtime.observe()
        return replace(outcome, epoch=self._runtime.epoch, from_core=from_core, to_core=to_core)

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
                    step.target,
                    step.name,
                    commit_timeout_ns=timeout_ns,
                    phase_timeout_ns=self._phase_timeout_ns,
                )
                report = _report(f"{step.kind} {step.name}", measured)
                message = f"component '{step.target}' runs {measured.to_core}, before {measured.from_core}"
                if measured.from_core == measured.to_core:
                    self._runtime.touch()
            case _:
                assert value is not None  # noqa: S101 - checked() gives set_property its value
                measured = deployer.set_property(step.target, step.name, value, commit_timeout_ns=timeout_ns)
                report = _report(f"{step.kind} {step.name}", measured)
                message = f"property '{step.name}' of component '{step.target}' is {shown(value)}"
                self._runtime.touch()
        return Outcome(code=Code.OK, message=message, report=(report,))

    def _stop(self, component: str, timeout_ns: int) -> None:
        """Stop in short waits, between which the kernel is free for others, for the end of all above all."""
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
