"""What the executor tells of its health: /diagnostics at 1 Hz."""

import resource
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.lifecycle import LifecycleNode
from rclpy.qos import QoSPolicyKind, QoSProfile

from mauve_rt._bridge import ActionReport, CallReport, TopicReport
from mauve_rt._kernel import (
    HELD_STOPPED,
    ComponentDescription,
    RecentMaxima,
    ResourceDescription,
    RuleFacts,
    ShadowRecord,
    allocation_counting,
)
from mauve_rt.control.open_changes import long_ones, open_changes
from mauve_rt.control.runtime import Runtime
from mauve_rt.control.state_age import in_words
from mauve_rt.counts import counted
from mauve_rt.interfaces.descriptions import held_elements
from mauve_rt.model.schema import DiagnosticsModel, ThresholdModel
from mauve_rt.node.executor.bound_resources import BoundResources
from mauve_rt.node.executor.bounds import WatchedBounds
from mauve_rt.node.executor.recording import Recording, RecordingStatus
from mauve_rt.node.executor.rules import OwnRules
from mauve_rt.node.executor.sentinel import Sentinel
from mauve_rt.node.executor.state_folder import StateFolder
from mauve_rt.node.shared.loopback import udp_backlog
from mauve_rt.supervision.truth import truth_word

if TYPE_CHECKING:
    from mauve_rt.control.bound_watch import WatchedBound

_ONE = ThresholdModel(warn=1)
_DEFAULTS = DiagnosticsModel(overruns=_ONE, allocations=_ONE, page_faults=_ONE)
_PYTHON_DEFAULTS = DiagnosticsModel(overruns=_ONE)  # the interpreter allocates as it runs


class Diagnostics:
    """/diagnostics: of every component, bound topic and service, rule, the bag, the process. On the timer."""

    def __init__(
        self,
        node: LifecycleNode,
        runtime: Runtime,
        bound: BoundResources,
        recording: Recording,
        rules: OwnRules,
        *,
        folder: StateFolder,
        sentinel: Sentinel,
        bounds: WatchedBounds,
    ) -> None:
        self._node = node
        self._runtime = runtime
        self._bound = bound
        self._recording = recording
        self._rules = rules
        self._folder = folder
        self._sentinel = sentinel
        self._bounds = bounds
        self._publisher = node.create_publisher(DiagnosticArray, "/diagnostics", QoSProfile(depth=10))
        self._told: dict[tuple[str, str], int] = {}
        self._allocation_counting = allocation_counting()
        self._backlog = 0  # at the last status

    def publish(self, *, error: str = "", clock: str = "") -> None:
        """Publish once; `error`: why the last lifecycle transition failed; `clock`: its recent step."""
        maxima = {recent.component: recent for recent in self._runtime.take_recent_maxima()}
        parts = [part for part in self._runtime.components() if part.name in maxima]
        bounds = self._bounds.of_components()
        array = DiagnosticArray(
            status=[self._component(part, maxima[part.name], bounds.get(part.name, ())) for part in parts]
        )
        array.header.stamp = self._node.get_clock().now().to_msg()
        others = self._bound.other_types()
        array.status += [self._topic(report, others.get(report.topic)) for report in self._bound.topics()]
        array.status += [self._call(report) for report in self._bound.calls()]
        array.status += [self._action(report) for report in self._bound.actions()]
        array.status += [
            self._refusals(one) for one in self._runtime.described_resources() if one.refused_values
        ]
        array.status += [self._shadow(record) for record in self._runtime.shadows()]
        held = held_elements(self._runtime)
        array.status += [self._rule(facts, held) for facts in self._rules.facts()]
        if (problem := self._folder.problem()) is not None:
            array.status.append(self._restart(problem))
        if (sentinel := self._sentinel.status()) is not None:
            message, is_well = sentinel
            level = DiagnosticStatus.OK if is_well else DiagnosticStatus.ERROR
            array.status.append(self._status("sentinel", level, message, {}))
        if (recording := self._recording.status()) is not None:
            array.status.append(self._bag(recording))
        if late := self._late():
            array.status.append(late)
        array.status.append(self._process(error, clock))
        self._publisher.publish(array)

    def _component(
        self, part: ComponentDescription, recent: RecentMaxima, bounds: "Sequence[WatchedBound]"
    ) -> Any:
        remarks = [*self._remarks(part, recent)]
        violations = sum(one.violations for one in bounds)
        if new := self._more(part.name, "violations", violations):
            text = f"bounds: {counted(new, 'job')} took longer than proved since the last status"
            remarks.append((DiagnosticStatus.WARN, text))
        if part.state == "FAULTED":
            remarks = [(DiagnosticStatus.ERROR, part.fault)]
        elif part.fell_back:
            text = f"fallback core {part.core} runs after a fault: {part.fault}"
            remarks.insert(0, (DiagnosticStatus.WARN, text))
        if part.hung:
            text = f"hung: {in_words(part)}"
            remarks.insert(0, (DiagnosticStatus.ERROR, text))
        level = max((level for level, _ in remarks), default=DiagnosticStatus.OK)
        message = "; ".join(text for _, text in remarks) or part.state.lower()
        values: dict[str, object] = {
            "core": part.core,
            "state": part.current_state,
            "state_age_ns": part.state_age_ns,
            "state_bound_ns": part.state_bound_ns,
            "period_ns": part.period_ns,
            "hung_after_ns": part.hung_after_ns,
            "releases": part.releases,
            "overruns": part.overruns,
            "skipped": part.skipped,
            "wakeup_p50_ns": part.wakeup_p50_ns,
            "wakeup_p99_ns": part.wakeup_p99_ns,
            "wakeup_max_ns": part.wakeup_max_ns,
            "wakeup_recent_max_ns": recent.wakeup_ns,
            "response_recent_max_ns": recent.response_ns,
            "allocations": part.allocations,
            "page_faults": part.page_faults,
        }
        for time in part.execution_times:
            values[f"execution_mean_ns[{time.state}]"] = time.mean_ns
            values[f"execution_max_ns[{time.state}]"] = time.max_ns
            values[f"execution_recent_max_ns[{time.state}]"] = recent.execution_ns.get(time.state, 0)
        for slew in part.slew_limits:
            values[f"slew_limited[{slew.output}]"] = slew.limited
            values[f"slew_not_limited[{slew.output}]"] = slew.not_limited
        if bounds:
            values["violations"] = violations
        for one in bounds:
            job = f"{one.after} -> {one.until}"
            values[f"bound_ns[{job}]"] = one.bound_ns
            values[f"longest_ns[{job}]"] = one.longest_ns
        return self._status(part.name, level, message, values)

    def _refusals(self, resource: ResourceDescription) -> Any:
        """Of a resource that refused values."""
        new = self._more(resource.name, "refused_values", resource.refused_values)
        level = DiagnosticStatus.WARN if new else DiagnosticStatus.OK
        message = f"{resource.refused_values} values refused; the last one: {resource.why_refused_value}"
        return self._status(resource.name, level, message, {"refused_values": resource.refused_values})

    def _remarks(self, part: ComponentDescription, recent: RecentMaxima) -> Iterator[tuple[bytes, str]]:
        """What reached a threshold since the last status: level; measured beside allowed figure."""
        thresholds = self._thresholds(part)
        figures = [
            ("wakeup_max_us", "", recent.wakeup_ns / 1000),
            *(
                ("execution_max_us", f" in state {state}", time_ns / 1000)
                for state, time_ns in recent.execution_ns.items()
            ),
            *(
                (count, "", self._more(part.name, count, getattr(part, count)))
                for count in ("overruns", "skipped", "allocations", "page_faults")
            ),
        ]
        for key, where, measured in figures:
            threshold: ThresholdModel | None = getattr(thresholds, key)
            if threshold is None:
                continue
            for level, word, limit in (
                (DiagnosticStatus.ERROR, "error", threshold.error),
                (DiagnosticStatus.WARN, "warning", threshold.warn),
            ):
                if limit is not None and measured >= limit:
                    yield level, f"{key}{where} {measured:.10g}, {word} from {limit:.10g} on"
                    break

    def _thresholds(self, part: ComponentDescription) -> DiagnosticsModel:
        defaults = _PYTHON_DEFAULTS if self._runtime.has_python_parts(part) else _DEFAULTS
        return defaults.overridden_by(self._runtime.diagnostics(part.name))

    def _topic(self, report: TopicReport, other_types: Sequence[str] | None) -> Any:
        troubles = report.troubles
        counts = {
            "messages refused": report.refused,
            "deadlines missed": troubles.deadlines_missed,
            "publishers lost": troubles.liveliness_lost,
        }
        name = f"topic {report.topic} ({report.resource})"  # several resources may be bound to one
        remarks = self._grown(name, counts)
        if other_types:
            remarks.append(f"other nodes use {' and '.join(other_types)} on it, with whom it does not talk")
        if troubles.incompatible_qos:
            policy = QoSPolicyKind(troubles.policy).name.lower()
            remarks.append(f"another node's quality of service does not fit, in {policy}: they do not talk")
        values: dict[str, object] = {
            "resource": report.resource,
            "messages": report.passed,
            "refused": report.refused,
            "deadlines_missed": troubles.deadlines_missed,
            "liveliness_lost": troubles.liveliness_lost,
            "incompatible_qos": troubles.incompatible_qos,
        }
        return self._remarked(name, remarks, values)

    def _call(self, report: CallReport) -> Any:
        counts = report.counts
        failures = {"calls refused": counts.other}
        if not report.is_offered:
            failures |= {"calls without a server": counts.no_server, "calls timed out": counts.timed_out}
        name = f"service {report.service} ({report.resource})"
        remarks = self._grown(name, failures)
        values: dict[str, object] = {
            "resource": report.resource,
            "side": "server" if report.is_offered else "client",
            "answered": counts.answered,
            "longest_ns": counts.longest_ns,
            "no_server": counts.no_server,
            "timed_out": counts.timed_out,
            "refused": counts.other,
        }
        return self._remarked(name, remarks, values)

    def _action(self, report: ActionReport) -> Any:
        counts = report.counts
        failures = {"goals rejected": counts.rejected, "goals aborted": counts.aborted}
        name = f"action {report.action} ({report.resource})"
        remarks = self._grown(name, failures | {"decisions that fit no goal": counts.refused})
        values: dict[str, object] = {
            "resource": report.resource,
            "side": "server" if report.is_offered else "client",
            "accepted": counts.accepted,
            "rejected": counts.rejected,
            "succeeded": counts.succeeded,
            "canceled": counts.canceled,
            "aborted": counts.aborted,
            "refused_decisions": counts.refused,
        }
        return self._remarked(name, remarks, values)

    def _remarked(self, name: str, remarks: Sequence[str], values: Mapping[str, object]) -> Any:
        level = DiagnosticStatus.WARN if remarks else DiagnosticStatus.OK
        return self._status(name, level, "; ".join(remarks) or "no trouble", values)

    def _shadow(self, record: ShadowRecord) -> Any:
        """A candidate core in the shadow of a component, and how its outputs differ."""
        nans = sum(number.nan for output in record.outputs for number in output.numbers)
        is_wrong = record.verdict == "faulted" or nans > 0
        values: dict[str, object] = {
            "core": record.core,
            "live_core": record.live_core,
            "verdict": record.verdict,
            "releases": record.releases,
            "compared": record.compared,
            "skipped_late": record.skipped_late,
            "skipped_budget": record.skipped_budget,
            "over_budget": record.over_budget,
            "budget_ns": record.budget_ns,
            "largest_execution_ns": record.largest_execution_ns,
        }
        for output in record.outputs:
            values[f"lag[{output.port}]"] = "" if output.lag is None else output.lag
            for number in output.numbers:
                name = f"{output.port}.{number.path}"
                values[f"max_difference[{name}]"] = number.maximum
                values[f"rms_difference[{name}]"] = number.rms
                values[f"nan[{name}]"] = number.nan
        message = f"{record.core}: {record.verdict}{f', {record.reason}' if record.reason else ''}"
        level = DiagnosticStatus.WARN if is_wrong else DiagnosticStatus.OK
        return self._status(f"{record.component} shadow", level, message, values)

    def _rule(self, facts: RuleFacts, held: Sequence[Any]) -> Any:
        """What cannot be made ready is told before it is needed."""
        status = facts.status
        level, message = DiagnosticStatus.OK, _standing(facts)
        if facts.problem:
            level, message = DiagnosticStatus.ERROR, f"cannot act: {facts.problem}"
        values: dict[str, object] = {
            "armed": status.armed,
            "condition": truth_word(status),
            "in_effect": status.in_effect,
            "ready": facts.ready,
            "measured": status.measured,
            "memory_bytes": facts.memory_bytes,
        }
        for one in held:
            if facts.name in one.rules:
                what = f"{one.element or 'presence'} of {one.target}"
                values |= {
                    f"{what}: wanted": one.wanted,
                    f"{what}: holder": one.holder,
                    f"{what}: base": one.base,
                }
        return self._status(f"rule {facts.name}", level, message, values)

    def _restart(self, problem: str) -> Any:
        """What would not outlast a restart, and what one left stopped."""
        overlays = self._runtime.overlays()
        held = overlays.at_work(HELD_STOPPED) if overlays is not None else []
        remarks = [problem] if problem else []
        for overlay in held:
            components = ", ".join(step.target for step in overlay.assigns)
            remarks.append(f"stopped until mauve rules reset {overlay.rule}: {components}")
        level = DiagnosticStatus.ERROR if remarks else DiagnosticStatus.OK
        return self._status("state folder", level, "; ".join(remarks) or "what is decided is kept", {})

    def _late(self) -> Any:
        """The changes that are open for long; None: there is none."""
        changes = open_changes(self._runtime)
        lines = list(long_ones(changes, self._runtime.host.now_ns())) if changes else []
        if not lines:
            return None
        return self._status("changes", DiagnosticStatus.WARN, "; ".join(lines), {"open": len(changes)})

    def _bag(self, status: RecordingStatus) -> Any:
        counts = {
            "messages dropped": status.dropped,
            "messages of other nodes lost before the recorder received them": status.lost_before,
        }
        remarks = self._grown("recording", counts)
        level = DiagnosticStatus.WARN if remarks else DiagnosticStatus.OK
        recording = "recording into memory" if status.in_memory else "recording"
        message = "; ".join(remarks) or (recording if status.recording else "stopped")
        if not (status.recording or status.is_complete):
            level, message = DiagnosticStatus.ERROR, "stopped, not complete: its disk has not answered"
        if status.error:
            level, message = DiagnosticStatus.ERROR, status.error
        values: dict[str, object] = {
            "bag": status.bag,
            "messages": status.messages,
            "dropped_messages": status.dropped,
            "lost_before": status.lost_before,
        }
        for topic, entry in status.others.items():
            values[f"received[{topic}]"] = entry.received
            values[f"lost_before[{topic}]"] = entry.lost_before if entry.numbered else "not known"
            values[f"lost[{topic}]"] = entry.lost
        return self._status("recording", level, message, values)

    def _grown(self, name: str, counts: Mapping[str, int]) -> list[str]:
        """Those of these counts that grew since the last status, in words."""
        grown = {what: self._more(name, what, count) for what, count in counts.items()}
        return [f"{more} {what} since the last status" for what, more in grown.items() if more > 0]

    def _more(self, component: str, what: str, count: int) -> int:
        """How much it grew since it was told last; a start of the component counts anew."""
        before = self._told.get((component, what), 0)
        self._told[component, what] = count
        return count - before if count >= before else count

    def _process(self, error: str, clock: str) -> Any:
        status = self._runtime.realtime_status()
        missing = list(status.missing) if status is not None else []
        usage = resource.getrusage(resource.RUSAGE_SELF)
        level = DiagnosticStatus.WARN if missing else DiagnosticStatus.OK
        message = "without real-time rights" if missing else "real-time rights granted"
        before, self._backlog = self._backlog, udp_backlog()
        if before and self._backlog:
            level = DiagnosticStatus.WARN
            message = f"a network interface stands still: {self._backlog} bytes wait, and more are dropped"
        if clock:
            level, message = DiagnosticStatus.WARN, clock
        if left_behind := self._runtime.threads_left_behind():
            level, message = (
                DiagnosticStatus.WARN,
                f"{left_behind} threads of removed components still execute",
            )
        if error:
            level, message = DiagnosticStatus.ERROR, error
        values = {
            "revision": self._runtime.revision,
            "missing": "; ".join(missing),
            "threads_left_behind": left_behind,
            "udp_backlog_bytes": self._backlog,
            "page_faults_major": usage.ru_majflt,
            "page_faults_minor": usage.ru_minflt,
            "allocation_counting": self._allocation_counting,
        }
        return self._status("process", level, message, values)

    def _status(self, name: str, level: bytes, message: str, values: Mapping[str, object]) -> Any:
        return DiagnosticStatus(
            level=level,
            name=f"{self._node.get_fully_qualified_name()}: {name}",
            message=message,
            hardware_id=self._node.get_namespace(),
            values=[KeyValue(key=key, value=str(value)) for key, value in values.items()],
        )


def _standing(facts: RuleFacts) -> str:
    """How a rule stands, in words."""
    status = facts.status
    if not status.armed:
        return "not armed: what it is about does not run"
    if status.in_effect:
        return "in effect"
    if status.active:
        return "active: what it does is not done yet"
    if not status.known:
        return "its condition is unknown: nothing was received yet of what it is about"
    return "its condition holds" if status.holds else "watching"
