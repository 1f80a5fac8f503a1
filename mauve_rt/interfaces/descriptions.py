"""The executor's values as messages of mauve_msgs."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from mauve_msgs.msg import (
    ArchitectureState,
    ComponentInfo,
    ComponentStatus,
    JobBound,
    OutputCurve,
    PortInfo,
    Probation,
    RealtimeStatus,
    ReconfigurationEvent,
    ResourceInfo,
    Shadow,
    ShadowOutput,
    SlewLimit,
    StateInfo,
    StepReport,
    TaskInfo,
    TaskList,
    TimingVerdict,
    TraceArchitecture,
)
from mauve_msgs.msg import HeldElement as HeldElementMessage
from mauve_msgs.msg import OutputStep as OutputStepMessage
from mauve_rt._kernel import (
    ActionStep,
    ComponentDescription,
    DescribedState,
    HeldElement,
    OutputStep,
    PortDescription,
    ProbationRecord,
    ShadowRecord,
    SlewRecord,
)
from mauve_rt.control.checks import MAX_TEXT
from mauve_rt.control.requests import Outcome, Request
from mauve_rt.control.runtime import Observed, Runtime
from mauve_rt.control.threads import threads_of
from mauve_rt.control.wishes import step_of
from mauve_rt.file_schema.words import cut, shown
from mauve_rt.model.core_times import times_of_other_core
from mauve_rt.model.schema import PropertyValue
from mauve_rt.model.threads import ThreadInfo

if TYPE_CHECKING:
    from mauve_rt.control.bound_watch import WatchedBound

Bounds = Mapping[str, Iterable["WatchedBound"]]

_PORT_KINDS = {"read": PortInfo.READ, "write": PortInfo.WRITE, "call": PortInfo.CALL, "event": PortInfo.EVENT}
_MAX_PRIORITY = 255


def component_info(
    component: ComponentDescription,
    *,
    alternatives: list[str],
    authors: Mapping[str, str],
    code: tuple[int, int] = (0, 0),
    probations: Iterable[ProbationRecord] = (),
    shadows: Iterable[ShadowRecord] = (),
    bounds: "Iterable[WatchedBound]" = (),
    times: Mapping[str, int | None] | None = None,
) -> Any:
    """ComponentInfo; `alternatives`: the cores it takes beside the present one; `authors`: by element.

    `code`: generation of the code, and when it was built; `bounds`: of its jobs; `times`: worst cases of
    its core in place of those of the file (`times_of_other_core`).
    """
    return ComponentInfo(
        name=component.name,
        shell=component.shell,
        core=component.core,
        fsm=component.fsm,
        state=getattr(ComponentInfo, component.state),
        clock_ns=component.clock_ns,
        period_ns=component.period_ns,
        offset_ns=component.offset_ns,
        policy=component.policy,
        priority=min(max(component.priority, 0), _MAX_PRIORITY),
        cpus=list(component.cpus),
        alternatives=alternatives,
        reconfigurable=component.reconfigurable,
        ports=[_port_info(port) for port in component.ports],
        properties=[f"{item.name}={_yaml(item.value)}" for item in component.properties],
        fault=component.fault,
        releases=component.releases,
        overruns=component.overruns,
        skipped=component.skipped,
        **_state_age(component),
        structural=[item.name for item in component.properties if item.structural],
        deadline_ns=component.deadline_ns,
        generation=code[0],
        built_ns=code[1],
        probations=[_probation(record) for record in probations],
        shadows=[shadow_message(record) for record in shadows],
        overrun=component.overrun,
        states=[_state_info(state, times or {}) for state in component.states],
        authors=_authored(authors),
        slew_limits=[slew_limit(record) for record in component.slew_limits],
        bounds=[JobBound(**asdict(bound)) for bound in bounds],
    )


def slew_limit(record: SlewRecord) -> Any:
    """SlewLimit of a number of an output."""
    return _as_message(SlewLimit, record)


def _as_message(message_class: Any, record: object) -> Any:
    """A message whose fields the record has by the same names."""
    return message_class(
        **{name: getattr(record, name) for name in message_class.get_fields_and_field_types()}
    )


def _authored(authors: Mapping[str, str]) -> list[str]:
    return [f"{element or 'component'}={author}" for element, author in authors.items()]


def _state_info(state: DescribedState, times: Mapping[str, int | None]) -> Any:
    info = _as_message(StateInfo, state)
    if state.name in times:
        info.wcet_ns = times[state.name] or 0
    return info


def _state_age(component: ComponentDescription) -> dict[str, Any]:
    """What ComponentInfo and ComponentStatus tell alike."""
    return {
        "current_state": component.current_state,
        "state_age_ns": component.state_age_ns,
        "state_bound_ns": component.state_bound_ns,
        "hung_after_ns": component.hung_after_ns,
        "hung": component.hung,
        "waiting": component.waiting,
    }


def component_infos(runtime: Runtime, bounds: Bounds | None = None) -> list[Any]:
    """ComponentInfo of every component; `bounds`: of the jobs of components, by name."""
    return _component_infos(runtime, runtime.components(), bounds or {})


def _component_infos(
    runtime: Runtime, components: Iterable[ComponentDescription], bounds: Bounds
) -> list[Any]:
    authors = runtime.authors()
    shadows = runtime.shadows()
    probations: dict[str, list[ProbationRecord]] = {}
    for record in runtime.probations():
        probations.setdefault(record.component, []).append(record)
    return [
        component_info(
            part,
            alternatives=runtime.cores_of(part),
            authors=authors.get(part.name, {}),
            code=runtime.code_of(part.core),
            probations=probations.get(part.name, ()),
            shadows=[record for record in shadows if record.component == part.name],
            bounds=bounds.get(part.name, ()),
            times=times_of_other_core(part, runtime.declared(part.name), runtime.registry),
        )
        for part in components
    ]


def resource_infos(runtime: Runtime, bindings: Mapping[str, Mapping[str, Any]]) -> list[Any]:
    """ResourceInfo of every resource; `bindings`: ROS names by resource and field."""
    authors = runtime.authors()
    return [
        ResourceInfo(
            name=resource.name,
            kind=resource.kind,
            type=resource.type,
            author=authors.get(resource.name, {}).get("", ""),
            wait_free=[service.name for service in resource.services if service.is_wait_free],
            memory_bytes=resource.memory_bytes,
            frame=resource.frame,
            child_frame=resource.child_frame,
            **bindings.get(resource.name, {}),
        )
        for resource in runtime.described_resources()
    ]


def trace_architecture(
    runtime: Runtime,
    observed: Observed,
    uses: Mapping[str, Collection[str]],
    *,
    others: Iterable[ThreadInfo] = (),
) -> Any:
    """TraceArchitecture as it was observed; `uses` and `others`: as for task_list."""
    return TraceArchitecture(
        epoch_ns=runtime.deployment_epoch_ns(),
        components=_component_infos(runtime, observed.components, {}),
        threads=task_list(runtime, observed.components, uses, others=others),
    )


def task_list(
    runtime: Runtime,
    components: Sequence[ComponentDescription],
    uses: Mapping[str, Collection[str]],
    *,
    others: Iterable[ThreadInfo] = (),
) -> Any:
    """TaskList; `uses` and `others`: as for `threads_of`."""
    has_bounds = any(
        state.max_execution_ns or state.wcet_enforced for part in components for state in part.states
    )
    known = threads_of(runtime, components, uses, has_bounds=has_bounds, others=others)
    return TaskList(
        wakeup_ns=known.wakeup_ns,
        overhead_ns=known.overhead_ns,
        tasks=[TaskInfo(**_as_fields(each)) for each in known.tasks],
    )


def _as_fields(thread: ThreadInfo) -> dict[str, Any]:
    return {**vars(thread), "cpus": list(thread.cpus)}


def realtime_status(runtime: Runtime) -> Any:
    """RealtimeStatus; nothing granted while unconfigured."""
    status = runtime.realtime_status()
    if status is None:
        return RealtimeStatus()
    return RealtimeStatus(granted=status.granted, missing=list(status.missing))


def architecture_state(
    runtime: Runtime, observed: Observed, stamp: Any, *, error: str = "", rules: Sequence[str] = ()
) -> Any:
    """ArchitectureState as it was observed.

    `error`: why the last lifecycle transition failed; `rules`: that the executor runs.
    """
    authors = runtime.authors()
    overlays = runtime.overlays()
    return ArchitectureState(
        stamp=stamp,
        instance_id=runtime.instance_id,
        revision=observed.revision,
        deployment_epoch_ns=runtime.deployment_epoch_ns(),
        components=[
            ComponentStatus(
                name=component.name,
                state=getattr(ComponentInfo, component.state),
                core=component.core,
                fault=component.fault,
                authors=_authored(authors.get(component.name, {})),
                **_state_age(component),
            )
            for component in observed.components
        ],
        realtime=realtime_status(runtime),
        error=error,
        rules=list(rules),
        active_rules=[overlay.rule for overlay in overlays.active()] if overlays is not None else [],
        held=held_elements(runtime),
    )


def held_elements(runtime: Runtime) -> list[Any]:
    """HeldElement of all that rules or persons have their hand on."""
    overlays = runtime.overlays()
    return [_held(each) for each in overlays.table()] if overlays is not None else []


def _held(element: HeldElement) -> Any:
    wanted = element.wanted
    return HeldElementMessage(
        target=element.target,
        element=element.element,
        base=_step_text(element.base),
        wanted=_step_text(wanted.step),
        holder=f"rule {wanted.rule}" if wanted.by == "rule" else wanted.by,
        rules=element.rules,
    )


def _step_text(assignment: ActionStep | None) -> str:
    return cut(str(step_of(assignment)), MAX_TEXT) if assignment is not None else ""


def _probation(record: ProbationRecord) -> Any:
    return Probation(
        component=record.component,
        from_core=record.from_core,
        to_core=record.to_core,
        verdict=getattr(Probation, record.verdict.upper()),
        reason=record.reason,
        releases=record.releases,
        begin_ns=record.begin_ns,
        end_ns=record.end_ns,
    )


def shadow_message(record: ShadowRecord, *, curves: bool = False) -> Any:
    """Shadow as the kernel describes it; with `curves` of its outputs, 2.5 kB each."""
    return Shadow(
        component=record.component,
        core=record.core,
        live_core=record.live_core,
        verdict=getattr(Shadow, record.verdict.upper()),
        reason=record.reason,
        begin_ns=record.begin_ns,
        end_ns=record.end_ns,
        releases=record.releases,
        compared=record.compared,
        skipped_late=record.skipped_late,
        skipped_budget=record.skipped_budget,
        idle=record.idle,
        over_budget=record.over_budget,
        budget_ns=record.budget_ns,
        largest_execution_ns=record.largest_execution_ns,
        outputs=[
            ShadowOutput(
                port=output.port,
                field=number.path,
                compared=number.count,
                maximum=number.maximum,
                rms=number.rms,
                nan=number.nan,
                live_nan=number.live_nan,
                live_only=output.live_only,
                shadow_only=output.shadow_only,
                has_lag=output.lag is not None,
                lag=output.lag or 0,
            )
            for output in record.outputs
            for number in output.numbers
        ],
        steps=[output_step(step) for step in record.steps],
        curves=[_as_message(OutputCurve, curve) for curve in record.curves] if curves else [],
    )


def output_step(step: OutputStep) -> Any:
    """OutputStep of one output of a bumpless change."""
    return _as_message(OutputStepMessage, step)


def step_reports(outcome: Outcome) -> list[Any]:
    """StepReport of every step."""
    return [
        StepReport(
            **{
                **vars(report),
                "taken": list(report.taken),
                "left": list(report.left),
                "outputs": [output_step(step) for step in report.outputs],
            }
        )
        for report in outcome.report
    ]


def timing_verdicts(outcome: Outcome) -> list[Any]:
    """TimingVerdict of each verdict."""
    return [TimingVerdict(**{**vars(verdict), "missing": [*verdict.missing]}) for verdict in outcome.timing]


def reconfiguration_event(request: Request, outcome: Outcome, *, stamp: Any, instance_id: str) -> Any:
    """ReconfigurationEvent of a request and what came of it."""
    return ReconfigurationEvent(
        stamp=stamp,
        instance_id=instance_id,
        revision=outcome.revision,
        requested_by=cut(request.requested_by, MAX_TEXT),
        request_id=cut(request.request_id, MAX_TEXT),
        request=str(request),
        cause=cut(request.cause, MAX_TEXT),
        success=outcome.success,
        code=int(outcome.code),
        message=outcome.message,
        from_core=outcome.from_core,
        to_core=outcome.to_core,
        report=step_reports(outcome),
    )


def _port_info(port: PortDescription) -> Any:
    return PortInfo(
        name=port.name,
        kind=_PORT_KINDS[port.kind],
        type=port.type,
        resource=port.resource,
        service=port.service,
        longest_hold_ns=port.longest_hold_ns,
        wait_free=port.wait_free,
        frame=port.frame,
        child_frame=port.child_frame,
    )


def _yaml(value: PropertyValue) -> str:
    return f"'{value}'" if isinstance(value, str) else shown(value)
