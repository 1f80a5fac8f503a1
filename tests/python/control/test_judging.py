"""Changes of a running executor, judged by their timing: refused, made with a warning, or only reported."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from mauve_rt._kernel import Simulation
from mauve_rt.analysis.witness_json import witness_of_json
from mauve_rt.control.control import Control
from mauve_rt.control.judging import Judge
from mauve_rt.control.requests import Code, Outcome, Request
from mauve_rt.control.simulated_runtime import SimulatedRuntime
from mauve_rt.control.timing import Timing
from mauve_rt.interfaces.descriptions import component_infos
from mauve_rt.model import load_architecture
from mauve_rt.model.steps import Step

COUNTER = "shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm"
PAIR = f"""\
mauve: 1
executor: {{wakeup_us: 0, overhead_ns: 0, require_schedulable: true}}
components:
  a: {{{COUNTER}, priority: 80, cpus: [0], properties: {{period_ms: 16}},
      states: {{Count: {{wcet_ns: 6000000}}}}}}
  b: {{{COUNTER}, priority: 70, cpus: [0], properties: {{period_ms: 16}},
      states: {{Count: {{wcet_ns: 2000000}}}}}}
  c: {{{COUNTER}, priority: 60, cpus: [0], properties: {{period_ms: 48}}, deadline_ns: 18000000,
      states: {{Count: {{wcet_ns: 6000000}}}}}}
"""
TIMED = f"""\
mauve: 1
executor: {{wakeup_us: 0, overhead_ns: 0, require_schedulable: true}}
components:
  one: {{shell: executor_tests/TimedShell, core: executor_tests/Timed, fsm: executor_tests/TimedFsm,
        alternatives: [executor_tests/HalfTimed, executor_tests/Timed], priority: 40, cpus: [0]}}
  low: {{{COUNTER}, alternatives: [executor_tests/Backwards], priority: 30, cpus: [0],
        properties: {{period_ms: 50}}, states: {{Count: {{wcet_ns: 1000000}}}}}}
  other: {{{COUNTER}, priority: 30, cpus: [1], properties: {{period_ms: 50}},
          states: {{Count: {{wcet_ns: 1000000}}}}}}
resources:
  count: {{kind: ring_buffer, type: std_msgs/msg/Float64, capacity: 8, longest_hold_ns: 20000}}
connections:
  - [low.count, count.write]
"""
AGAIN = Step("replace_core", "one", "executor_tests/Timed")
HALF = Step("replace_core", "one", "executor_tests/HalfTimed")
BACKWARDS = Step("replace_core", "low", "executor_tests/Backwards")
NOT_DECLARED = "core executor_tests/HalfTimed declares no time of is_enabled"

HOUR_NS = 3600 * 10**9
Running = Callable[[str], tuple[Control, SimulatedRuntime, Judge]]


def counter(name: str, priority: int, wcet_ms: int) -> Step:
    """A component more, on CPU 0, every 16 ms."""
    times = f"properties: {{period_ms: 16}}, states: {{Count: {{wcet_ns: {wcet_ms}000000}}}}"
    return Step("add_component", name, value=f"{{{COUNTER}, priority: {priority}, cpus: [0], {times}}}")


SWAP = (
    Step("remove_component", "a"),
    Step("remove_component", "b"),
    counter("a2", 80, 2),
    counter("b2", 70, 6),
)


@pytest.fixture
def running(tmp_path: Path, plugin_prefix: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Running]:
    """running(TEXT): an architecture at work in virtual time, whose threads have all rights."""
    monkeypatch.setattr("mauve_rt.control.timing.VERDICT_NS", HOUR_NS)  # also on a slow computer
    simulation = Simulation(trace=False)

    def run(text: str) -> tuple[Control, SimulatedRuntime, Judge]:
        path = tmp_path / "robot.yaml"
        path.write_text(text, encoding="utf-8")
        runtime = SimulatedRuntime(simulation, lambda: load_architecture(path))
        runtime.configure()
        runtime.activate()
        judge = Judge(runtime)
        return Control(runtime, judge=judge), runtime, judge

    yield run
    simulation.shutdown()


def asked(control: Control, *steps: Step, dry_run: bool = False) -> Outcome:
    return control.handle(Request(steps=steps, dry_run=dry_run))


def outcomes(outcome: Outcome) -> list[str]:
    return [verdict.outcome for verdict in outcome.timing]


def test_a_change_between_two_schedulable_architectures_is_refused(running: Running) -> None:
    control, runtime, _ = running(PAIR)
    before = runtime.kernel_revision()
    refused = asked(control, *SWAP)
    assert refused.code is Code.NOT_SCHEDULABLE
    assert refused.message.startswith("during the change: not schedulable: c misses its deadline at ")
    assert refused.message.endswith("; for the run: mauve analyze NODE --plan STEPS --witness DIR")
    assert outcomes(refused) == ["schedulable", "not schedulable", "schedulable"]
    assert runtime.kernel_revision() == before
    machines, schedule = witness_of_json(refused.timing[1].witness)
    assert {machine.name for machine in machines} >= {"c"}
    assert schedule.missed is not None
    assert schedule.missed.component == "c"
    assert schedule.missed.finish_ns > schedule.missed.deadline_ns
    assert asked(control, *SWAP, dry_run=True) == refused, "a dry run says the same"


LATER = PAIR.replace("deadline_ns: 18000000", "deadline_ns: 25000000")
"""The swap may take c to 26 ms, and at an idle instant to less."""


def test_it_is_made_at_an_idle_instant_where_the_verdict_needs_that(running: Running) -> None:
    control, runtime, _ = running(LATER)
    told = asked(control, *SWAP, dry_run=True)
    assert outcomes(told) == ["schedulable"] * 3
    assert told.timing[1].sentence.endswith(", with the change at an idle instant")
    made = asked(control, *SWAP)
    assert made.code is Code.OK, made.message
    assert "; made while no job of a participant was pending" in made.message
    assert outcomes(made) == ["schedulable"] * 3
    assert {part.name for part in runtime.components()} == {"a2", "b2", "c"}


def test_where_it_only_warns_the_executor_says_that_an_idle_instant_would_do(running: Running) -> None:
    control, _, _ = running(LATER.replace("require_schedulable: true", "require_schedulable: warn"))
    made = asked(control, *SWAP)
    assert made.code is Code.OK, made.message
    assert "; at an idle instant (idle: true): schedulable" in made.message
    assert "made while no job" not in made.message


def test_one_that_is_asked_for_at_an_idle_instant_is_judged_so(running: Running) -> None:
    control, _, _ = running(LATER.replace("require_schedulable: true", "require_schedulable: warn"))
    made = control.handle(Request(steps=SWAP, idle=True))
    assert outcomes(made) == ["schedulable"] * 3
    assert "warning" not in made.message


def test_in_two_changes_it_is_made(running: Running) -> None:
    control, _, _ = running(PAIR)
    made = asked(control, Step("remove_component", "a"))
    assert (made.code, made.timing) == (Code.OK, ()), "it only takes something away: no verdict is needed"
    made = asked(control, Step("remove_component", "b"), counter("a2", 80, 2))
    assert (made.code, outcomes(made)) == (Code.OK, ["schedulable"] * 3)


def test_what_is_not_declared_is_named_in_the_refusal(running: Running) -> None:
    control, runtime, _ = running(TIMED)
    refused = asked(control, HALF)
    assert refused.code is Code.NOT_SCHEDULABLE
    why = f"one: no time is known of Count ({NOT_DECLARED}): declare wcet_ns, or measure (--budget-from BAG)"
    assert refused.message == f"during the change: not provable: something is missing of one; {why}"
    assert refused.timing[2].missing == (why,)
    assert next(part.core for part in runtime.components()) == "executor_tests/Timed"
    assert asked(control, AGAIN).code is Code.OK


def test_the_reply_about_a_component_has_the_times_of_its_core(running: Running) -> None:
    control, runtime, _ = running(TIMED.replace("require_schedulable: true", "require_schedulable: warn"))
    assert told_times(runtime)["low"] == {"Count": 1_000_000}
    assert asked(control, BACKWARDS).code is Code.OK
    assert told_times(runtime)["low"] == {"Count": 0}, "the file declares that of the core before"


def told_times(runtime: SimulatedRuntime) -> dict[str, dict[str, int]]:
    """What `mauve analyze NODE` gets: the worst case of each execution state."""
    return {
        info.name: {state.name: state.wcet_ns for state in info.states if not state.is_wait}
        for info in component_infos(runtime)
    }


def test_warn_makes_the_change_and_says_so(running: Running) -> None:
    control, runtime, _ = running(TIMED.replace("require_schedulable: true", "require_schedulable: warn"))
    made = asked(control, HALF)
    assert made.code is Code.OK
    assert "; warning: during the change: not provable: something is missing of one; one: no" in made.message
    assert next(part.core for part in runtime.components()) == "executor_tests/HalfTimed"
    told = asked(control, HALF, dry_run=True)
    assert told.code is Code.OK
    assert outcomes(told) == ["not provable"] * 3, "the time of the file is that of the first core"


def test_without_the_requirement_only_a_dry_run_is_judged(running: Running) -> None:
    control, _, judge = running(TIMED.replace(", require_schedulable: true", ""))
    made = asked(control, HALF)
    assert (made.code, made.timing, judge._timing) == (Code.OK, (), None)
    told = asked(control, AGAIN, dry_run=True)
    assert told.message == (
        "dry run: 'replace_core one executor_tests/Timed' would be accepted; "
        "now: not provable: something is missing of one; "
        "during the change: not provable: something is missing of one; "
        "after it: schedulable: every component meets its deadline"
    )


def test_what_protects_or_asks_for_no_more_is_never_refused(
    running: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = TIMED.replace("wakeup_us: 0, ", "")
    control, _, _ = running(text)
    refused = asked(control, AGAIN)
    assert refused.code is Code.NOT_SCHEDULABLE
    assert "this computer: its longest wake-up is not declared: wakeup_us of the executor" in refused.message
    monkeypatch.setattr("mauve_rt.control.timing.VERDICT_NS", 0)
    assert asked(control, AGAIN).message == "not proved: no verdict within 0 ms of CPU time"
    assert asked(control, Step("stop", "low")).code is Code.OK
    assert asked(control, Step("start", "low")).code is Code.OK, "a stopped component counts all the time"
    assert asked(control, Step("stop", "low"), Step("remove_component", "other")).code is Code.OK
    told = asked(control, Step("remove_component", "low"), dry_run=True)
    assert (told.code, outcomes(told)) == (Code.OK, ["not proved"])
    rule = Request(steps=(AGAIN,), rule="again", requested_by="supervisor")
    assert control.handle(rule).code is Code.OK, "a rule that acts is not judged then"


def test_a_disconnection_asks_for_no_more(running: Running) -> None:
    control, _, _ = running(TIMED.replace("wakeup_us: 0, ", ""))
    second = Step("connect", "other", "count", "count.write")
    assert asked(control, second).code is Code.NOT_SCHEDULABLE, "two writers take a lock"
    assert asked(control, Step("disconnect", "low", "count")).code is Code.OK
    assert asked(control, second).code is Code.OK, "one writer takes none"


@pytest.mark.parametrize(
    "steps",
    [
        (AGAIN,),
        (HALF,),
        (BACKWARDS,),
        (Step("replace_fsm", "one", "executor_tests/TimedFsm"),),
        (Step("replace_shell", "low", "executor_tests/CounterShell"),),
        (Step("disconnect", "low", "count"),),
        (Step("connect", "other", "count", "count.write"),),
        (Step("stop", "low"), Step("remove_component", "other")),
        (Step("configure", "asleep"),),
        (Step("remove_component", "low"), Step("remove_resource", "count")),
        (
            counter("more", 20, 3),
            Step(
                "add_resource", "ring", value="{kind: ring_buffer, type: std_msgs/msg/Float64, capacity: 4}"
            ),
            Step("connect", "more", "count", "ring.write"),
            Step("disconnect", "low", "count"),
            Step("connect", "low", "count", "ring.write"),
        ),
    ],
    ids=lambda steps: "-".join(step.kind for step in steps),
)
def test_the_foreseen_components_are_those_that_come(running: Running, steps: tuple[Step, ...]) -> None:
    asleep = f"  asleep: {{{COUNTER}, cpus: [1], properties: {{period_ms: 10}}}}\nresources"
    text = TIMED.replace("require_schedulable: true", "require_schedulable: false")
    control, runtime, _ = running(text.replace("resources", asleep))
    assert asked(control, Step("stop", "asleep")).success
    timing = Timing(runtime)
    found = timing.of_change(steps)
    assert found is not None
    foreseen = [one.machine for one in found.judged.after.subjects if one.machine.is_component]
    assert (made := asked(control, *steps)).success, made.message
    there = [one.machine for one in timing.now().study.subjects if one.machine.is_component]
    assert foreseen == there


def test_bounds_of_cpus_that_the_change_does_not_touch_are_those_of_before(running: Running) -> None:
    _, runtime, _ = running(TIMED)
    found = Timing(runtime).of_change([HALF])
    assert found is not None
    assert found.judged.during.bounds["other"] is found.now.bounds["other"]
    assert found.judged.during.bounds["low"] != found.now.bounds["low"]
