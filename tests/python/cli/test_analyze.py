"""`mauve analyze` on architecture files: the task model, where its times come from, what cannot be proved."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from synthetic_traces import EPOCH_NS, MS, deploy, record, run

from mauve_rt.cli.main import main
from mauve_rt.trace.format.records import Kind
from mauve_rt.trace.recording.synthetic import SyntheticSource

Analyze = Callable[..., tuple[int, str, str]]

BOUND = "declared (its bound)"

ROBOT = """\
mauve: 1
executor: {wakeup_us: 0, overhead_ns: 0}
components:
  one: {shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm,
        priority: 40, cpus: [0], properties: {period_ms: 20}, deadline_ns: 5000000,
        states: {Count: {wcet_ns: 200000}}}
  guard: {shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/GuardedFsm,
          priority: 30, properties: {period_ms: 20}}
  python: {shell: executor_tests/CounterShell, core: executor_tests/PyCounter, fsm: executor_tests/CounterFsm,
           priority: 20, cpus: [0, 1]}
"""


@pytest.fixture
def analyze(tmp_path: Path, plugin_prefix: Path, capsys: pytest.CaptureFixture[str]) -> Analyze:
    """analyze(TEXT, WORD...): status, stdout, stderr of a file with that text."""

    def run(text: str, *words: str) -> tuple[int, str, str]:
        file = tmp_path / "robot.yaml"
        file.write_text(text, encoding="utf-8")
        status = main(["analyze", str(file), *words])
        said = capsys.readouterr()
        return status, said.out, said.err.replace(f"{tmp_path}/", "")

    return run


@pytest.fixture
def told(analyze: Analyze) -> Callable[..., dict[str, Any]]:
    """What is told of each component, by its name."""

    def run(text: str, *words: str) -> dict[str, Any]:
        status, out, err = analyze(text, "--json", *words)
        assert (status, err) == (3, "")
        return {component["name"]: component for component in json.loads(out)["components"]}

    return run


def test_a_declared_time_of_the_file_or_of_the_code(told: Callable[..., dict[str, Any]]) -> None:
    found = told(ROBOT)
    one = found["one"]
    assert (one["cpus"], one["priority"], one["deadline_ns"]) == ([0], 40, 5_000_000)
    assert one["states"] == [{"name": "Count", "time_ns": 200_000, "origin": "declared"}]
    assert [(job["after"], job["until"], job["cost_ns"], job["separation_ns"]) for job in one["jobs"]] == [
        ("", "Pause", 200_000, 20_000_000),
        ("Pause", "Pause", 200_000, 20_000_000),
    ]
    assert {job["deadline_ns"] for job in one["jobs"]} == {5_000_000}
    assert one["not_provable"] == []
    guard = found["guard"]
    assert guard["states"] == [{"name": "Count", "time_ns": 500_000_000, "origin": BOUND}], "by its fsm"
    assert {job["deadline_ns"] for job in guard["jobs"]} == {20_000_000}, "the next instant"


def test_a_worst_case_comes_before_the_bound_that_is_enforced(told: Callable[..., dict[str, Any]]) -> None:
    both = told(ROBOT.replace("wcet_ns: 200000", "max_execution_ns: 900000, wcet_ns: 200000"))["one"]
    assert both["states"] == [{"name": "Count", "time_ns": 200_000, "origin": "declared"}]
    bound = told(ROBOT.replace("wcet_ns", "max_execution_ns"))["one"]
    assert bound["states"] == [{"name": "Count", "time_ns": 200_000, "origin": BOUND}]
    assert bound["response"]["too_long"] == [
        "Count may last 0.243 ms, preemption and blocking included, and its max_execution_ns is 0.200 ms"
    ], "the watchdog looks"


TIMED = """\
mauve: 1
executor: {wakeup_us: 0, overhead_ns: 0}
components:
  one: {shell: executor_tests/TimedShell, core: executor_tests/Timed, fsm: executor_tests/TimedFsm,
        priority: 40, cpus: [0], states: {Again: {wcet_ns: 250000}}}
"""


def test_worst_cases_of_a_core_are_said_to_be_its_own(
    analyze: Analyze, told: Callable[..., dict[str, Any]]
) -> None:
    status, out, _ = analyze(TIMED)
    assert status == 0
    assert "  Count: 0.201 ms, declared by core executor_tests/Timed\n" in out
    assert "  Again: 0.250 ms, declared\n" in out
    half = told(TIMED.replace("Timed,", "HalfTimed,"))["one"]
    assert half["states"] == [
        {"name": "Count", "time_ns": None, "origin": "missing"},
        {"name": "Again", "time_ns": 250_000, "origin": "declared"},
    ]
    (why,) = half["not_provable"]
    assert why == (
        "no time is known of Count (core executor_tests/HalfTimed declares no time of is_enabled): "
        "declare wcet_ns, or measure (--budget-from BAG)"
    )


def test_what_cannot_be_proved_is_said_of_each_component(told: Callable[..., dict[str, Any]]) -> None:
    found = told(ROBOT)
    assert found["guard"]["not_provable"] == [
        "it may run on any CPU: pin it to one (cpus in the architecture file)",
    ]
    assert found["python"]["not_provable"] == [
        "it has parts in Python, which run under the interpreter's lock: write them in C++",
        "it may run on CPUs 0, 1: pin it to one (cpus in the architecture file)",
        "no time is known of Count: declare wcet_ns, or measure (--budget-from BAG)",
    ]


def test_the_model_in_words(analyze: Analyze) -> None:
    status, out, err = analyze(ROBOT)
    assert (status, err) == (3, "")
    assert (
        "one: CPU 0, priority 40, period 20.000 ms, deadline 5.000 ms, overrun skip\n"
        "  Count: 0.200 ms, declared\n"
        "  job the start -> Count -> Pause: at most 0.200 ms, the next one 20.000 ms later, "
    ) in out
    assert "  Count: missing\n" in out
    assert "  response without a bound: guard may delay it, and nothing is proved of that\n" not in out
    assert "  response at most 0.243 ms, its deadline of 5.000 ms is met\n" in out
    assert "thread 'watchdog': any CPU, priority 99, at most 0.043 ms every 1.000 ms\n" in out, "of guard"
    assert out.endswith(
        "not provable: something is missing of guard, python\n"
        "  guard: it may run on any CPU: pin it to one (cpus in the architecture file)\n"
        "  python: it has parts in Python, which run under the interpreter's lock: write them in C++\n"
        "  python: it may run on CPUs 0, 1: pin it to one (cpus in the architecture file)\n"
        "  python: no time is known of Count: declare wcet_ns, or measure (--budget-from BAG)\n"
    )


PAIR = """\
mauve: 1
executor: {wakeup_us: 0, overhead_ns: 0}
components:
  quick: {shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm,
          priority: 40, cpus: [0], properties: {period_ms: 10}, states: {Count: {wcet_ns: 3000000}}}
  slow: {shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm,
         priority: 30, cpus: [0], properties: {period_ms: 20}, states: {Count: {wcet_ns: 13950000}}}
"""


def test_what_is_schedulable_is_so_under_conditions(analyze: Analyze) -> None:
    status, out, err = analyze(PAIR)
    assert (status, err) == (0, "")
    assert "\nschedulable: every component meets its deadline, if\n" in out
    declared = "ends within its declared time (only max_execution_ns is enforced)\n"
    assert f"  each execution of quick, slow {declared}" in out
    assert "  no component faults, stops or is changed, and no rule of the executor acts\n" in out


def test_an_enforced_worst_case_costs_the_overrun_and_is_said_to_be_enforced(analyze: Analyze) -> None:
    text = PAIR.replace("priority: 40,", "priority: 40, enforce_wcet: true,").replace("13950000", "9000000")
    status, out, err = analyze(text)
    assert (status, err) == (0, "")
    assert "  Count: 3.000 ms, declared, enforced\n" in out
    assert "  job the start -> Count -> Pause: at most 4.042 ms, " in out, "1 ms, and a look of the watchdog"
    assert "thread 'watchdog': any CPU, priority 99, at most 0.042 ms every 1.000 ms\n" in out
    declared = "ends within its declared time (only max_execution_ns is enforced)\n"
    assert f"  each execution of slow {declared}" in out
    assert "an execution up to 1.042 ms of CPU time above its enforced wcet_ns\n" in out
    enforced = "uses at most its wcet_ns of CPU time (enforced), and never sleeps\n"
    assert f"  each execution of quick {enforced}" in out
    _, out, _ = analyze(text.replace("enforce_wcet: true", "enforce_wcet: false"))
    assert f"  each execution of quick, slow {declared}" in out


SHARED = (
    PAIR
    + """\
resources:
  number: {kind: ring_buffer, capacity: 4, overwrite: true, type: std_msgs/msg/Float64,
           longest_hold_ns: 1100000}
  other: {kind: ring_buffer, capacity: 4, overwrite: true, type: std_msgs/msg/Float64,
          longest_hold_ns: 50000}
connections:
  - [quick.set, number.read]
  - [quick.count, other.write]
  - [slow.count, number.write]
  - [slow.set, other.read]
"""
)


def test_a_lock_that_is_held_blocks_and_is_shown(analyze: Analyze) -> None:
    status, out, err = analyze(SHARED)
    assert (status, err) == (0, "")
    assert "  holds the lock of number up to 1.100 ms, declared\n" in out
    met = "its deadline of 10.000 ms is met, blocked up to 1.100 ms\n"
    assert f"  response at most 4.100 ms, {met}" in out
    assert "  response at most 19.950 ms, its deadline of 20.000 ms is met\n" in out, "nobody is below"
    status, out, err = analyze(SHARED, "--json")
    quick = json.loads(out)["components"][0]
    assert [(hold["resource"], hold["longest_ns"], hold["origin"]) for hold in quick["holds"]] == [
        ("number", 1_100_000, "declared"),
        ("other", 50_000, "declared"),
    ]
    assert quick["undeclared_locks"] == []
    assert quick["response"]["blocking_ns"] == 1_100_000
    status, out, err = analyze(SHARED.replace(",\n          longest_hold_ns: 50000", ""))
    assert (status, err) == (3, "")
    assert out.endswith(
        "not provable: something is missing of quick\n"
        "  quick: slow may hold the lock of other for an unknown time: declare longest_hold_ns of the "
        "resource\n"
    )


def test_what_blocks_too_long_is_not_proved(analyze: Analyze) -> None:
    status, out, err = analyze(SHARED.replace("1100000", "7100000"))
    assert (status, err) == (3, "")
    assert "not proved: quick has a bound of 10.100 ms and a deadline of 10.000 ms" in out


def test_a_lock_of_two_cpus_is_not_provable(analyze: Analyze) -> None:
    text = SHARED.replace("priority: 30, cpus: [0]", "priority: 30, cpus: [1]")
    status, out, err = analyze(text)
    assert (status, err) == (3, "")
    why = "it shares number (held up to 1.100 ms) with {} on another CPU: one CPU for both, or no lock"
    assert f"  quick: {why.format('slow')}\n" in out
    assert f"  slow: {why.format('quick')}\n" in out


@pytest.mark.parametrize("kind", ["latest_value", "shared_data", "ring_buffer, capacity: 4"])
def test_a_port_that_takes_no_lock_neither_blocks_nor_is_named(analyze: Analyze, kind: str) -> None:
    text = SHARED.replace("ring_buffer, capacity: 4, overwrite: true", kind)
    _, out, _ = analyze(text)
    assert "lock" not in out
    assert "  response at most 3.000 ms, its deadline of 10.000 ms is met\n" in out


def test_a_lock_that_nobody_declares_takes_the_longest_measured_call(
    analyze: Analyze, tmp_path: Path
) -> None:
    source = SyntheticSource(["quick", "slow"])
    for component, held_ns in (("quick", 700), ("slow", 900_000)):
        deploy(source, component)
        begin_ns = run(source, component, 3)
        source.add(component, Kind.SERVICE_BEGIN, begin_ns, name="number.read")
        source.add(component, Kind.SERVICE_END, begin_ns + held_ns, name="number.read")
    bag = record(source, tmp_path / "bag")
    text = SHARED.replace(",\n           longest_hold_ns: 1100000", "")
    _, out, _ = analyze(text, "--budget-from", str(bag), "--margin", "2", "--wakeup-us", "10")
    assert "  holds the lock of number up to 1.800 ms, measured in bag (n = 2) x 2\n" in out
    assert "is met, blocked up to 1.800 ms\n" in out
    _, out, _ = analyze(SHARED, "--budget-from", str(bag), "--margin", "2")
    assert "  holds the lock of number up to 1.100 ms, declared\n" in out, "what is declared stays"


def test_what_is_not_says_who_misses_when_and_why_and_shows_it(analyze: Analyze, tmp_path: Path) -> None:
    bag = tmp_path / "witness"
    status, out, err = analyze(PAIR.replace("13950000", "15000000"), "--witness", str(bag))
    assert status == 1
    assert (
        "\nnot schedulable: slow misses its deadline at 20.000 ms after the start and ends at 24.000 ms: "
        "9.000 ms of quick + 15.000 ms of its own, if\n"
    ) in out
    assert err == "witness: a bag of that run; mauve report witness opens at it\n"
    page = tmp_path / "page.html"
    assert main(["report", str(bag), "--out", str(page)]) == 0
    text = page.read_text(encoding="utf-8")
    assert "No: 1 missed deadline" in re.sub("<[^>]*>", "", text)
    assert main(["trace", "check", str(bag)]) == 0, "it is a bag as any other"


def test_the_witness_goes_to_no_place_that_is_taken(analyze: Analyze, tmp_path: Path) -> None:
    status, _, err = analyze(PAIR.replace("13950000", "15000000"), "--witness", str(tmp_path))
    assert status == 2
    assert "exists" in err


def test_what_would_be_if_a_state_took_longer(analyze: Analyze) -> None:
    status, out, _ = analyze(PAIR, "--suppose", "slow.Count=15ms", "--suppose", "quick.Count=3250.0us")
    assert status == 1
    assert "  Count: 15.000 ms, supposed\n" in out
    assert "  Count: 3.250 ms, supposed\n" in out
    assert "not schedulable: slow misses its deadline" in out
    assert analyze(PAIR, "--suppose", "slow.Count=1ms")[0] == 0


@pytest.mark.parametrize(
    ("word", "problem"),
    [
        ("slow.Count", "expected COMPONENT.STATE=TIME as guidance.Plan=5ms, found slow.Count"),
        ("slow.Count=0ms", "expected COMPONENT.STATE=TIME"),
        ("slow.Count=-1ms", "expected COMPONENT.STATE=TIME"),
        ("slow.Count=5", "expected COMPONENT.STATE=TIME"),
        ("slow.Count=99999999999s", "expected COMPONENT.STATE=TIME"),
        ("fast.Count=1ms", "no such component; expected one of quick, slow, found fast"),
        ("slow.Pause=1ms", "no such execution state; expected one of Count, found Pause"),
    ],
)
def test_what_cannot_be_supposed_is_refused(analyze: Analyze, word: str, problem: str) -> None:
    status, out, err = analyze(PAIR, "--suppose", word)
    assert (status, out) == (2, "")
    assert problem in err


def test_the_latency_decides(analyze: Analyze) -> None:
    assert analyze(PAIR, "--wakeup-us", "100")[0] == 1
    assert analyze(PAIR, "--wakeup-us", "10")[0] == 0


def test_a_time_in_virtual_time_is_no_bound(told: Callable[..., dict[str, Any]]) -> None:
    found = told(ROBOT.replace("wcet_ns", "simulated_execution_ns"))
    assert found["one"]["states"] == [{"name": "Count", "time_ns": None, "origin": "missing"}]
    assert {job["cost_ns"] for job in found["one"]["jobs"]} == {None}


@pytest.mark.parametrize(
    ("before", "after", "problem"),
    [
        (
            "deadline_ns: 5000000",
            "deadline_ns: 0",
            "robot.yaml:5:76: bad deadline_ns of component 'one': expected at least 1",
        ),
        (
            "deadline_ns: 5000000",
            "deadline_ns: -1",
            "robot.yaml:5:76: bad deadline_ns of component 'one': expected at least 1",
        ),
        (
            "wcet_ns: 200000",
            "max_execution_ns: 0",
            "robot.yaml:6:44: bad max_execution_ns in states.Count of component 'one': expected at least 1",
        ),
        (
            "wcet_ns: 200000",
            "wcet_ns: 0",
            "robot.yaml:6:35: bad wcet_ns in states.Count of component 'one': expected at least 1",
        ),
        (
            "wcet_ns: 200000",
            "max_execution_ns: 199999, wcet_ns: 200000",
            "expected at most max_execution_ns, which is 199999, found 200000; lower wcet_ns, or raise",
        ),
        (
            "fsm: executor_tests/GuardedFsm,",
            "fsm: executor_tests/GuardedFsm, states: {Count: {wcet_ns: 500000001}},",
            "expected at most max_execution_ns, which is 500000000 ns, found 500000001; lower wcet_ns",
        ),
        (
            "wcet_ns: 200000",
            "simulated_execution_ns: -5",
            "robot.yaml:6:50: bad simulated_execution_ns in states.Count of component 'one': expected at",
        ),
        (
            "wcet_ns: 200000",
            "",
            "expected at least one of max_execution_ns, simulated_execution_ns or wcet_ns",
        ),
        ("Count: {wcet", "Rum: {wcet", "no such execution state; expected one of Count, found Rum"),
        ("Count: {wcet", "Pause: {wcet", "no such execution state; expected one of Count, found Pause"),
    ],
)
def test_bad_times_are_refused_where_they_stand(
    analyze: Analyze, before: str, after: str, problem: str
) -> None:
    status, out, err = analyze(ROBOT.replace(before, after, 1))
    assert (status, out) == (2, "")
    assert problem in err
    assert "robot.yaml:" in err


def test_the_latency_of_the_machine_is_in_the_bound(told: Callable[..., dict[str, Any]]) -> None:
    response = told(ROBOT, "--wakeup-us", "50")["one"]["response"]
    assert response == {
        "response_ns": 293_000,
        "deadline_ns": 5_000_000,
        "reason": "",
        "blocking_ns": 0,
        "too_long": [],
        "by": "",
    }


@pytest.mark.parametrize("latency", ["-1", "inf"])
def test_a_latency_that_cannot_be_is_refused(analyze: Analyze, latency: str) -> None:
    status, _, err = analyze(ROBOT, "--wakeup-us", latency)
    assert status == 2
    assert "--wakeup-us: expected 0 or more" in err


def test_the_wakeup_latency_is_the_longest_that_doctor_measured(analyze: Analyze, tmp_path: Path) -> None:
    measured = tmp_path / "doctor.json"
    measured.write_text('{"wakeup": {"wakeup_us": 49.2, "overhead_ns": 2500}}', encoding="utf-8")
    status, out, _ = analyze(PAIR.replace("13950000", "13000000"), "--doctor", str(measured))
    assert status == 4
    assert "each release begins up to 0.049 ms late and costs 0.003 ms\n" in out
    why = "if no time of this computer is above the measured one"
    assert f"forecast: every component meets its deadline, {why}, and\n" in out


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "has no wake-up latency"),
        ('{"findings": [], "wakeup": null}', "without --seconds 0"),
        ('{"wakeup": {"wakeup_us": -1, "overhead_ns": 0}}', "wakeup_ns: expected 0 or more, found -1000"),
        ('{"wakeup": {"wakeup_us": 1, "overhead_ns": null}}', "has no wake-up latency"),
        ('{"wakeup": {"wakeup_us": "fast"}}', "has no wake-up latency"),
        (None, "No such file"),
    ],
)
def test_a_file_without_a_wakeup_latency_is_refused(
    text: str | None, words: str, analyze: Analyze, tmp_path: Path
) -> None:
    file = tmp_path / "doctor.json"
    if text is not None:
        file.write_text(text, encoding="utf-8")
    status, _, err = analyze(ROBOT, "--doctor", str(file))
    assert (status, words in err, err.count("\n")) == (2, True, 1), err


@pytest.mark.parametrize("margin", ["0.9", "nan", "-1"])
def test_a_margin_below_one_is_refused(analyze: Analyze, margin: str) -> None:
    status, _, err = analyze(ROBOT, "--margin", margin)
    assert status == 2
    assert "--margin: expected 1 or more" in err


@pytest.mark.parametrize("words", [("--write",), ("--write", "--json")])
def test_to_write_asks_for_a_bag(analyze: Analyze, words: tuple[str, ...]) -> None:
    status, _, err = analyze(ROBOT, *words)
    assert (status, err) == (2, "mauve: --write: expected an architecture FILE and --budget-from BAG\n")


def test_what_is_not_there_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["analyze", "nowhere.yaml"]) == 2
    assert "nowhere.yaml" in capsys.readouterr().err


# ---- what else takes a CPU or a lock


def test_an_unknown_cost_is_no_zero(analyze: Analyze) -> None:
    text = PAIR.replace("executor: {wakeup_us: 0, overhead_ns: 0}\n", "")
    status, out, _ = analyze(text)
    assert status == 3
    assert out.endswith(
        "not provable: something is missing of this computer\n"
        "  this computer: its longest wake-up is not declared: wakeup_us of the executor, or --wakeup-us "
        "(mauve doctor)\n"
        "  this computer: the cost of a release is not declared: overhead_ns of the executor, or "
        "--overhead-ns (mauve doctor)\n"
    )
    assert analyze(text, "--wakeup-us", "10", "--overhead-ns", "0")[0] == 0
    assert analyze(text, "--wakeup-us", "10")[0] == 3
    status, _, err = analyze(text, "--overhead-ns", "-1")
    assert (status, err) == (2, "mauve: --overhead-ns: expected 0 or more, found -1\n")
    status, out, _ = analyze(text, "--wakeup-us", "0", "--overhead-ns", "20000")
    assert status == 1, "the slow one misses by what the releases cost"
    assert "each release begins up to 0.000 ms late and costs 0.020 ms\n" in out


def test_a_sender_above_a_component_is_part_of_its_response(analyze: Analyze) -> None:
    sender = "sender: {priority: 35, cpus: [0]}"
    text = PAIR.replace("overhead_ns: 0}", f"overhead_ns: 0, {sender}}}").replace("13950000", "10000000") + (
        "resources:\n  count: {kind: shared_data, type: std_msgs/msg/Float64, "
        "topic: {name: count, direction: publish}}\n"
        "connections:\n  - [quick.count, count.write]\n"
    )
    status, out, _ = analyze(text)
    assert status == 3
    assert (
        "  topics_out: its time is not declared: declare wcet_ns and min_interarrival_ns of executor." in out
    )
    assert "  quick: " not in out, "it is above the sender"
    declared = text.replace("cpus: [0]}}", "cpus: [0], wcet_ns: 400000, min_interarrival_ns: 10000000}}", 1)
    status, out, _ = analyze(declared)
    assert status == 0
    assert "thread 'topics_out': CPU 0, priority 35, at most 0.400 ms every 10.000 ms\n" in out
    assert "  response at most 17.600 ms, its deadline of 20.000 ms is met\n" in out
    assert analyze(text.replace("priority: 35", "priority: 10"))[0] == 0


def test_a_preempted_state_is_faulted_in_the_witness(analyze: Analyze, tmp_path: Path) -> None:
    text = PAIR.replace("wcet_ns: 13950000", "wcet_ns: 10000000, max_execution_ns: 11000000")
    bag = tmp_path / "witness"
    status, out, _ = analyze(text, "--witness", str(bag))
    assert status == 1
    assert "  Count: 10.000 ms, declared, faulted above 11.000 ms\n" in out
    assert "thread 'watchdog': any CPU, priority 99, at most 0.042 ms every 1.000 ms\n" in out
    assert "not schedulable: slow is faulted: Count lasts 13." in out
    assert main(["trace", "check", str(bag)]) == 0
    longer = text.replace("max_execution_ns: 11000000", "max_execution_ns: 17000000")
    assert analyze(longer)[0] == 0


def recorded(folder: Path, *, quick_ns: int) -> Path:
    source = SyntheticSource(["quick", "slow"])
    for component, took_ns in (("quick", quick_ns), ("slow", 5_000_000)):
        deploy(source, component)
        instant_ns = EPOCH_NS
        for _ in range(3):
            instant_ns = source.cycle(
                component, instant_ns, states={"Count": took_ns}, wait_ns=20 * MS, wakeup_ns=0
            )
    return record(source, folder)


def test_with_measured_times_a_verdict_is_a_forecast(analyze: Analyze, tmp_path: Path) -> None:
    bag = recorded(tmp_path / "bag", quick_ns=2_000_000)
    text = PAIR.replace(", states: {Count: {wcet_ns: 13950000}}", "")
    status, out, _ = analyze(text, "--budget-from", str(bag), "--wakeup-us", "1000")
    assert status == 4, out
    assert (
        "\nforecast: every component meets its deadline, if no time of slow is above the measured one, and\n"
    ) in out


def test_a_bag_that_shows_more_than_the_bounds_refutes_the_model(analyze: Analyze, tmp_path: Path) -> None:
    bag = recorded(tmp_path / "bag", quick_ns=4_000_000)
    status, out, _ = analyze(PAIR, "--budget-from", str(bag))
    assert status == 5, out
    assert "model refuted: quick took " in out
    assert ", and its bound is 3.000 ms: " in out


def test_another_executor_on_the_computer_takes_its_cpu(analyze: Analyze, tmp_path: Path) -> None:
    loop = "{shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm"
    other = tmp_path / "other.yaml"
    text = f"mauve: 1\ncomponents:\n  quick: {loop}, priority: 70, cpus: [0], properties: {{period_ms: 10}}"
    other.write_text(f"{text}, states: {{Count: {{wcet_ns: 6500000}}}}}}\n", encoding="utf-8")
    status, out, _ = analyze(PAIR.replace("13950000", "1000000"), "--beside", str(other))
    assert status == 0
    assert "thread 'other.yaml:quick': CPU 0, priority 70, at most 6.500 ms every 10.000 ms\n" in out
    assert "  response at most 9.500 ms, its deadline of 10.000 ms is met\n" in out
    status, out, _ = analyze(PAIR, "--beside", str(other))
    assert status == 1
    assert "of other.yaml:quick" in out
    other.write_text(f"{text}}}\n", encoding="utf-8")
    status, out, _ = analyze(PAIR, "--beside", str(other))
    assert status == 3
    why = "its time is not declared: declare the times of quick in other.yaml"
    assert f"  other.yaml:quick: {why}\n" in out


def test_a_robot_with_more_cpus_than_this_computer(analyze: Analyze) -> None:
    status, out, err = analyze(PAIR.replace("priority: 30, cpus: [0]", "priority: 30, cpus: [61]"))
    assert (status, err) == (0, "")
    assert "slow: CPU 61, priority 30" in out


WITH_OFFSET = PAIR.replace("13950000", "5000000").replace(
    "properties: {period_ms: 20}", "offset_ms: 4, deadline_ns: 6000000, properties: {period_ms: 20}"
)
OWN_PERIOD = "period_ns: 5000000, properties: {period_ms: 10}"


def test_a_bound_with_offsets_is_said_to_be_one(analyze: Analyze) -> None:
    status, out, err = analyze(WITH_OFFSET)
    assert (status, err) == (0, "")
    assert "  response at most 5.000 ms (with offsets), its deadline of 6.000 ms is met\n" in out
    condition = "components keep their offsets from the common epoch"
    assert f"  {condition}\n" in out
    told = json.loads(analyze(WITH_OFFSET, "--json")[1])
    assert [one["response"]["by"] for one in told["components"]] == ["", "offsets"]
    assert condition in told["assumptions"]
    status, out, _ = analyze(WITH_OFFSET.replace("deadline_ns: 6000000", "deadline_ns: 20000000"))
    assert (status, condition in out) == (0, False), out


def test_a_declared_period_makes_the_grid_finer(analyze: Analyze) -> None:
    """After a start the component may begin at any of its instants."""
    status, out, _ = analyze(WITH_OFFSET.replace("properties: {period_ms: 10}", OWN_PERIOD))
    assert status == 3
    assert "period 5.000 ms" in out
