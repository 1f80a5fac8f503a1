"""Requests carried out or refused. Knows nothing of ROS: `executor_services` is its ROS face."""

import threading
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Protocol

from mauve_rt._kernel import (
    HELD_STOPPED,
    KEPT,
    ActionStep,
    Committed,
    ComponentDescription,
    ResourceDescription,
    Transaction,
    monotonic_ns,
)
from mauve_rt.control.checks import check_form, check_revision, check_state, check_time
from mauve_rt.control.judging import Judge, Judged
from mauve_rt.control.limits import RequestLimits
from mauve_rt.control.probations import Verdict
from mauve_rt.control.reloads import Reload
from mauve_rt.control.reports import Following, message_of, reports_of
from mauve_rt.control.requests import (
    Code,
    Outcome,
    RecordingOrder,
    RefusalError,
    ReloadOrder,
    Report,
    Request,
    RequestLog,
    Step,
    code_of,
    reused_id,
)
from mauve_rt.control.runtime import Runtime
from mauve_rt.control.steps import Bound, Plan
from mauve_rt.control.wishes import step_of, wanted, with_declared_values
from mauve_rt.errors import MauveError, error_code, internal_error_text, one_line
from mauve_rt.model.schema import ResourceModel

DEFAULT_TIMEOUT_S = 1.0
_CALLED_OFF = ("wrong_revision", "not_configured", "timeout")
_NO_TRIAL = (0, 0)


class Outside(Protocol):
    """What binds resources to topics and services; see `executor_bound_resources`."""

    def open(
        self, resources: Mapping[str, ResourceModel], described: Mapping[str, ResourceDescription]
    ) -> dict[str, list[int]]:
        """Open what resources to come are bound to.

        Raises:
            MauveError: nothing is open then.
        """

    def attach(self, opened: Mapping[str, list[int]]) -> None:
        """They are there: let what was opened serve them."""

    def discard(self, opened: Mapping[str, list[int]]) -> None:
        """They did not come."""

    def remove(self, resources: Iterable[str]) -> None:
        """These are gone."""


class Recordings(Protocol):
    """What starts and stops recordings; see `executor_recording`."""

    def carry_out(self, order: RecordingOrder) -> Outcome:
        """Start or stop. From any thread; may wait for a disk.

        Raises:
            RefusalError: and nothing was started or stopped.
        """


class Control:
    """Carries out requests. handle() may be called from any thread.

    Changes, which may take long to prepare, are carried out one at a time. A stop or a start by itself waits
    for none of them: it takes no lock but the kernel's, of that one component. What it does to a component
    that a change prepared meanwhile is about, the kernel finds at the commit: the change is refused then.
    No request waits for a recording that starts or stops: its disk may hang.

    | member       | written by                    | guarded by                                      |
    | ------------ | ----------------------------- | ----------------------------------------------- |
    | `_log`       | every request                 | `_answered`, for a moment                       |
    | `_under_way` | every request with an id      | `_answered`; who repeats a request waits in it  |
    | `_taken`     | changes                       | `_changing`                                     |
    | the bindings | changes, in `_outside`        | `_changing`, from the plan to the commit's end  |
    | `_trials`    | reloads; the watch of verdicts | exchanged item by item                          |
    | the bag      | orders, in `_recordings`      | a lock of its own: a disk may hang              |
    """

    def __init__(
        self,
        runtime: Runtime,
        *,
        phase_timeout_s: float = 1.0,
        outside: Outside | None = None,
        recordings: Recordings | None = None,
        limits: RequestLimits | None = None,
        judge: Judge | None = None,
    ) -> None:
        """The report of a commit is pending up to `phase_timeout_s`, until the next release tells its phase.

        Without an `outside`, a request that binds a resource to a topic or service is refused; without
        `recordings`, one that records. Without a `judge`, no change is judged by its timing.
        """
        self._runtime = runtime
        self._outside = outside
        self._recordings = recordings
        self._limits = limits or RequestLimits()
        self._judge = judge
        self._taken: dict[str, int] = {}  # bytes, by name of what requests added and nobody removed
        self._phase_timeout_ns = round(phase_timeout_s * 1e9)
        self._log = RequestLog()
        self._under_way: dict[str, Request] = {}
        self._answered = threading.Condition()
        self._changing = threading.Lock()
        self._trials: dict[str, tuple[int, int]] = {}  # by component: generation on probation, and since when

    def handle(self, request: Request) -> Outcome:
        """Do what is asked, or nothing at all. Never raises: every request gets its outcome."""
        identity = request.request_id
        with self._answered:
            self._answered.wait_for(lambda: self._under_way.get(identity) != request)
            if identity in self._under_way:
                return replace(reused_id(request, self._under_way[identity]), revision=self._runtime.revision)
            known = self._log.find(request)
            if known is not None:
                if known.code is Code.REQUEST_ID_REUSED:
                    return replace(known, revision=self._runtime.revision)
                return replace(known, replayed=True)
            if identity:
                self._under_way[identity] = request
        outcome: Outcome | None = None
        try:
            if request.is_direct or request.recording is not None:
                outcome = self._outcome(request)
            else:
                with self._changing, self._runtime.changing(str(request)):
                    outcome = self._outcome(request)
            return outcome
        finally:
            with self._answered:
                if outcome is not None:
                    self._log.add(request, replace(outcome, pending=None))
                self._under_way.pop(identity, None)
                self._answered.notify_all()

    def way_back(self, verdict: Verdict) -> Request | None:
        """What else goes back when an old core is back: the other parts of its generation; None: nothing."""
        record = verdict.record
        generation, since_ns = self._trials.get(record.component, _NO_TRIAL)
        if generation == 0 or record.begin_ns < since_ns:
            return None  # of an earlier probation, or of no reload
        self._trials.pop(record.component, None)
        if not verdict.is_reverted:
            return None
        order = ReloadOrder(targets=(record.component,), back=True, generation=generation)
        return Request(reload=order, requested_by="kernel", cause=f"probation reverted: {record.reason}")

    def release(self, rule: str) -> Outcome:
        """End what persons put over a rule, or over all ("")."""
        if self.outlasted(rule, KEPT):
            return self.end_kept(rule)
        with self._changing:
            taken_off = self._runtime.architecture.overlays.take_off(rule)
            return self._wanted_again(
                f"released: {_words_of(taken_off)}" if taken_off else "nothing is over it"
            )

    def outlasted(self, rule: str, source: str) -> bool:
        """Whether what a rule wanted before a restart is in force yet; `source`: KEPT or HELD_STOPPED."""
        overlays = self._runtime.overlays()
        return overlays is not None and any(each.rule == rule for each in overlays.at_work(source))

    def end_kept(self, rule: str) -> Outcome:
        """End a rule that the rules file lacks, with the stop of what it could not do."""
        outcome = self.end_outlasted(rule, KEPT)
        if outcome.success and self.outlasted(rule, HELD_STOPPED):
            return self.end_outlasted(rule, HELD_STOPPED)
        return outcome

    def end_outlasted(self, rule: str, source: str) -> Outcome:
        """What there is without it comes back."""
        with self._changing:
            return self._outcome(Request(rule=rule, requested_by=source, release=True))

    def forgive(self, component: str) -> Outcome:
        """End the quarantine of the values that were rejected of a component."""
        overlays = self._runtime.architecture.overlays
        with self._changing:
            found = [step for step in overlays.rejected() if step.target == component]
            for step in found:
                overlays.forgive(step)
            words = ", ".join(step.name or step.kind for step in found)
            return self._wanted_again(f"may be put in again: {words}" if found else "nothing was rejected")

    def _wanted_again(self, message: str) -> Outcome:
        """What is wanted may be another: the executor's own rules see to theirs, this to supervisors'."""
        architecture = self._runtime.architecture
        architecture.note_overlays()
        failures = []
        for overlay in architecture.overlays.active():
            if overlay.source in ("", KEPT, HELD_STOPPED):
                continue
            steps = tuple(step_of(one) for one in overlay.assigns)
            request = Request(
                steps=steps, rule=overlay.rule, requested_by=overlay.source, priority=overlay.priority
            )
            outcome = self._outcome(request)
            if not outcome.success:
                failures.append(f"rule {overlay.rule}: {outcome.message}")
        revision = self._runtime.observe().revision
        if failures:
            return Outcome(
                code=Code.PREPARE_FAILED, message="; ".join([message, *failures]), revision=revision
            )
        return Outcome(code=Code.OK, message=message, revision=revision)

    def remember(self, request: Request, outcome: Outcome) -> None:
        """Note what came of a request that somebody else carried out: who repeats it gets that."""
        with self._answered:
            self._log.add(request, outcome)

    def complete(self, request: Request, outcome: Outcome) -> None:
        """The releases came that a report lacked: who repeats the request gets them, too."""
        with self._answered:
            self._log.complete(request, outcome)

    def _outcome(self, request: Request) -> Outcome:
        # The kernel's count is taken first: what changes from here on, the commit finds.
        kernel_revision = self._runtime.kernel_revision()
        expected_revision = kernel_revision if request.expected_revision else 0
        revision, parts = self._runtime.observe()
        from_core, to_core = _replaced_core(request, parts)
        try:
            self._limits.check_size(request)
            check_form(request)
            request = with_declared_values(request, parts)
            if request.recording is not None:
                outcome = self._order(request, request.recording)
            elif request.reload is not None:
                with self._own_count(request):
                    outcome = self._reload(
                        request, request.reload, parts, expected_revision=expected_revision
                    )
            else:
                with self._own_count(request):
                    outcome = self._carry_out(request, parts, expected_revision=expected_revision)
        except RefusalError as refusal:
            outcome = Outcome(code=refusal.code, message=str(refusal), timing=refusal.timing)
        except MauveError as error:
            outcome = Outcome(code=code_of(error), message=one_line(str(error)))
        except BaseException as error:  # noqa: BLE001 - whatever it is, it must not cost the requester the answer
            outcome = Outcome(code=Code.PREPARE_FAILED, message=internal_error_text(error))
        after = self._runtime.observe(
            changed_since=revision if outcome.success and _is_change(request, outcome) else None
        )
        return replace(outcome, revision=after.revision, from_core=from_core, to_core=to_core).cut()

    def _carry_out(
        self, request: Request, parts: Sequence[ComponentDescription], *, expected_revision: int
    ) -> Outcome:
        check_time(request, self._runtime)
        with wanted(request, self._runtime) as now:
            if not now.steps and (request.steps or request.release) and not request.dry_run:
                return Outcome(code=Code.OK, message=_NOTHING_NOW[bool(request.rule)])
            return self._carry_out_now(now, parts, expected_revision=expected_revision)

    def _carry_out_now(
        self, request: Request, parts: Sequence[ComponentDescription], *, expected_revision: int
    ) -> Outcome:
        taken = {} if request.is_direct else self._still_taken(parts)
        plan = Plan(request.steps, self._runtime, parts, limits=self._limits, taken=taken)
        if len(request.steps) == 1 and request.steps[0].kind in ("start", "stop"):  # be it a dry run
            step = request.steps[0]
            for part in self._runtime.components():  # of this moment: a stop may just have begun
                if part.name == step.target:
                    check_state(step, part)
            if request.is_direct:
                return self._start_or_stop(step, request, expected_revision=expected_revision)
        judged = self._judged(request, request.steps)
        with self._bound(plan.bound, dry_run=request.dry_run):
            committed = self._commit(
                plan.transaction, _as_judged(request, judged), expected_revision=expected_revision
            )
        if request.dry_run:
            judged.require()
            words = "; ".join(str(step) for step in request.steps)
            told = "; ".join([f"dry run: '{words}' would be accepted", *judged.words()])
            return Outcome(code=Code.OK, message=told, timing=judged.verdicts)
        self._runtime.declare(added=plan.added, removed=plan.removed)
        self._taken = plan.taken
        return _warned(self._followed(Outcome(code=Code.OK, message=""), committed, request.steps), judged)

    def _judged(self, request: Request, steps: Sequence[Step]) -> Judged:
        """The verdicts on the timing of a change, before its commit.

        Raises:
            RefusalError: NOT_SCHEDULABLE; of a dry run the caller asks `require`.
        """
        judged = Judged() if self._judge is None else self._judge.of_request(request, steps)
        if not request.dry_run:
            judged.require()
        return judged

    def _reload(
        self,
        request: Request,
        order: ReloadOrder,
        parts: Sequence[ComponentDescription],
        *,
        expected_revision: int,
    ) -> Outcome:
        check_time(request, self._runtime)
        reload = Reload(self._runtime, order, parts)
        found = reload.load(dry_run=request.dry_run)
        if reload.generation is None:
            prefix = "dry run: would be accepted; " if request.dry_run else ""
            return Outcome(code=Code.OK, message=prefix + found)
        number = 0 if reload.probation is None else reload.generation.number
        trial = number, self._runtime.host.now_ns()
        before: dict[str, tuple[int, int]] = {}
        try:
            steps, transaction = reload.steps()
            judged = self._judged(request, steps)
            before = {step.target: self._trials.get(step.target, _NO_TRIAL) for step in steps}
            # Before the commit: its verdict may come, and be looked at, before the commit returns.
            self._trials.update(dict.fromkeys(before, trial))
            committed = (
                self._commit(transaction, _as_judged(request, judged), expected_revision=expected_revision)
                if steps
                else None
            )
        except BaseException:
            self._trials.update(before)
            reload.undo()
            raise
        reload.commit()
        outcome = Outcome(
            code=Code.OK, message=reload.message(steps), loaded=reload.generation.loaded, report=()
        )
        if committed is not None:
            outcome = self._followed(outcome, committed, tuple(steps))
        return _warned(outcome, judged)

    def _followed(self, outcome: Outcome, committed: Committed, steps: tuple[Step, ...]) -> Outcome:
        """The outcome with the report of its change, which may lack the releases that follow."""
        measured = committed.report()
        pending = None
        if not measured.is_complete and (timeout_ns := self._phase_timeout_of(steps)) > 0:
            pending = Following(committed, steps, outcome.message, monotonic_ns() + timeout_ns)
        return replace(
            outcome,
            message=message_of(steps, measured, outcome.message),
            report=reports_of(steps, measured),
            pending=pending,
        )

    def _still_taken(self, parts: Sequence[ComponentDescription]) -> dict[str, int]:
        there = {*self._runtime.resources(), *(part.name for part in parts)}
        return {name: taken for name, taken in self._taken.items() if name in there}

    def _commit(self, transaction: Transaction, request: Request, *, expected_revision: int) -> Committed:
        try:
            transaction.by(request.author)
            return self._runtime.host.make(
                transaction,
                dry_run=request.dry_run,
                expected_revision=expected_revision,
                commit_timeout_ns=_timeout_ns(request),
                force=request.force,
                idle=request.idle,
                idle_within_ns=round((request.idle_within_s or DEFAULT_TIMEOUT_S) * 1e9),
            )
        except MauveError as error:
            if error_code(error) in _CALLED_OFF:
                check_time(request, self._runtime)  # whether it was by a deactivation
            raise

    @contextmanager
    def _own_count(self, request: Request) -> Iterator[None]:
        """Report a change that came in between in the executor's own count of revisions."""
        try:
            yield
        except MauveError as error:
            if error_code(error) != "wrong_revision":
                raise
            self._runtime.observe()
            check_revision(request, self._runtime)
            if getattr(error, "element", "") == "revision":
                text = f"another change is being made at revision {request.expected_revision}"
                raise RefusalError(Code.WRONG_REVISION, f"{text}; read ~/state, then ask again") from error
            raise

    def _order(self, request: Request, order: RecordingOrder) -> Outcome:
        check_revision(request, self._runtime)
        if self._recordings is None:
            raise RefusalError(Code.UNSUPPORTED, "this executor does not record by request")
        return self._recordings.carry_out(order)

    @contextmanager
    def _bound(self, bound: Bound, *, dry_run: bool) -> Iterator[None]:
        """Around a commit: topics of what is added open before it, of what is removed close after it."""
        outside = self._outside
        if outside is None:
            if bound.added:
                text = f"resource '{next(iter(bound.added))}': nothing can be bound to ROS here"
                raise RefusalError(Code.UNSUPPORTED, f"{text}; leave its topic or service out")
            yield
            return
        opened = outside.open(bound.added, bound.described)
        try:
            yield
        except BaseException:
            outside.discard(opened)
            raise
        if dry_run:
            outside.discard(opened)
            return
        outside.remove(bound.removed)
        outside.attach(opened)

    def _phase_timeout_of(self, steps: Sequence[Step]) -> int:
        """Of a property alone nobody wants to know the phase."""
        only_properties = all(step.kind == "set_property" for step in steps)
        return 0 if only_properties else self._phase_timeout_ns

    def _start_or_stop(self, step: Step, request: Request, *, expected_revision: int) -> Outcome:
        """Without a transaction: a stop stays pending after its time-out, and waits for no preparation."""
        host = self._runtime.host
        if step.kind == "stop":
            forced = host.stop(
                step.target, _timeout_ns(request), force=request.force, expected_revision=expected_revision
            )
            message = f"component '{step.target}' is stopped"
            if forced:
                message += " by force: it is FAULTED, and its thread is left behind until its state ends"
        else:
            host.start(step.target, request.clock_ns or None, expected_revision=expected_revision)
            message = f"component '{step.target}' is started"
        self._runtime.architecture.note_author(ActionStep(step.kind, step.target), request.author)
        return Outcome(code=Code.OK, message=message, report=(Report(step=step.kind, component=step.target),))


_NOTHING_NOW = {
    True: "nothing is to be done: it is so, or a rule of higher rank sets it",
    False: "it is in force once the rules that set it have ended",
}


def _as_judged(request: Request, judged: Judged) -> Request:
    """At an idle instant, where the verdict needs that."""
    return replace(request, idle=request.idle or judged.is_idle)


def _warned(outcome: Outcome, judged: Judged) -> Outcome:
    """With what is known of its timing; of an executor that only warns."""
    if not judged.objection:
        return replace(outcome, timing=judged.verdicts)
    message = f"{outcome.message}; warning: {judged.objection}"
    return replace(outcome, message=message, timing=judged.verdicts)


def _words_of(elements: Sequence[tuple[str, str]]) -> str:
    return ", ".join(f"{name or 'presence'} of {target}" for target, name in elements)


def _is_change(request: Request, outcome: Outcome) -> bool:
    return bool(request.steps or request.release or outcome.report) and not request.dry_run


def _replaced_core(request: Request, parts: Sequence[ComponentDescription]) -> tuple[str, str]:
    """Which core the request's one replace_core step puts in the place of which."""
    replacing = [step for step in request.steps if step.kind == "replace_core"]
    if len(replacing) != 1 or request.dry_run:
        return "", ""
    step = replacing[0]
    present = [part.core for part in parts if part.name == step.target]
    return (present[0], step.name) if present else ("", "")


def _timeout_ns(request: Request) -> int:
    return round((request.timeout_s or DEFAULT_TIMEOUT_S) * 1e9)
