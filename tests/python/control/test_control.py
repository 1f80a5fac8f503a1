"""Requests to an executor, carried out on real components without ROS."""

import struct
import threading
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from mauve_rt._kernel import ComponentDescription
from mauve_rt.control import control as executor_control
from mauve_rt.control.control import Control
from mauve_rt.control.reports import message_of, reports_of
from mauve_rt.control.requests import NOT_MEASURED, OVER_RULES, Code, Outcome, Request, Step
from mauve_rt.control.runtime import Runtime
from mauve_rt.interfaces.descriptions import component_infos
from mauve_rt.model import load_architecture
from mauve_rt.trace.format.records import Kind

PATIENCE_S = 100.0
FILE = """\
mauve: 1
executor: {namespace: /robot_1}
components:
  counter: {shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm,
            alternatives: [executor_tests/Backwards, executor_tests/Reluctant, executor_tests/CalmFsm,
                           executor_tests/EventFsm, executor_tests/TwinShell, executor_tests/Twin,
                           executor_tests/TwinFsm]}
  guard: {shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm,
          reconfigurable: false}
  brave: {shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm,
          fallback: executor_tests/Backwards}
  free: {shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm,
         alternatives: [executor_tests/Backwards]}
resources:
  count: {kind: shared_data, type: std_msgs/msg/Float64}
  poison: {kind: shared_data, type: std_msgs/msg/Float64, topic: {name: poison, direction: subscribe}}
connections:
  - [counter.count, count.write]
  - [brave.set, poison.read]
"""
COUNTER = (
    "{shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm, "
    "alternatives: [executor_tests/Backwards], properties: {step: 3.0, list_file: a.txt}, priority: 30}"
)
POISON = b"\0\1\0\0" + struct.pack("<d", -1e7)  # in CDR; what the core calls unheard of
NUMBER = "{kind: shared_data, type: std_msgs/msg/Float64}"
ADD = (
    Step("add_resource", "sum", "", NUMBER[:-1] + ", longest_hold_ns: 4000}"),
    Step("add_component", "second", "", COUNTER),
    Step("connect", "second", "count", "sum.write"),
    Step("connect", "second", "set", "count.read"),
    Step("start", "second"),
)
REMOVE = (Step("stop", "second"), Step("remove_component", "second"), Step("remove_resource", "sum"))


@pytest.fixture
def control(runtime: Runtime) -> Control:
    return Control(runtime)


def _ask(control: Control, *steps: Step, dry_run: bool = False, expected_revision: int = 0) -> Outcome:
    return control.handle(Request(steps=steps, dry_run=dry_run, expected_revision=expected_revision))


def _followed(outcome: Outcome) -> Outcome:
    """With what the releases after it tell."""
    while outcome.pending is not None:
        outcome = outcome.pending.look(outcome, wait_ns=100_000_000)
    return outcome


def _part(runtime: Runtime, name: str) -> ComponentDescription:
    return next(part for part in runtime.components() if part.name == name)


def _look(runtime: Runtime) -> tuple[object, ...]:
    parts = [
        (
            *(part.name, part.state, part.shell, part.core, part.fsm, part.period_ns),
            [(port.name, port.resource, port.service) for port in part.ports],
            [(item.name, item.value) for item in part.properties],
        )
        for part in runtime.components()
    ]
    return (parts, runtime.resources(), runtime.revision)


def _wait(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.005)


class _Spy:
    """A deployer that writes down by which options it was asked."""

    def __init__(self, deployer: Any) -> None:
        self._deployer = deployer
        self.options: list[dict[str, int]] = []

    def __getattr__(self, name: str) -> Any:
        return getattr(self._deployer, name)

    def make(self, transaction: Any, **options: int) -> Any:
        self.options.append(options)
        return self._deployer.make(transaction, **options)


@pytest.mark.parametrize(
    ("name", "text", "value"),
    [
        *(("label", text, text) for text in ("007", "1e3", "true", "null", "0x10")),
        ("label", "'007'", "007"),
        ("step", '"5e-06"', 5e-06),
        ("step", "1e-3", 1e-3),
    ],
)
def test_a_property_is_set_by_its_declared_type(
    runtime: Runtime, control: Control, name: str, text: str, value: object
) -> None:
    outcome = _ask(control, Step("set_property", "counter", name, text))
    assert outcome.success, outcome.message
    present = {item.name: item.value for item in _part(runtime, "counter").properties}
    assert present[name] == value


def test_force_is_the_kernel_s_to_use(
    runtime: Runtime, control: Control, monkeypatch: pytest.MonkeyPatch
) -> None:
    spy = _Spy(runtime.host)
    monkeypatch.setattr(runtime, "_host", spy)
    step = Step("replace_core", "counter", "executor_tests/Backwards")
    for force in (False, True):
        assert control.handle(Request(steps=(step,), force=force)).success
    assert [options["force"] for options in spy.options] == [False, True]
    outcome = control.handle(Request(steps=(Step("stop", "counter"),), timeout_s=10.0, force=True))
    assert (outcome.success, outcome.message) == (True, "component 'counter' is stopped"), "it was well"
    assert _part(runtime, "counter").state == "STOPPED"


def test_an_idle_change_is_made_while_no_job_is_pending_and_says_so(
    runtime: Runtime, control: Control, monkeypatch: pytest.MonkeyPatch
) -> None:
    spy = _Spy(runtime.host)
    monkeypatch.setattr(runtime, "_host", spy)
    step = Step("set_property", "counter", "step", "2.0")
    plain = control.handle(Request(steps=(step,)))
    idle = control.handle(Request(steps=(step,), idle=True, idle_within_s=2.5))
    assert (plain.success, idle.success) == (True, True), idle.message
    assert "no job" not in plain.message
    assert "; made while no job of a participant was pending" in idle.message
    stopped = control.handle(Request(steps=(Step("stop", "counter"),), idle=True))
    assert stopped.success, stopped.message
    assert [(options["idle"], options["idle_within_ns"]) for options in spy.options] == [
        (False, 1_000_000_000),
        (True, 2_500_000_000),
        (True, 1_000_000_000),
    ], "a stop alone is a transaction, too"
    refused = control.handle(Request(steps=(step,), idle=True, idle_within_s=11.0))
    assert (refused.code, "bad idle_within_s: expected 0" in refused.message) == (Code.INVALID, True)


def test_the_report_of_a_late_component_has_the_instant_and_no_release() -> None:
    late = SimpleNamespace(
        component="a",
        blackout_ns=0,
        missed_releases=0,
        phase_nominal_ns=0,
        phase_actual_ns=NOT_MEASURED,
        from_core="",
        to_core="",
        remark="it is late",
        instant_ns=7_000_001,
        release_ns=NOT_MEASURED,
        taken=["sum"],
        left=[],
        outputs=[],
    )
    measured: Any = SimpleNamespace(steps=[late], prepare_ns=5, blackout_ns=0, is_complete=False)
    (report,) = reports_of((Step("set_property", "a", "x", "1"),), measured)
    assert (report.instant_ns, report.release_ns) == (7_000_001, NOT_MEASURED)
    assert (report.blackout_ns, report.remark) == (NOT_MEASURED, "it is late")


def test_releases_that_were_missed_are_in_the_message() -> None:
    steps = (Step("replace_core", "a", "p/B"), Step("set_property", "a", "x", "1"), Step("stop", "b"))
    nothing = SimpleNamespace(component="a", missed_releases=0, from_core="p/A", to_core="p/B")
    two = SimpleNamespace(component="a", missed_releases=2, remark="its new grid began later")
    unknown = SimpleNamespace(component="b", missed_releases=NOT_MEASURED)
    measured: Any = SimpleNamespace(steps=[nothing], prepare_ns=0, blackout_ns=0, is_idle=False)
    assert message_of(steps[:1], measured) == "component 'a' runs p/B, in place of p/A"
    measured.steps = [two, two, unknown]
    done = "3 steps are in force; prepared in 0 ms"
    assert (
        message_of(steps, measured) == f"{done}; component 'a' missed 2 releases (its new grid began later)"
    )


def test_a_transaction_adds_wires_and_starts_and_another_one_removes(
    runtime: Runtime, control: Control, tmp_path: Path
) -> None:
    before = _look(runtime)
    outcome = _ask(control, *ADD)
    assert outcome.success, outcome.message
    assert outcome.message.startswith("5 steps are in force; prepared in ")
    assert [report.step for report in outcome.report] == [
        "add_resource sum",
        "add_component",
        "connect count sum.write",
        "connect set count.read",
        "start",
    ]
    assert outcome.revision > before[2]
    second = _part(runtime, "second")
    assert second.state == "RUNNING"
    assert {port.name: port.resource for port in second.ports} == {"set": "count", "count": "sum"}
    assert {port.name: port.longest_hold_ns for port in second.ports} == {"set": 0, "count": 4000}
    values = {item.name: item.value for item in second.properties}
    assert (values["step"], values["list_file"]) == (3.0, str(tmp_path / "a.txt"))
    assert runtime.cores_of(second) == ["executor_tests/Backwards"]
    _wait(lambda: runtime.host.read_resource("sum")[1] > 0)
    replaced = _ask(control, Step("replace_core", "second", "executor_tests/Backwards"))
    assert replaced.success, replaced.message
    removed = _ask(control, *REMOVE)
    assert removed.success, removed.message
    assert _look(runtime)[:2] == before[:2]
    assert _ask(control, Step("stop", "second")).code is Code.UNKNOWN_COMPONENT
    assert "second" in runtime.host.trace_components()


def test_a_dry_run_prepares_everything_and_changes_nothing(runtime: Runtime, control: Control) -> None:
    before = _look(runtime)
    outcome = _ask(control, *ADD, dry_run=True)
    assert outcome.success, outcome.message
    assert outcome.message.endswith("would be accepted")
    assert not outcome.report
    refused = _ask(control, Step("replace_core", "free", "executor_tests/Twin"), dry_run=True)
    assert (refused.from_core, refused.to_core) == ("", ""), "of what did not happen"
    assert refused.code is Code.UNDECLARED_CORE
    assert _look(runtime) == before


REFUSED = {
    "a third step that fails": (
        (ADD[0], ADD[1], Step("connect", "second", "count", "sum.read")),
        Code.INVALID,
        "step 3 (connect second.count sum.read)",
    ),
    "no such port": ((Step("connect", "free", "cuont", "count.write"),), Code.INVALID, "no such port"),
    "no such resource": (
        (Step("connect", "free", "count", "cuont.write"),),
        Code.INVALID,
        "no such resource",
    ),
    "no service": ((Step("connect", "free", "count", "count"),), Code.INVALID, "expected resource.service"),
    "connected": ((Step("connect", "counter", "count", "count.write"),), Code.INVALID, "connected already"),
    "not connected": ((Step("disconnect", "free", "count"),), Code.INVALID, "is not connected"),
    "still connected": ((Step("remove_resource", "count"),), Code.INVALID, "disconnect these"),
    "topic": (
        (Step("add_resource", "x", "", NUMBER[:-1] + ", topic: {name: x, direction: publish}}"),),
        Code.UNSUPPORTED,
        "nothing can be bound to ROS here; leave its topic or service out",
    ),
    "two names": ((ADD[0], ADD[0]), Code.INVALID, "step 2 (add_resource sum {kind"),
    "a component's name": ((Step("add_resource", "free", "", NUMBER),), Code.INVALID, "there is a component"),
    "no YAML": ((Step("add_resource", "x", "", "{kind: "),), Code.INVALID, "not YAML"),
    "no mapping": ((Step("add_component", "x", "", "5"),), Code.INVALID, "expected a mapping, found 5"),
    "no name": ((Step("add_component", "x y", "", COUNTER),), Code.INVALID, "bad name 'x y'"),
    "unknown key": (
        (Step("add_component", "x", "", COUNTER.replace("priority", "prioritty")),),
        Code.INVALID,
        "unknown key 'prioritty' of component 'x'; did you mean priority?",
    ),
    "core that is not installed": (
        (Step("add_component", "x", "", COUNTER.replace("/Counter,", "/Countr,")),),
        Code.UNKNOWN_CORE,
        "did you mean executor_tests/Counter?",
    ),
    "core for another shell": (
        (Step("add_component", "x", "", COUNTER.replace("/Counter,", "/Twin,")),),
        Code.INVALID,
        "'executor_tests/Twin' does not fit component 'x'",
    ),
    "fsm": (
        (Step("replace_fsm", "free", "executor_tests/CalmFsm"),),
        Code.UNDECLARED_CORE,
        "declared: component 'free' takes executor_tests/CounterFsm; name it among its alternatives",
    ),
    "shell": (
        (Step("replace_shell", "counter", "os/Shell"),),
        Code.UNKNOWN_CORE,
        "package 'os' is not found",
    ),
    "shell alone": (
        (Step("replace_shell", "counter", "executor_tests/TwinShell"),),
        Code.PREPARE_FAILED,
        "counter",
    ),
    "protected": (
        (Step("stop", "free"), Step("disconnect", "guard", "count")),
        Code.NOT_RECONFIGURABLE,
        "step 2 (disconnect guard count): component 'guard' is protected",
    ),
    "protected from removal": ((Step("remove_component", "guard"),), Code.NOT_RECONFIGURABLE, "is protected"),
    "running": (
        (Step("stop", "free"), Step("start", "counter")),
        Code.ALREADY_RUNNING,
        "step 2 (start counter)",
    ),
    "stopped": ((Step("stop", "free"), Step("stop", "free")), Code.NOT_RUNNING, "step 2 (stop free)"),
    "adopt": (
        (*ADD, Step("replace_core", "counter", "executor_tests/Reluctant")),
        Code.ADOPT_REFUSED,
        "step 6 (replace_core counter executor_tests/Reluctant)",
    ),
    "property of an added one": (
        (ADD[1], Step("set_property", "second", "step", "11")),
        Code.INVALID,
        "step 2 (set_property second step 11): property 'step' of component 'second': expected at least 0",
    ),
}


def test_a_refusal_names_the_step_and_changes_nothing(runtime: Runtime, control: Control) -> None:
    before = _look(runtime)
    for name, (steps, code, words) in REFUSED.items():
        outcome = _ask(control, *steps)
        assert words in outcome.message, name
        assert outcome.code is code, f"{name}: {outcome.message}"
        assert not outcome.report, name
        assert _look(runtime) == before, name


def test_properties_are_set_before_the_start_and_between_two(tmp_path: Path, plugin_prefix: Path) -> None:
    path = tmp_path / "robot.yaml"
    path.write_text(FILE, encoding="utf-8")
    runtime = Runtime(lambda: load_architecture(path))
    control = Control(runtime)
    steps = (Step("set_property", "free", "step", "2.5"), Step("set_property", "counter", "enabled", "false"))
    refused = _ask(control, *steps)
    assert (refused.code, "configure it first" in refused.message) == (Code.NOT_ACTIVE, True)
    runtime.configure()
    revision = runtime.revision
    outcome = _ask(control, *steps)
    assert outcome.success, outcome.message
    assert outcome.revision > revision
    assert {item.name: item.value for item in _part(runtime, "free").properties}["step"] == 2.5
    assert _ask(control, *steps, Step("set_property", "free", "step", "11")).code is Code.INVALID
    assert _ask(control, Step("set_property", "guard", "step", "2")).code is Code.NOT_RECONFIGURABLE
    refused = _ask(control, *steps, Step("stop", "free"))
    assert (refused.code, "activate it first" in refused.message) == (Code.NOT_ACTIVE, True)
    runtime.activate()
    assert {item.name: item.value for item in _part(runtime, "free").properties}["step"] == 2.5
    runtime.deactivate()
    runtime.cleanup()


def test_components_stop_in_the_reverse_order_of_the_file(runtime: Runtime) -> None:
    names = [part.name for part in runtime.components()]
    _wait(lambda: all(part.releases > 0 for part in runtime.components()))
    runtime.deactivate()
    records = struct.iter_unpack("<QqqqqIHH", runtime.host.drain_trace().records)
    stops = sorted((time_ns, component) for _, time_ns, *_, kind, component in records if kind == Kind.STOP)
    assert [runtime.host.trace_components()[component] for _, component in stops] == names[::-1]


def test_expected_revision(runtime: Runtime, control: Control) -> None:
    revision = runtime.revision
    assert _ask(control, *ADD, expected_revision=revision + 1).code is Code.WRONG_REVISION
    outcome = _ask(control, *ADD, expected_revision=revision)
    assert outcome.success, outcome.message
    assert _ask(control, *REMOVE, expected_revision=revision).code is Code.WRONG_REVISION
    assert _ask(control, *REMOVE, expected_revision=outcome.revision).success


def test_an_fsm_is_replaced_with_its_grid(runtime: Runtime, control: Control) -> None:
    outcome = _ask(control, Step("replace_fsm", "counter", "executor_tests/CalmFsm"))
    assert outcome.success, outcome.message
    counter = _part(runtime, "counter")
    assert (counter.fsm, counter.period_ns) == ("executor_tests/CalmFsm", 30_000_000)
    (report,) = outcome.report
    assert report.step == "replace_fsm executor_tests/CalmFsm"
    assert report.blackout_ns > 0
    assert report.phase_nominal_ns == 0
    (report,) = _followed(outcome).report
    assert report.phase_actual_ns != NOT_MEASURED
    assert _ask(control, Step("replace_fsm", "counter", "executor_tests/EventFsm")).success
    assert _part(runtime, "counter").period_ns == 0, "it waits for events"
    assert _ask(control, Step("replace_fsm", "counter", "executor_tests/CounterFsm")).success, "its own"


def test_all_parts_are_replaced_as_one(runtime: Runtime, control: Control) -> None:
    outcome = _ask(
        control,
        Step("replace_shell", "counter", "executor_tests/TwinShell"),
        Step("replace_core", "counter", "executor_tests/Twin"),
        Step("replace_fsm", "counter", "executor_tests/TwinFsm"),
        Step("set_property", "counter", "factor", "4.0"),
    )
    assert outcome.success, outcome.message
    assert (outcome.from_core, outcome.to_core) == ("executor_tests/Counter", "executor_tests/Twin")
    counter = _part(runtime, "counter")
    assert (counter.shell, counter.core) == ("executor_tests/TwinShell", "executor_tests/Twin")
    assert {item.name: item.value for item in counter.properties} == {"step": 1.0, "factor": 4.0}
    assert runtime.cores_of(counter) == [], "cores for the other shell fit no more"


def test_a_core_replaced_by_its_like_counts_as_a_change(runtime: Runtime, control: Control) -> None:
    before = runtime.revision
    outcome = _ask(control, Step("replace_core", "counter", "executor_tests/Counter"))
    assert (outcome.success, outcome.revision) == (True, before + 1)


def test_a_fallback_core_takes_over_and_tells_the_fault(runtime: Runtime, control: Control) -> None:
    before = runtime.revision
    assert runtime.host.write_resource("poison", POISON)
    _wait(lambda: _part(runtime, "brave").fell_back)
    brave = _part(runtime, "brave")
    assert (brave.state, brave.core, brave.fallback) == ("RUNNING", *["executor_tests/Backwards"] * 2)
    assert "set to something unheard of (in state Count" in brave.fault
    runtime.observe()
    assert runtime.revision > before
    outcome = _ask(control, Step("replace_core", "brave", "executor_tests/Counter"))
    assert outcome.success, outcome.message
    brave = _part(runtime, "brave")
    assert (brave.core, brave.fell_back, brave.fault) == ("executor_tests/Counter", False, "")
    fallback = _ask(control, Step("replace_core", "brave", "executor_tests/Backwards"))
    assert fallback.success, "declared as the fallback"


def test_a_faulted_component_can_be_removed(runtime: Runtime, control: Control) -> None:
    steps = (
        Step("add_component", "weak", "", COUNTER),
        Step("connect", "weak", "set", "poison.read"),
        Step("start", "weak"),
    )
    assert _ask(control, *steps).success
    runtime.host.write_resource("poison", POISON)
    _wait(lambda: _part(runtime, "weak").state == "FAULTED")
    refused = _ask(control, Step("set_property", "weak", "step", "2.0"))
    assert (refused.code, "remove it" in refused.message) == (Code.FAULTED, True)
    assert _ask(control, Step("remove_component", "weak")).success
    assert "weak" not in [part.name for part in runtime.components()]


@pytest.mark.parametrize(
    "repair", [Step("configure", "weak"), Step("replace_core", "weak", "executor_tests/Counter")]
)
def test_a_faulted_component_is_repaired_in_place(runtime: Runtime, control: Control, repair: Step) -> None:
    steps = (
        Step("add_component", "weak", "", COUNTER),
        Step("connect", "weak", "set", "poison.read"),
        Step("start", "weak"),
    )
    assert _ask(control, *steps).success
    runtime.host.write_resource("poison", POISON)
    _wait(lambda: _part(runtime, "weak").state == "FAULTED")
    refused = _ask(control, Step("start", "weak"))
    assert (refused.code, "replace_core" in refused.message) == (Code.FAULTED, True)
    runtime.host.write_resource("poison", b"\0\1\0\0" + struct.pack("<d", 1.0))
    outcome = _ask(control, repair)
    assert outcome.success, outcome.message
    assert (_part(runtime, "weak").state, _part(runtime, "weak").fault) == ("STOPPED", "")
    outcome = _ask(control, Step("start", "weak"))
    assert outcome.success, outcome.message
    _wait(lambda: _part(runtime, "weak").releases > 0)
    assert _part(runtime, "weak").state == "RUNNING"
    assert runtime.threads_left_behind() == 0


def test_every_step_names_the_core_that_it_changed(runtime: Runtime, control: Control) -> None:
    outcome = _ask(
        control,
        Step("replace_core", "free", "executor_tests/Backwards"),
        Step("set_property", "free", "step", "2.0"),
        Step("set_property", "counter", "step", "3.0"),
        Step("add_component", "second", "", COUNTER),
    )
    assert outcome.success, outcome.message
    assert [(report.component, report.from_core, report.to_core) for report in outcome.report] == [
        ("free", "executor_tests/Counter", "executor_tests/Backwards"),
        ("free", "", ""),
        ("counter", "", ""),
        ("second", "", ""),
    ]
    followed = _followed(outcome)
    assert [report.to_core for report in followed.report] == [report.to_core for report in outcome.report]
    assert all(report.phase_actual_ns != NOT_MEASURED for report in followed.report[:3])
    (instant_ns,) = {report.instant_ns for report in (*outcome.report[:3], *followed.report[:3])}
    assert instant_ns != NOT_MEASURED
    assert all(report.release_ns >= instant_ns for report in followed.report[:3])
    added = followed.report[3]
    assert (added.instant_ns, added.release_ns) == (NOT_MEASURED, NOT_MEASURED)


def test_changes_made_at_once_have_a_revision_each(runtime: Runtime, control: Control) -> None:
    steps = [Step("stop", "free"), Step("start", "free")] * 20
    steps += [Step("set_property", "counter", "step", f"{number / 10}") for number in range(20)]
    outcomes: list[Outcome] = []
    threads = [
        threading.Thread(target=lambda part=part: outcomes.extend(_ask(control, step) for step in part))
        for part in (steps[:40], steps[40:])
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(outcome.success for outcome in outcomes), [outcome.message for outcome in outcomes]
    revisions = [outcome.revision for outcome in outcomes]
    assert len(set(revisions)) == len(steps)
    assert runtime.revision == max(revisions)


def test_what_is_stopped_while_a_request_is_planned_is_another_revision(
    runtime: Runtime, control: Control, monkeypatch: pytest.MonkeyPatch
) -> None:
    revision = runtime.revision
    plan = executor_control.Plan

    def stop_meanwhile(steps: tuple[Step, ...], *rest: Any, **limits: Any) -> Any:
        if steps[0].kind == "set_property" and _part(runtime, "free").state == "RUNNING":
            assert _ask(control, Step("stop", "free")).success
        return plan(steps, *rest, **limits)

    monkeypatch.setattr(executor_control, "Plan", stop_meanwhile)
    steps = (Step("set_property", "counter", "step", "2.0"), Step("set_property", "brave", "step", "2.0"))
    refused = _ask(control, *steps, expected_revision=revision)
    assert refused.code is Code.WRONG_REVISION
    assert f"is at revision {runtime.revision}, the request expected {revision};" in refused.message
    assert _ask(control, Step("start", "free")).success
    assert _ask(control, *steps).success, "who names no revision is concerned by its own components only"


@pytest.mark.parametrize(("kind", "target"), [("stop", "brave"), ("start", "free")])
def test_a_start_or_stop_is_refused_after_a_change_that_it_has_not_seen(
    runtime: Runtime, control: Control, monkeypatch: pytest.MonkeyPatch, kind: str, target: str
) -> None:
    assert _ask(control, Step("stop", "free")).success
    revision, plan = runtime.revision, executor_control.Plan

    def change_meanwhile(steps: tuple[Step, ...], *rest: Any, **limits: Any) -> Any:
        if steps[0].kind == kind:
            runtime.host.set_property("counter", "step", 2.0)
        return plan(steps, *rest, **limits)

    monkeypatch.setattr(executor_control, "Plan", change_meanwhile)
    state = _part(runtime, target).state
    refused = _ask(control, Step(kind, target), expected_revision=revision)
    assert refused.code is Code.WRONG_REVISION
    assert f"is at revision {revision + 1}, the request expected {revision};" in refused.message
    assert _part(runtime, target).state == state
    assert _ask(control, Step(kind, target)).success, "a request that names no revision goes on"


def test_the_author_of_each_change_is_known(runtime: Runtime, control: Control) -> None:
    assert runtime.authors() == {}, "all is from the file"
    steps = (
        Step("replace_core", "counter", "executor_tests/Backwards"),
        Step("set_property", "counter", "step", "3"),
        Step("connect", "counter", "set", "count.read"),
    )
    for request in (
        Request(steps=steps, requested_by="mauve", cause="slower, please"),
        Request(steps=ADD, rule="second_sight", requested_by="/supervisor", cause="nobody reads this"),
        Request(steps=(Step("stop", "free"),), requested_by="console"),
        Request(steps=(Step("replace_core", "free", "executor_tests/Backwards"),), dry_run=True),
    ):
        outcome = control.handle(request)
        assert outcome.success, outcome.message
    by_mauve = "mauve: slower, please"
    assert runtime.authors() == {
        "counter": {"core": by_mauve, "port set": by_mauve, "property step": by_mauve},
        "second": {
            "": "rule second_sight",
            "port count": "rule second_sight",
            "port set": "rule second_sight",
            "state": "rule second_sight",
        },
        "sum": {"": "rule second_sight"},
        "free": {"state": "console"},
    }
    (info,) = (part for part in component_infos(runtime) if part.name == "counter")
    assert info.authors == [
        f"core={by_mauve}",
        f"port set={by_mauve}",
        f"property step={by_mauve}",
    ]
    assert control.handle(Request(steps=REMOVE, requested_by="mauve", over=OVER_RULES)).success
    assert {target: runtime.authors()[target] for target in ("second", "sum")} == {
        "second": {"": "mauve"},
        "sum": {"": "mauve"},
    }


def test_the_author_of_a_core_that_took_over_is_the_fallback(runtime: Runtime, control: Control) -> None:
    assert _ask(control, Step("replace_core", "brave", "executor_tests/Counter")).success
    assert runtime.authors() == {"brave": {"core": "a request"}}
    runtime.host.write_resource("poison", POISON)
    _wait(lambda: _part(runtime, "brave").fell_back)
    assert runtime.authors() == {"brave": {"core": "fallback"}}
