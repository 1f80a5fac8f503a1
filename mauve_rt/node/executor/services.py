"""An executor's services, such as ~/list_components and ~/replace_core: `executor_control`'s ROS face."""

import threading
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any

from rclpy.callback_groups import CallbackGroup
from rclpy.lifecycle import LifecycleNode

from mauve_msgs.srv import (
    AbandonChange,
    ListChanges,
    ListComponents,
    ListRules,
    ListTasks,
    LoadRules,
    Mirror,
    ReadValues,
    Reconfigure,
    ReleaseRules,
    Reload,
    ReplaceCore,
    ResetRule,
    Start,
    StartRecording,
    Stop,
    StopRecording,
    WriteSnapshot,
)
from mauve_rt._kernel import HELD_STOPPED, KEPT
from mauve_rt.control.control import Control
from mauve_rt.control.open_changes import abandon, open_changes
from mauve_rt.control.requests import Code, Outcome, RecordingOrder, ReloadOrder, Report, Request
from mauve_rt.control.runtime import Runtime
from mauve_rt.control.values import Values
from mauve_rt.errors import MauveError
from mauve_rt.interfaces.changes import open_change_messages
from mauve_rt.interfaces.descriptions import (
    component_infos,
    held_elements,
    realtime_status,
    resource_infos,
    step_reports,
    task_list,
    timing_verdicts,
)
from mauve_rt.interfaces.values import value_message
from mauve_rt.model.schema import DEFAULT_MIRROR_HZ
from mauve_rt.model.step_kinds import STEP_KINDS
from mauve_rt.model.steps import Step
from mauve_rt.model.threads import real_time_threads
from mauve_rt.node.executor.bound_resources import BoundResources
from mauve_rt.node.executor.bounds import WatchedBounds
from mauve_rt.node.executor.console import log_request
from mauve_rt.node.executor.events import Event
from mauve_rt.node.executor.mirrors import Mirrors, topics
from mauve_rt.node.executor.parameters import Parameters
from mauve_rt.node.executor.rules import OwnRules
from mauve_rt.node.executor.state import StatePublisher
from mauve_rt.node.executor.stop_guard import StopGuard
from mauve_rt.node.shared.watch import Watch


class Services:
    """The services of a node.

    Requests for changes wait for each other (`is_change`). Requests to stop or start a component or a
    recording wait for no other request, and so with `~/list_changes` and `~/abandon_change`. They are in
    `control_group`, lists in `query_group`. Who asked is answered first; then another thread tells of it on
    ~/state and ~/events.

    | member    | written by                | guarded by                      |
    | --------- | ------------------------- | ------------------------------- |
    | `_untold` | who carries out a request | each thread has one of its own  |
    """

    def __init__(
        self,
        node: LifecycleNode,
        runtime: Runtime,
        *,
        control: Control,
        bound: BoundResources,
        values: Values,
        mirrors: Mirrors,
        state: StatePublisher,
        parameters: Parameters,
        rules: OwnRules,
        bounds: WatchedBounds,
        load_rules: Callable[[str, Sequence[str]], tuple[Code, str]],
        warnings: Callable[[], list[str]],
        access: Callable[[], str],
        watch: Watch,
        control_group: CallbackGroup,
        query_group: CallbackGroup,
    ) -> None:
        self._warnings, self._access = warnings, access
        self._runtime = runtime
        self._control = control
        self._bound = bound
        self._state = state
        self._rules = rules
        self._bounds = bounds
        self._load_rules = load_rules
        self._logger = node.get_logger()
        # The change is made by then: what is wrong here is told, and no refusal of it.
        self._follow = watch.guarded("the parameters", parameters.follow)
        self._untold = _Untold()
        self._values = values
        self._mirrors = mirrors
        node.create_service(ListComponents, "~/list_components", self._list, callback_group=query_group)
        node.create_service(ListRules, "~/list_rules", self._list_rules, callback_group=query_group)
        node.create_service(ListTasks, "~/list_tasks", self._list_tasks, callback_group=query_group)
        node.create_service(ReadValues, "~/read_values", self._read_values, callback_group=query_group)
        node.create_service(Mirror, "~/mirror", self._mirror, callback_group=query_group)
        node.create_service(LoadRules, "~/load_rules", self._on_load_rules, callback_group=control_group)
        for service, name, answer in (
            (ListChanges, "~/list_changes", self._list_changes),
            (ResetRule, "~/reset_rule", self._reset_rule),
            (ReleaseRules, "~/release_rules", self._release_rules),
            (AbandonChange, "~/abandon_change", self._abandon_change),
        ):
            node.create_service(service, name, answer, callback_group=control_group)
        for service, name, translate in (
            (Stop, "~/stop", _stop),
            (Start, "~/start", _start),
            (ReplaceCore, "~/replace_core", _replace_core),
            (Reconfigure, "~/reconfigure", _reconfigure),
            (Reload, "~/reload", _reload),
            (StartRecording, "~/start_recording", _start_recording),
            (StopRecording, "~/stop_recording", _stop_recording),
            (WriteSnapshot, "~/write_snapshot", _write_snapshot),
        ):
            handler = self._handler(translate)
            opened = node.create_service(service, name, handler, callback_group=control_group)
            self._tell_after(opened)
            if service is Stop:
                self.stop_service = opened
        self.guard: StopGuard | None = None

    def handle(self, request: Request) -> Outcome:
        """Carry out a request, and tell of it."""
        outcome = self._carry_out(request)
        self._tell()
        return outcome

    def note_answered(self) -> None:
        """Take over the stops that were answered while Python did not work: they are told as any others."""
        for ros_request, response in self.guard.take_answered() if self.guard is not None else ():
            request = _stop(ros_request)
            report = (Report(step="stop", component=ros_request.component),) if response.success else ()
            outcome = Outcome(
                code=Code(response.code),
                message=response.message,
                revision=self._runtime.observe().revision,
                report=report,
            )
            self._control.remember(request, outcome)
            self._untold.events.append(self._state.take_down(request, outcome))

    def tell_answered(self) -> None:
        """As note_answered(), and tell at once."""
        self.note_answered()
        self._tell()

    def _carry_out(self, request: Request) -> Outcome:
        self.note_answered()
        if request.recording is not None and request.recording.kind != "start":
            self._state.flush()  # the bag has all messages up to its end
        outcome = self._control.handle(request)
        if not outcome.replayed:
            self._untold.events.append(self._state.take_down(request, outcome))
            if outcome.success and _changes_parameters(request):
                self._follow()
        return outcome

    def _tell_after(self, service: Any) -> None:
        """Let a service tell when it has sent its reply."""
        send_response = service.send_response

        def send_and_tell(response: Any, header: Any) -> None:
            try:
                send_response(response, header)
            finally:
                self._tell()

        service.send_response = send_and_tell

    def _tell(self) -> None:
        while self._untold.events:
            event = self._untold.events.popleft()
            self._state.tell(event)
            log_request(self._logger, event.request, event.outcome)

    def _list(self, _request: Any, response: Any) -> Any:
        response.instance_id = self._runtime.instance_id
        response.revision = self._runtime.revision
        response.components = component_infos(self._runtime, self._bounds.of_components())
        response.realtime = realtime_status(self._runtime)
        response.resources = resource_infos(self._runtime, self._bound.bindings())
        response.access = self._access()
        response.warnings = self._warnings()
        response.held = held_elements(self._runtime)
        return response

    def _list_tasks(self, _request: Any, response: Any) -> Any:
        response.list = task_list(
            self._runtime, self._runtime.components(), self._bound.bindings(), others=real_time_threads()
        )
        return response

    def _list_changes(self, _request: Any, response: Any) -> Any:
        response.changes = open_change_messages(open_changes(self._runtime), self._runtime)
        if self._runtime.configured:
            response.cleanup, response.cleanup_age_ns = self._runtime.host.disposing()
        response.instance_id, response.revision = self._runtime.instance_id, self._runtime.revision
        return response

    def _abandon_change(self, request: Any, response: Any) -> Any:
        code, response.message = abandon(self._runtime, request.component)
        response.success, response.code = code is Code.OK, int(code)
        response.instance_id, response.revision = self._runtime.instance_id, self._runtime.revision
        text = f"abandon_change {request.component}: {response.message}"
        (self._logger.warning if response.success else self._logger.error)(text)
        return response

    def _read_values(self, request: Any, response: Any) -> Any:
        response.instance_id = self._runtime.instance_id
        response.revision = self._runtime.revision
        found = self._values.read(request.names)
        response.values = [
            value_message(name, value, with_definition=request.with_definitions)
            for name, value in zip(request.names, found, strict=True)
        ]
        return response

    def _mirror(self, request: Any, response: Any) -> Any:
        response.instance_id, response.revision = self._runtime.instance_id, self._runtime.revision
        try:
            if request.stop:
                ended = self._mirrors.end(request.name, request.topic)
                response.topics = [topic for each in ended for topic in topics(each)]
                response.message = f"stopped: {', '.join(each.topic for each in ended)}"
            else:
                mirrored = self._mirrors.start(
                    request.name,
                    field=request.field,
                    topic=request.topic,
                    rate_hz=request.rate_hz or DEFAULT_MIRROR_HZ,
                )
                response.topics, response.type = topics(mirrored), mirrored.type
                names = f", names on {response.topics[1]}" if len(response.topics) > 1 else ""
                response.message = (
                    f"{mirrored.name} is published on {mirrored.topic} ({mirrored.type}{names}), "
                    f"at most {mirrored.rate_hz:g} times a second"
                )
        except MauveError as error:
            response.code, response.message = int(Code.INVALID), str(error)
            return response
        response.success = True
        text = f"mirror: {response.message}"
        self._logger.info(text)
        return response

    def _list_rules(self, _request: Any, response: Any) -> Any:
        response.instance_id = self._runtime.instance_id
        response.revision = self._runtime.revision
        response.rules = self._rules.infos()
        response.held = held_elements(self._runtime)
        return response

    def _on_load_rules(self, request: Any, response: Any) -> Any:
        code, response.message = self._load_rules(request.path, request.release)
        kept = [rule for rule in request.release if self._control.outlasted(rule, KEPT)]
        for rule in kept if code is Code.OK else ():
            outcome = self._control.end_kept(rule)
            code, response.message = outcome.code, f"{response.message}; {outcome.message}"
        return self._answered(response, code, f"rules of {request.path or 'the same file'}")

    def _reset_rule(self, request: Any, response: Any) -> Any:
        code, response.message = Code.INVALID, "name a rule or a component"
        if request.rule:
            code, response.message = self._reset(request.rule)
        elif request.component and self._runtime.configured:
            outcome = self._control.forgive(request.component)
            code, response.message = outcome.code, outcome.message
        return self._answered(response, code, f"reset_rule {request.rule or request.component}")

    def _reset(self, rule: str) -> tuple[Code, str]:
        if self._control.outlasted(rule, KEPT):
            text = f"rule {rule} was active before the restart, and the rules file lacks it"
            return Code.CONDITION_NOT_FALSE, f"{text}; mauve rules release {rule} ends it"
        is_held = self._control.outlasted(rule, HELD_STOPPED)
        is_own = self._rules.is_active(rule) or not is_held
        if is_own and (refusal := self._rules.reset(rule)):
            return Code.CONDITION_NOT_FALSE, refusal
        if is_held:
            outcome = self._control.end_outlasted(rule, HELD_STOPPED)
            if not outcome.success:
                return outcome.code, outcome.message
        return Code.OK, f"rule {rule} has ended"

    def _release_rules(self, request: Any, response: Any) -> Any:
        code, response.message = Code.NOT_ACTIVE, "the executor is not active"
        if self._runtime.configured:
            outcome = self._control.release(request.rule)
            code, response.message = outcome.code, outcome.message
        return self._answered(response, code, f"release_rules {request.rule}")

    def _answered(self, response: Any, code: Code, what: str) -> Any:
        response.success, response.code = code is Code.OK, int(code)
        self._state.refresh(again=True)
        response.instance_id, response.revision = self._runtime.instance_id, self._runtime.revision
        text = f"{what}: {response.message}"
        (self._logger.info if response.success else self._logger.error)(text)
        return response

    def _handler(self, translate: Callable[[Any], Request]) -> Callable[[Any, Any], Any]:
        def handle(ros_request: Any, response: Any) -> Any:
            outcome = self._carry_out(translate(ros_request))
            response.success = outcome.success
            response.code = int(outcome.code)
            response.message = outcome.message
            response.instance_id = self._runtime.instance_id
            response.revision = outcome.revision
            response.report = step_reports(outcome)
            if hasattr(response, "bag"):
                response.bag = outcome.bag
            if hasattr(response, "timing"):
                response.timing = timing_verdicts(outcome)
            if hasattr(response, "loaded"):
                response.loaded = list(outcome.loaded)
            return response

        return handle


def _changes_parameters(request: Request) -> bool:
    """Whether a request that was carried out may have changed parameters of the node."""
    kinds = (STEP_KINDS[step.kind] for step in request.steps)
    return request.reload is not None or any(kind.changes_parameters for kind in kinds)


class _Untold(threading.local):
    """What this thread carried out and has not told of yet."""

    def __init__(self) -> None:
        self.events: deque[Event] = deque()


def is_change(ros: Any) -> bool:
    """Whether a request waits for those before it: all but those of _WAITS_FOR_NONE."""
    if isinstance(ros, Reconfigure.Request):
        return not _reconfigure(ros).is_direct
    return not isinstance(ros, _WAITS_FOR_NONE)


_WAITS_FOR_NONE = (  # a stop or a start by itself, the way out, and what may wait for a disk
    Stop.Request,
    Start.Request,
    ListChanges.Request,
    AbandonChange.Request,
    StartRecording.Request,
    StopRecording.Request,
    WriteSnapshot.Request,
)


def _stop(ros: Any) -> Request:
    step = Step("stop", ros.component)
    return Request(steps=(step,), timeout_s=ros.timeout_s, force=ros.force, **_common(ros))


def _start(ros: Any) -> Request:
    step = Step("start", ros.component)
    return Request(steps=(step,), clock_ns=ros.clock_ns, over=ros.over, **_common(ros))


def _replace_core(ros: Any) -> Request:
    step = Step("replace_core", ros.component, ros.core, _replacement_value(ros))
    return Request(steps=(step,), over=ros.over, base=ros.base, **_commit(ros), **_common(ros))


def _reconfigure(ros: Any) -> Request:
    steps = tuple(Step(step.kind, step.target, step.name, step.value) for step in ros.steps)
    return Request(
        steps=steps,
        dry_run=ros.dry_run,
        rule=ros.rule,
        release=ros.release,
        priority=ros.priority,
        release_on_loss=ros.release_on_loss,
        over=ros.over,
        base=ros.base,
        idle=ros.idle,
        idle_within_s=ros.idle_within_s,
        **_commit(ros),
        **_common(ros),
    )


def _reload(ros: Any) -> Request:
    order = ReloadOrder(targets=tuple(ros.targets), back=ros.back, probation=_probation_value(ros))
    return Request(reload=order, dry_run=ros.dry_run, **_commit(ros), **_common(ros))


def _start_recording(ros: Any) -> Request:
    order = RecordingOrder(
        kind="start",
        bag=ros.bag,
        topics=tuple(ros.topics),
        topic_regexes=tuple(ros.topic_regexes),
        values=tuple(ros.values),
        split_s=ros.split_s,
        split_bytes=ros.split_bytes,
        max_size_bytes=ros.max_size_bytes,
        compression=ros.compression,
        snapshot_s=ros.snapshot_s,
        snapshot_bytes=ros.snapshot_bytes,
    )
    return Request(recording=order, **_common(ros))


def _stop_recording(ros: Any) -> Request:
    return Request(recording=RecordingOrder(kind="stop"), **_common(ros))


def _write_snapshot(ros: Any) -> Request:
    return Request(recording=RecordingOrder(kind="snapshot", bag=ros.bag), **_common(ros))


def _replacement_value(ros: Any) -> str:
    """The value of a step replace_core; empty: at once, and without probation."""
    return _value(_probation_keys(ros) + [f"bumpless: {ros.bumpless}"] * bool(ros.bumpless))


def _probation_value(ros: Any) -> str:
    """What a reload says of a probation, as the value of a step; empty: there is none."""
    return _value(_probation_keys(ros))


def _probation_keys(ros: Any) -> list[str]:
    if ros.probation_s == 0.0 and not ros.revert_on:
        return []
    return [
        f"probation_s: {ros.probation_s!r}",
        f"revert_on: [{', '.join(ros.revert_on)}]",
        f"releases: {ros.probation_releases}",
    ]


def _value(keys: list[str]) -> str:
    return f"{{{', '.join(keys)}}}" if keys else ""


def _commit(ros: Any) -> dict[str, Any]:
    return {"timeout_s": ros.commit_timeout_s, "force": ros.force}


def _common(ros: Any) -> dict[str, Any]:
    return {
        "request_id": ros.request_id,
        "expected_revision": ros.expected_revision,
        "requested_by": ros.requested_by,
        "cause": ros.cause,
    }
