"""What a transaction cost, as replies and events tell it. Knows no ROS."""

from dataclasses import dataclass, replace

from mauve_rt._kernel import Committed, StepReport, TransactionReport, monotonic_ns
from mauve_rt.control.requests import NOT_MEASURED, Outcome, Report
from mauve_rt.counts import counted
from mauve_rt.model.step_kinds import STEP_KINDS
from mauve_rt.model.steps import Step


@dataclass(frozen=True)
class Following:
    """The releases that follow a commit."""

    committed: Committed
    steps: tuple[Step, ...]
    done: str  # what was done, in words; empty: as the steps say
    until_ns: int

    def look(self, outcome: Outcome, *, wait_ns: int) -> Outcome:
        """As Pending.look."""
        left_ns = self.until_ns - monotonic_ns()
        measured = self.committed.report(max(0, min(left_ns, wait_ns)))
        is_over = measured.is_complete or left_ns <= wait_ns
        return replace(
            outcome,
            message=message_of(self.steps, measured, self.done),
            report=reports_of(self.steps, measured),
            pending=None if is_over else outcome.pending,
        )


def message_of(steps: tuple[Step, ...], measured: TransactionReport, done: str = "") -> str:
    """What was done, in one line, and which components are known to have missed releases for it."""
    # Every step of a component tells of all that it missed.
    missed = {report.component: report for report in measured.steps if report.missed_releases > 0}
    idle = ["made while no job of a participant was pending"] * measured.is_idle
    return "; ".join([done or _done(steps, measured), *idle, *map(_missed, missed.values())])


def _missed(report: StepReport) -> str:
    count = report.missed_releases
    text = f"component '{report.component}' missed {counted(count, 'release')}"
    return f"{text} ({report.remark})" if report.remark else text


def _done(steps: tuple[Step, ...], measured: TransactionReport) -> str:
    if len(steps) > 1:
        figures = f"prepared in {measured.prepare_ns / 1e6:.3g} ms"
        if measured.blackout_ns > 0:
            figures += f", longest blackout {measured.blackout_ns / 1e6:.3g} ms"
        return f"{len(steps)} steps are in force; {figures}"
    step, report = steps[0], measured.steps[0]
    match step.kind:
        case "replace_core":
            return f"component '{step.target}' runs {report.to_core}, in place of {report.from_core}"
        case "set_property":
            return f"property '{step.name}' of component '{step.target}' is {step.value}"
        case _:
            return f"done: {step}"


def reports_of(steps: tuple[Step, ...], measured: TransactionReport) -> tuple[Report, ...]:
    """What every step changed and cost, as far as it is known."""
    if len(measured.steps) == 1:  # then all of it was for this one
        alone, complete = measured.steps[0], measured.is_complete
        return (_report(steps[0], alone, prepare_ns=measured.prepare_ns, is_complete=complete),)
    # Lines beyond the steps' own are of components that a step for all was about.
    more = len(measured.steps) - len(steps)
    for_all = [step for step in steps if STEP_KINDS[step.kind].target == "all"][:1] * more
    return tuple(
        _report(step, report, prepare_ns=report.prepare_ns, is_complete=measured.is_complete)
        for step, report in zip([*steps, *for_all], measured.steps, strict=True)
    )


def _report(step: Step, measured: StepReport, *, prepare_ns: int, is_complete: bool) -> Report:
    kind = STEP_KINDS[step.kind]
    words = [step.kind, step.target if kind.is_about_resource else step.name]
    if kind.value not in ("section", "replacement", "promotion"):
        words.append(step.value)
    held = measured.blackout_ns != 0
    follows = held and not is_complete and measured.phase_actual_ns == NOT_MEASURED
    return Report(
        step=" ".join(word for word in words if word),
        component=measured.component,
        prepare_ns=prepare_ns,
        blackout_ns=measured.blackout_ns if held else NOT_MEASURED,
        missed_releases=NOT_MEASURED if follows else measured.missed_releases,
        phase_nominal_ns=measured.phase_nominal_ns if held else NOT_MEASURED,
        phase_actual_ns=measured.phase_actual_ns,
        from_core=measured.from_core,
        to_core=measured.to_core,
        remark=measured.remark,
        instant_ns=measured.instant_ns,
        release_ns=measured.release_ns,
        taken=tuple(measured.taken),
        left=tuple(measured.left),
        outputs=tuple(measured.outputs),
    )
