"""The executor's services, over ROS, with real components."""

from typing import Any

import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Float64

from mauve_msgs.msg import ArchitectureState, ComponentInfo, ReconfigurationStep
from mauve_msgs.srv import ListComponents, Reconfigure, ReplaceCore, Start, Stop
from mauve_rt.control.requests import NOT_MEASURED, Code

NODE = "/robot_1/executor"
NO_TYPE = "{kind: shared_data, type: std_msgs/msg/Flaot64, topic: {name: late, direction: publish}}"
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)

pytestmark = pytest.mark.usefixtures("executor")


def _component(graph: Any, name: str) -> Any:
    reply = graph.ask(ListComponents, f"{NODE}/list_components")
    return next(component for component in reply.components if component.name == name)


def test_list_tells_everything_of_every_component(graph: Any) -> None:
    reply = graph.ask(ListComponents, f"{NODE}/list_components")
    assert [component.name for component in reply.components] == ["counter", "guard", "sleepy"]
    counter = reply.components[0]
    assert (counter.shell, counter.core) == ("executor_tests/CounterShell", "executor_tests/Counter")
    assert counter.state == ComponentInfo.RUNNING
    assert counter.period_ns == 20_000_000
    assert counter.policy in ("SCHED_FIFO", "SCHED_OTHER")
    assert counter.priority == (40 if counter.policy == "SCHED_FIFO" else 0)
    assert counter.alternatives[0] == "executor_tests/Backwards"
    assert {port.name: port.resource for port in counter.ports} == {"set": "set", "count": "count"}
    assert "period_ms=20" in counter.properties
    assert "label=''" in counter.properties
    assert (reply.components[1].reconfigurable, reply.realtime.granted) == (False, not reply.realtime.missing)


def test_stop_and_start(graph: Any) -> None:
    states = graph.hear(ArchitectureState, f"{NODE}/state", LATCHED)
    stopped = graph.ask(Stop, f"{NODE}/stop", component="sleepy", requested_by="test")
    assert (stopped.success, stopped.code) == (True, Code.OK)
    assert _component(graph, "sleepy").state == ComponentInfo.STOPPED
    again = graph.ask(Stop, f"{NODE}/stop", component="sleepy")
    assert (again.success, again.code, again.revision) == (False, Code.NOT_RUNNING, stopped.revision)
    started = graph.ask(Start, f"{NODE}/start", component="sleepy", expected_revision=stopped.revision)
    assert started.success
    assert started.revision > stopped.revision
    sleepy = _component(graph, "sleepy")
    assert sleepy.state == ComponentInfo.RUNNING
    again = graph.ask(Start, f"{NODE}/start", component="sleepy")
    assert (again.code, again.message) == (Code.ALREADY_RUNNING, "component 'sleepy' is already running")
    graph.spin_until(lambda: bool(states) and states[-1].revision == started.revision, "the last state")
    assert states[-1].instance_id == started.instance_id
    assert states[-1].deployment_epoch_ns > 0


def test_replace_core_in_flight_takes_over_the_count(graph: Any) -> None:
    counts = graph.hear(Float64, "/robot_1/count")
    graph.voice(Float64, "/robot_1/set").publish(Float64(data=1e5))
    graph.spin_until(lambda: bool(counts) and counts[-1].data > 1e5, "a high count")
    events = graph.hear_events(NODE)
    reply = graph.ask(
        ReplaceCore, f"{NODE}/replace_core", component="counter", core="executor_tests/Backwards"
    )
    assert reply.success, reply.message
    graph.spin_until(lambda: bool(events), "the event")
    (step,) = events[0].report
    assert (step.component, step.missed_releases, step.phase_nominal_ns) == ("counter", 0, 0)
    assert (step.from_core, step.to_core) == ("executor_tests/Counter", "executor_tests/Backwards")
    assert (step.blackout_ns, step.prepare_ns) == (reply.report[0].blackout_ns, reply.report[0].prepare_ns)
    assert step.blackout_ns > 0
    assert step.phase_actual_ns != NOT_MEASURED
    component = _component(graph, "counter")
    assert (component.core, component.alternatives[0]) == (
        "executor_tests/Backwards",
        "executor_tests/Counter",
    )
    graph.spin_until(lambda: len(counts) > 1 and counts[-1].data < counts[-2].data, "a count downwards")
    assert counts[-1].data > 9e4, "a core that took nothing over counts down from zero"
    back = graph.ask(ReplaceCore, f"{NODE}/replace_core", component="counter", core="executor_tests/Counter")
    assert back.success, back.message  # the core of the file is accepted without being an alternative


def test_core_written_in_python(graph: Any) -> None:
    counts = graph.hear(Float64, "/robot_1/count")
    voice = graph.voice(Float64, "/robot_1/set")
    reply = graph.ask(
        ReplaceCore, f"{NODE}/replace_core", component="counter", core="executor_tests/PyCounter"
    )
    assert reply.success, reply.message
    voice.publish(Float64(data=1_000_000.0))
    graph.spin_until(lambda: bool(counts) and counts[-1].data > 1_000_000.0, "a count of the Python core")
    assert _component(graph, "counter").state == ComponentInfo.RUNNING


REFUSED = {
    "unknown component": (
        (Stop, "stop", {"component": "countr"}),
        Code.UNKNOWN_COMPONENT,
        "component 'countr' is unknown; the executor has counter, guard, sleepy; did you mean counter?",
    ),
    "unknown core": (
        (ReplaceCore, "replace_core", {"component": "counter", "core": "executor_tests/None"}),
        Code.UNKNOWN_CORE,
        "core 'executor_tests/None' is not installed; component 'counter' takes executor_tests/Counter",
    ),
    "undeclared core": (
        (ReplaceCore, "replace_core", {"component": "counter", "core": "executor_tests/Undeclared"}),
        Code.UNDECLARED_CORE,
        "core 'executor_tests/Undeclared' is installed, but not declared",
    ),
    "protected": (
        (ReplaceCore, "replace_core", {"component": "guard", "core": "executor_tests/Counter"}),
        Code.NOT_RECONFIGURABLE,
        "component 'guard' is protected",
    ),
    "adopt": (
        (ReplaceCore, "replace_core", {"component": "counter", "core": "executor_tests/Reluctant"}),
        Code.ADOPT_REFUSED,
        "adopt",
    ),
    "prepare": (
        (ReplaceCore, "replace_core", {"component": "counter", "core": "executor_tests/Unready"}),
        Code.PREPARE_FAILED,
        "the core is not ready, and never will be",
    ),
    "revision": (
        (Stop, "stop", {"component": "counter", "expected_revision": 4711}),
        Code.WRONG_REVISION,
        "the request expected 4711; read ~/state",
    ),
    "timeout": ((Stop, "stop", {"component": "counter", "timeout_s": -1.0}), Code.INVALID, "bad timeout"),
    "not a timeout": (
        (Stop, "stop", {"component": "counter", "timeout_s": float("nan")}),
        Code.INVALID,
        "found nan",
    ),
    "clock": ((Start, "start", {"component": "counter", "clock_ns": -5}), Code.INVALID, "bad clock_ns"),
    "long text": ((Stop, "stop", {"component": "c" * 5000}), Code.INVALID, "longer than 1000 characters"),
    "no step": ((Reconfigure, "reconfigure", {}), Code.INVALID, "a transaction without a step"),
    "unknown kind": (
        (Reconfigure, "reconfigure", {"steps": [ReconfigurationStep(kind="replace_cor", target="counter")]}),
        Code.INVALID,
        "unknown kind of step 'replace_cor'; did you mean replace_core?",
    ),
    "no installed type": (
        (
            Reconfigure,
            "reconfigure",
            {"steps": [ReconfigurationStep(kind="add_resource", target="late", value=NO_TYPE)]},
        ),
        Code.INVALID,
        "bad type 'std_msgs/msg/Flaot64' of resource 'late'",
    ),
    "second step": (
        (Reconfigure, "reconfigure", {"steps": [ReconfigurationStep(kind="stop", target="counter")] * 2}),
        Code.NOT_RUNNING,
        "step 2 (stop counter)",
    ),
    "unknown property": (
        (
            Reconfigure,
            "reconfigure",
            {"steps": [ReconfigurationStep(kind="set_property", target="counter", name="stepp")]},
        ),
        Code.INVALID,
        "component 'counter' has no property 'stepp'; did you mean step?",
    ),
    "property range": (
        (
            Reconfigure,
            "reconfigure",
            {"steps": [ReconfigurationStep(kind="set_property", target="counter", name="step", value="99")]},
        ),
        Code.INVALID,
        "expected at least 0 and at most 10, found 99",
    ),
    "property type": (
        (
            Reconfigure,
            "reconfigure",
            {"steps": [ReconfigurationStep(kind="set_property", target="counter", name="step", value="[1")]},
        ),
        Code.INVALID,
        "the value '[1' is not YAML",
    ),
}


def test_refusals_have_their_code_and_change_nothing(graph: Any) -> None:
    events = graph.hear_events(NODE)
    before = graph.ask(ListComponents, f"{NODE}/list_components")
    for name, ((service_type, service, fields), code, message) in REFUSED.items():
        reply = graph.ask(service_type, f"{NODE}/{service}", **fields)
        assert (reply.success, Code(reply.code)) == (False, code), name
        assert message in reply.message, name
        assert (reply.revision, reply.instance_id) == (before.revision, before.instance_id), name
        assert not reply.report, name
    after = graph.ask(ListComponents, f"{NODE}/list_components")
    assert after.revision == before.revision
    assert [part.core for part in after.components] == [part.core for part in before.components]
    assert [part.state for part in after.components] == [part.state for part in before.components]
    graph.spin_until(lambda: len(events) == len(REFUSED), "an event for every refusal")
    assert [Code(event.code) for event in events] == [code for _, code, _ in REFUSED.values()]


def test_event_tells_who_what_and_why(graph: Any) -> None:
    events = graph.hear_events(NODE)
    fields = {"requested_by": "/robot_1/supervisor", "cause": "radio silent", "request_id": "one"}
    core = "executor_tests/Backwards"
    reply = graph.ask(ReplaceCore, f"{NODE}/replace_core", component="counter", core=core, **fields)
    assert reply.success
    graph.spin_until(lambda: bool(events), "the event")
    (event,) = events
    assert event.request == "replace_core counter executor_tests/Backwards"
    assert (event.requested_by, event.cause, event.request_id) == (
        "/robot_1/supervisor",
        "radio silent",
        "one",
    )
    assert (event.from_core, event.to_core) == ("executor_tests/Counter", "executor_tests/Backwards")
    assert (event.success, event.revision) == (True, reply.revision)
    (told,), (replied,) = event.report, reply.report
    assert (told.step, told.component, told.blackout_ns) == (
        replied.step,
        replied.component,
        replied.blackout_ns,
    )


def test_the_reply_is_true_already_and_events_follow_in_order(graph: Any) -> None:
    events = graph.hear_events(NODE)
    replies = []
    for core, service, name in (("Backwards", Stop, "stop"), ("Counter", Start, "start")) * 3:
        part = f"executor_tests/{core}"
        replies.append(graph.ask(ReplaceCore, f"{NODE}/replace_core", component="counter", core=part))
        assert _component(graph, "counter").core == part
        replies.append(graph.ask(service, f"{NODE}/{name}", component="sleepy"))
    assert all(reply.success for reply in replies), [reply.message for reply in replies]
    graph.spin_until(lambda: len(events) == len(replies), "an event for every request")
    told = [(event.revision, event.message) for event in events]
    assert told == [(reply.revision, reply.message) for reply in replies]
    assert [revision for revision, _ in told] == sorted({revision for revision, _ in told}), (
        "every change counts"
    )


def test_repeated_request_id_returns_the_first_outcome(graph: Any) -> None:
    first = graph.ask(Stop, f"{NODE}/stop", component="sleepy", request_id="a")
    assert first.success
    assert graph.ask(Start, f"{NODE}/start", component="sleepy").success
    repeated = graph.ask(Stop, f"{NODE}/stop", component="sleepy", request_id="a")
    assert repeated == first
    assert _component(graph, "sleepy").state == ComponentInfo.RUNNING
    other = graph.ask(Stop, f"{NODE}/stop", component="counter", request_id="a")
    assert (other.success, other.code) == (False, Code.REQUEST_ID_REUSED)
    assert "was used before, for: stop sleepy" in other.message
    assert _component(graph, "counter").state == ComponentInfo.RUNNING


def test_set_property_and_dry_run(graph: Any) -> None:
    counts = graph.hear(Float64, "/robot_1/count")
    step = ReconfigurationStep(kind="set_property", target="counter", name="step", value="5.5")
    before = graph.ask(ListComponents, f"{NODE}/list_components").revision
    dry = graph.ask(Reconfigure, f"{NODE}/reconfigure", steps=[step], dry_run=True)
    assert (dry.success, dry.revision) == (True, before)
    assert "would be accepted" in dry.message
    done = graph.ask(Reconfigure, f"{NODE}/reconfigure", steps=[step])
    assert done.success, done.message
    assert done.revision == before + 1
    del counts[:]
    graph.spin_until(lambda: len(counts) > 5, "counts")
    assert counts[-1].data - counts[-2].data == 5.5
    assert "step=5.5" in _component(graph, "counter").properties


def test_a_stop_that_waits_delays_neither_listing_nor_reception(graph: Any) -> None:
    voice = graph.voice(Float64, "/robot_1/set")
    counts = graph.hear(Float64, "/robot_1/count")
    held = graph.ask(ReplaceCore, f"{NODE}/replace_core", component="counter", core="executor_tests/Held")
    assert held.success
    graph.spin_until(lambda: bool(counts) and counts[-1].data == -1.0, "the execution to begin")
    waiting = graph.ask_later(Stop, f"{NODE}/stop", component="counter", timeout_s=10.0)
    for _ in range(5):
        graph.ask(ListComponents, f"{NODE}/list_components")
    assert not waiting.done(), waiting.result()

    def told() -> bool:
        voice.publish(Float64(data=1.0))  # is received while the stop waits, and ends the execution
        return waiting.done()

    graph.spin_until(told, "the stop")
    assert waiting.result().success, waiting.result().message
