"""The `mauve` command without an executor: arguments, files, plug-ins, what it prints."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from mauve_msgs.msg import ComponentInfo, ReconfigurationEvent, StepReport
from mauve_rt.cli import views
from mauve_rt.cli.main import build_parser, main
from mauve_rt.counts import duration
from mauve_rt.errors import ArchitectureFileError
from mauve_rt.fields import json_value
from mauve_rt.model.steps import load_change


def test_arguments_of_the_verbs() -> None:
    parser = build_parser()
    args = parser.parse_args(
        ["replace-core", "robot_1/executor/", "exploration", "p/Core", "--timeout", "0.5"]
    )
    assert (args.executor, args.component, args.core) == ("/robot_1/executor", "exploration", "p/Core")
    assert (args.timeout, args.expected_revision, args.cause, args.json) == (0.5, 0, "", False)
    for words in (["list", "/e"], ["stop", "/e", "c"], ["start", "/e", "c"], ["events", "/e"], ["nodes"]):
        assert parser.parse_args(words).verb.name == words[0]


@pytest.mark.parametrize("name", ["x-y", "robot//executor", "", "1st/executor"])
def test_a_name_that_no_executor_can_have_is_refused(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        build_parser().parse_args(["list", name])
    assert f"expected a node's name such as /robot_1/executor, found {name}\n" in capsys.readouterr().err


def test_a_transaction_s_steps_are_read_from_yaml() -> None:
    text = """
    - {kind: add_resource, target: goal, value: {kind: shared_data, type: geometry_msgs/msg/Point}}
    - {kind: connect, target: guidance, name: goal, value: goal.read}
    - {kind: set_property, target: guidance, name: path_step, value: 0.5}
    - {kind: start, target: guidance}
    """
    change = load_change("steps.yaml", text=text)
    assert [step.value for step in change.steps] == [
        '{"kind": "shared_data", "type": "geometry_msgs/msg/Point"}',
        "goal.read",
        "0.5",
        "",
    ]


def test_force_is_asked_for_by_a_flag_or_by_the_steps_file() -> None:
    parser = build_parser()
    for words in (
        ["stop", "/e", "c"],
        ["replace-core", "/e", "c", "p/Core"],
        ["reconfigure", "/e", "steps.yaml"],
    ):
        assert parser.parse_args(words).force is False
        assert parser.parse_args([*words, "--force"]).force is True
    steps = "steps: [{kind: remove_component, target: a}]"
    assert load_change("steps.yaml", text=steps).force is False
    assert load_change("steps.yaml", text=f"force: true\n{steps}").force is True
    with pytest.raises(ArchitectureFileError, match=":1:8: force: "):
        load_change("steps.yaml", text=f"force: 1\n{steps}")


def test_an_idle_instant_is_asked_for_by_a_flag_or_by_the_steps_file() -> None:
    parser = build_parser()
    plain = parser.parse_args(["reconfigure", "/e", "steps.yaml"])
    assert (plain.idle, plain.idle_within) == (False, None)
    idle = parser.parse_args(["reconfigure", "/e", "steps.yaml", "--idle", "--idle-within", "0.5"])
    assert (idle.idle, idle.idle_within) == (True, 0.5)
    steps = "steps: [{kind: stop, target: a}]"
    change = load_change("steps.yaml", text=f"idle: true\nidle_within_s: 0.2\n{steps}")
    assert (change.idle, change.idle_within_s) == (True, 0.2)
    assert load_change("steps.yaml", text=steps).idle is False
    with pytest.raises(ArchitectureFileError, match=":1:16: idle_within_s: "):
        load_change("steps.yaml", text=f"idle_within_s: 11\n{steps}")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("max_missed: 1\nsteps: [{kind: stop, target: a}]", ":1:1: max_missed is no known key"),
        ("force: true\nsteps: [{kind: stopp, target: a}]", ":2:16: steps[0].kind: input should be"),
        ("- {kind: stopp, target: a}", ":1:10: [0].kind: input should be"),
        ("- {kind: stop}", "[0].target is missing"),
        ("- {kind: resynchronise, target: a}", "a step of kind 'resynchronise' takes no target"),
        (f"- {{kind: stop, target: {'a' * 101}}}", "at most 100 characters"),
        ("- {kind: connect, target: a, value: b.c}", "a step of kind 'connect' needs a name"),
        ("- {kind: add_component, target: a}", "a step of kind 'add_component' needs a value"),
        ("- {kind: stop, target: a, nmae: b}", "[0].nmae is no known key"),
        ("kind: stop", "the file: input should be a valid list"),
        ("[]", "at least 1 item"),
        ("- {", "not YAML"),
    ],
)
def test_bad_steps_are_refused_before_anybody_is_asked(
    text: str, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "steps.yaml"
    file.write_text(text, encoding="utf-8")
    assert main(["reconfigure", "/e", str(file)]) == 2
    assert message in capsys.readouterr().err


@pytest.mark.parametrize(
    "words",
    [
        [],
        ["lst"],
        ["list"],
        ["stop", "/e"],
        ["stop", "/e", "c", "--timeout", "x"],
        ["replace-core", "/e", "c", "p/C", "--max-missed", "1"],
    ],
)
def test_bad_usage_ends_with_status_2(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(words)
    assert caught.value.code == 2
    assert "usage: mauve" in capsys.readouterr().err


def test_plugins(plugin_prefix: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plugins", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    core = next(plugin for plugin in found if plugin["name"] == "executor_tests/PyCounter")
    assert (core["kind"], core["target"]) == ("core", "executor_tests_cores:PyCounter")
    assert main(["plugins"]) == 0
    assert "executor_tests/PyCounter" in capsys.readouterr().out


def _words_of(**measured: int | str) -> str:
    """What a report says of a step, of which only this was measured."""
    none = StepReport.NOT_MEASURED
    unknown = {"blackout_ns": none, "phase_actual_ns": none, "instant_ns": none, "release_ns": none}
    (line,) = views.report_lines([StepReport(step="step", **{**unknown, **measured})])
    return line


def test_the_next_release_in_words() -> None:
    none = StepReport.NOT_MEASURED
    assert _words_of(phase_actual_ns=14_000) == "step: next release woken 14 us after its instant"
    due = {"phase_actual_ns": 14_000, "instant_ns": 5, "release_ns": 5}
    assert _words_of(**due) == "step: next release due at the change, woken 14 us after its instant"
    simulated = {"phase_actual_ns": 0, "instant_ns": 5, "release_ns": 2_005}
    assert _words_of(**simulated) == "step: next release due 2 us after the change, woken at its instant"
    awaited = {"blackout_ns": 5_000, "missed_releases": none, "instant_ns": 5}
    assert _words_of(**awaited) == "step: blackout 5 us, the next release has not come yet"
    assert _words_of(instant_ns=5, remark="it is late") == "step: it is late"


def test_reports_and_events_in_words() -> None:
    none = StepReport.NOT_MEASURED
    measured = StepReport(
        step="replace_core p/B",
        prepare_ns=2_000_000,
        blackout_ns=35_000,
        phase_actual_ns=-1_500,
        instant_ns=7_000_000,
        release_ns=8_200_000,
    )
    stop = StepReport(step="stop", blackout_ns=none, phase_actual_ns=none)
    line = "replace_core p/B: prepared in 2 ms, blackout 35 us, missed releases 0, next release "
    line += "due 1.2 ms after the change, woken -1.5 us after its instant"
    assert views.report_lines([measured]) == [line]
    assert views.report_lines([stop]) == []
    two = [StepReport(step="stop", component="guidance", blackout_ns=none, phase_actual_ns=none), measured]
    assert views.report_lines(two) == ["guidance: stop", line]
    event = ReconfigurationEvent(request="stop guidance", requested_by="me", code=4, message="is stopped")
    event.stamp.sec = 12
    assert (
        views.event_line(event)
        == f"{views.clock_text(12 * 10**9)} stop guidance by me: refused (4): is stopped"
    )


@pytest.mark.parametrize(
    ("nanoseconds", "text"),
    [(0, "-"), (999, "999 ns"), (1_000, "1 us"), (2_500_000, "2.5 ms"), (-3_000_000_000, "-3 s")],
)
def test_durations(nanoseconds: int, text: str) -> None:
    assert duration(nanoseconds) == text


def test_messages_as_json() -> None:
    plain: dict[str, Any] = json_value(ComponentInfo(name="a", cpus=[1, 2]))
    assert (plain["name"], plain["cpus"], plain["ports"]) == ("a", [1, 2], [])
    assert json.loads(json.dumps(plain)) == plain


def test_module_runs_as_a_program() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "mauve_rt.cli", "--version"], capture_output=True, check=True
    )
    assert done.stdout.strip()


def test_a_part_has_its_ports_properties_and_states(
    plugin_prefix: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["plugins", "mauve_rt/TwistRelayFsm", "--json"]) == 0
    [fsm] = json.loads(capsys.readouterr().out)
    assert (fsm["kind"], fsm["shell"]) == ("fsm", "mauve_rt/TwistRelayShell")
    ports = [(port["name"], port["kind"], port["type"], port["required"]) for port in fsm["ports"]]
    assert ports == [
        ("input", "read", "geometry_msgs/msg/Twist", True),
        ("output", "write", "geometry_msgs/msg/Twist", True),
    ]
    period = next(each for each in fsm["properties"] if each["name"] == "period_us")
    assert (period["default"], period["unit"], period["minimum"]) == (10_000, "us", 1)
    assert period["read once by"] == ["fsm"]
    states = {state["name"]: state for state in fsm["states"]}
    assert states["Update"]["kind"] == "execution"
    assert (states["AwaitUpdate"]["kind"], states["AwaitUpdate"]["duration_ns"]) == ("wait", 10_000_000)
    assert states["AwaitUpdate"]["next"] == ["Update"]
    assert main(["plugins", "executor_tests/PyCounter"]) == 0
    said = capsys.readouterr().out
    assert "core executor_tests/PyCounter, shell executor_tests/CounterShell" in said
    assert "period_ms" in said
    assert main(["plugins", "sensor_msgs/msg/JointState"]) == 0
    assert "lists that need a capacity: name, position, velocity, effort" in capsys.readouterr().out
    assert main(["plugins", "executor_tests/PyCouter"]) != 0
    assert "executor_tests/PyCounter" in capsys.readouterr().err


def shown_json(capsys: pytest.CaptureFixture[str], name: str) -> dict[str, Any]:
    """What `mauve plugins NAME --json` says of a part."""
    assert main(["plugins", name, "--json"]) == 0
    [part] = json.loads(capsys.readouterr().out)
    return dict(part)


@pytest.mark.parametrize("value", ["-1e-3", "-1E3", "-.5", "-5", "-.inf", "1e-3", "text"])
def test_a_negative_number_is_a_value_and_no_option(value: str) -> None:
    args = build_parser().parse_args(["set", "/executor", "robot.start_x", value, "--timeout", "2"])
    assert (args.value, args.timeout) == (value, 2.0)


@pytest.mark.usefixtures("plugin_prefix")
def test_an_fsm_has_its_methods_and_the_expressions_of_its_waits(capsys: pytest.CaptureFixture[str]) -> None:
    states = {state["name"]: state for state in shown_json(capsys, "executor_tests/TimedFsm")["states"]}
    count, pause, event = states["Count"], states["Pause"], states["Event"]
    assert (count["action"], count["guards"], count["next"]) == ("act", ["is_enabled"], ["Pause", "Event"])
    assert (pause["duration_text"], pause["duration_ns"]) == ("5 * unit_ms", 50_000_000)
    assert (event["event_port"], event["duration_text"]) == ("set", "3 * unit_ms")
    assert (event["min_interarrival_text"], event["min_interarrival_ns"]) == ("1 * unit_ms", 10_000_000)
    assert main(["plugins", "executor_tests/TimedFsm"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "if is_enabled: Pause, Event" in said
    assert "5 * unit_ms = 50 ms" in said


@pytest.mark.usefixtures("plugin_prefix")
def test_a_core_has_its_worst_cases_and_its_state(capsys: pytest.CaptureFixture[str]) -> None:
    core = shown_json(capsys, "executor_tests/Timed")
    assert core["methods"] == [
        {"name": "act", "wcet_ns": 200_000},
        {"name": "is_enabled", "wcet_ns": 1_000},
    ]
    assert core["state"] == [{"name": "count", "type": "float64"}]
    assert (core["python"], core["budget_ns"], len(core["classes"]) > 0) == (False, 100_000, True)
    python = shown_json(capsys, "executor_tests/PyTimed")
    assert python["methods"] == [
        {"name": "act", "wcet_ns": 400_000},
        {"name": "is_enabled", "wcet_ns": 2_000},
    ]
    assert python["state"] == [{"name": "count", "type": "float64"}]
    assert (python["python"], python["budget_ns"], python["classes"]) == (True, 50_000, [])
    assert main(["plugins", "executor_tests/Timed"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "is_enabled 1 us" in said
    assert "count float64" in said


@pytest.mark.usefixtures("plugin_prefix")
def test_a_shell_has_the_policies_of_its_outputs(capsys: pytest.CaptureFixture[str]) -> None:
    ports = {port["name"]: port for port in shown_json(capsys, "executor_tests/TimedShell")["ports"]}
    policies = {name: (port["on_commit"], port["on_stop"]) for name, port in ports.items()}
    assert policies == {
        "set": (None, None),
        "count": ("hold", "set_zero"),
        "kept": ("set_zero", "hold"),
    }
    caller = {port["name"]: port for port in shown_json(capsys, "executor_tests/CallerShell")["ports"]}
    calls = {name: port["type"] for name, port in caller.items() if port["kind"] == "call"}
    assert calls
    assert all(calls.values()), "of a call port the type is the name that its service declares"
