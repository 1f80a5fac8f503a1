"""A core that goes in only where its outputs are near, by requests; threads and virtual time."""

import argparse
import json
import math
from collections.abc import Iterator
from pathlib import Path

import pytest
from rebuilt_package import RebuiltPackage
from reload_world import WORLDS, World, make_world_of_bad_cores

from mauve_msgs.msg import StepReport
from mauve_rt.cli.bumpless import add_bumpless, bumpless_text
from mauve_rt.cli.views import report_lines
from mauve_rt.control.probations import Verdict
from mauve_rt.control.requests import Code, Step
from mauve_rt.interfaces.descriptions import component_infos, step_reports
from mauve_rt.model.bumpless import read_bumpless
from mauve_rt.trace.reading.shadows import Shadow as ReadShadow


@pytest.fixture(params=WORLDS)
def world(request: pytest.FixtureRequest, rebuilt: RebuiltPackage, tmp_path: Path) -> Iterator[World]:
    yield from make_world_of_bad_cores(request.param, tmp_path, rebuilt)


def _replace(core: str, value: str) -> Step:
    return Step("replace_core", "loop", f"reload_tests/{core}", value)


def _shadow_message(world: World) -> object:
    info = next(info for info in component_infos(world.runtime) if info.name == "loop")
    (message,) = info.shadows
    return message


def test_a_bumpless_change_says_how_far_each_output_stepped(world: World) -> None:
    before = world.sum()[0]
    outcome = world.ask(_replace("Other", "{bumpless: {outputs: {sum.data: 0.5}, within_s: 60}}"))
    assert outcome.success, outcome.message
    assert world.part().core == "reload_tests/Other"
    world.run(50)
    assert world.sum()[0] > before, "the sum goes on"
    message = _shadow_message(world)
    read = ReadShadow.of_message(message, 0)
    assert read.verdict == "promoted"
    (step,) = read.steps
    assert (step.output, step.greatest, step.difference, step.step) == ("sum.data", 0.5, 0.0, 1.0)
    (report,) = step_reports(outcome)
    assert isinstance(report, StepReport)
    assert [output.output for output in report.outputs] == ["sum.data"]
    assert list(report.taken) == ["sum", "rounds"]
    (line,) = report_lines([report])
    assert "sum.data" in line


def test_a_blend_lasts_until_a_step_ends_it(world: World) -> None:
    value = "{bumpless: {outputs: {sum.data: 1e9}, within_s: 60, blend_s: 60}}"
    outcome = world.ask(_replace("Other", value))
    assert outcome.success, outcome.message
    assert world.part().core == "reload_tests/Other"
    ended = "the candidate is the component's core now; the blend ended early: "
    read = ReadShadow.of_message(_shadow_message(world), 0)
    if read.verdict == "running":  # else a busy computer was late for a release
        assert world.ask(Step("end_shadow", "loop")).success
        read = ReadShadow.of_message(_shadow_message(world), 0)
    assert read.verdict == "promoted"
    assert read.reason in (f"{ended}a step end_shadow", f"{ended}an overrun of the component")
    assert world.mean_step() == 1.0


def _decided_blend(world: World) -> str:
    """The verdict of a core that throws in its third release; it may be in the shadow for the first ones."""
    value = "{bumpless: {outputs: {sum.data: 1e9}, within_s: 60, blend_s: 60}}"
    if not world.ask(_replace("Throws", value)).success:
        return "refused"
    while (record := world.runtime.probations()[-1]).verdict == "running":
        world.run(5)
        world.runtime.host.settle_probations()
    return str(record.verdict)


def test_a_fault_of_the_new_core_ends_the_blend_with_the_old_one(world: World) -> None:
    for _ in range(5):
        before = world.sum()[0]
        verdict = _decided_blend(world)
        if verdict == "reverted":
            break
        # A busy computer: the fault came in the shadow, or an overrun had ended the blend.
        if verdict == "inconclusive":
            world.run(50)
            repair = world.ask(Step("replace_core", "loop", "reload_tests/Loop"), Step("start", "loop"))
            assert repair.success, repair.message
    else:
        pytest.skip("a busy computer has ended the blend 5 times")
    part = world.part()
    assert (part.core, part.state) == ("reload_tests/Loop", "RUNNING")
    assert world.mean_step() == 1.0
    assert world.sum()[0] > before, "the sum goes on"
    assert ReadShadow.of_message(_shadow_message(world), 0).verdict == "ended"
    record = world.runtime.probations()[-1]
    assert record.reason == "fault: the new code is broken in state act"
    assert "reload_tests/Loop is back" in Verdict(record).message


def test_a_request_ends_the_blend_with_the_old_core(world: World) -> None:
    value = "{bumpless: {outputs: {sum.data: 1e9}, within_s: 60, blend_s: 60}}"
    for _ in range(5):
        assert world.ask(_replace("Other", value)).success
        if world.ask(Step("revert_core", "loop")).success:
            break
        assert world.ask(Step("replace_core", "loop", "reload_tests/Loop")).success  # an overrun was first
    else:
        pytest.skip("a busy computer has ended the blend 5 times")
    world.run(5)
    assert world.part().core == "reload_tests/Loop"
    assert world.mean_step() == 1.0


def test_a_core_in_python_does_not_go_over(world: World) -> None:
    value = "{bumpless: {outputs: {sum.data: 1e9}, within_s: 60, blend_s: 1}}"
    outcome = world.ask(_replace("PyLoop", value))
    assert not outcome.success
    assert "reload_tests/PyLoop in Python" in outcome.message
    assert "leave out blend_s" in outcome.message
    assert world.part().core == "reload_tests/Loop"


def test_a_core_that_stays_far_is_refused_with_what_was_seen(world: World) -> None:
    world.run(100)
    outcome = world.ask(_replace("Louder", "{bumpless: {outputs: {sum.data: 0.001}, within_s: 0.1}}"))
    assert outcome.code == Code.TIMEOUT
    assert "did not come near those of the core within 100 ms" in outcome.message
    assert "sum.data at least" in outcome.message
    assert world.part().core == "reload_tests/Loop"
    assert world.mean_step() == 1.0
    assert ReadShadow.of_message(_shadow_message(world), 0).verdict == "ended"


def test_the_candidate_of_a_shadow_is_promoted_where_it_is_near(world: World) -> None:
    assert world.ask(Step("shadow", "loop", "reload_tests/Other", "{budget_us: 50000}")).success
    outcome = world.ask(Step("promote", "loop", "", "{bumpless: {outputs: {sum.data: 0.5}, within_s: 60}}"))
    assert outcome.success, outcome.message
    assert world.part().core == "reload_tests/Other"
    assert world.mean_step() == 1.0


def test_a_fresh_candidate_begins_with_its_own_state(world: World) -> None:
    world.run(50)
    assert world.ask(Step("shadow", "loop", "reload_tests/Other", "{budget_us: 50000, fresh: true}")).success
    far = world.ask(Step("promote", "loop", "", "{bumpless: {outputs: {sum.data: 0.5}, within_s: 0.05}}"))
    assert far.code == Code.TIMEOUT
    before = world.sum()[0]
    assert world.ask(Step("promote", "loop", "", "{fresh: true}")).success
    world.run(5)
    assert world.sum()[0] < before


def test_probation_stands_beside_it(world: World) -> None:
    value = "{probation_s: 60, bumpless: {outputs: {sum.data: 1e9}, within_s: 60}}"
    assert world.ask(_replace("Other", value)).success
    (record,) = world.runtime.probations()
    assert (record.to_core, str(record.verdict)) == ("reload_tests/Other", "running")


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ("{}", "outputs"),
        ("{outputs: {}}", "1 to 100 outputs"),
        ("{outputs: {sum.data: -1}}", "greatest step >= 0, found -1"),
        ("{outputs: {sum.data: .nan}}", "greatest step >= 0, found nan"),
        ("{outputs: {sum.data: 1}, within_s: 0}", "within_s: expected more than 0"),
        ("{outputs: {sum.data: 1}, within: 1}", "unknown key 'within'; did you mean"),
        ("{outputs: {sum.data: 1}, budget_us: no}", "budget_us: expected 0"),
        ("{outputs: {sum.data: 1}, blend_s: 61}", "blend_s: expected 0 to 60 s, found 61"),
        ("{outputs: {sum.data: 1}, blend_s: .nan}", "blend_s: expected 0 to 60 s, found nan"),
        ("{blend_s: 1}", "1 to 100 outputs"),
        ("{outputs: {sum.date: 1}}", "no number there"),
        ("{outputs: {total.data: 1}}", "total"),
        ("3", "expected outputs and within_s, found '3'"),
    ],
)
def test_what_cannot_be_bounded_is_refused(value: str, words: str, world: World) -> None:
    for step in (_replace("Other", f"{{bumpless: {value}}}"),):
        outcome = world.ask(step)
        assert not outcome.success
        assert words in outcome.message
    assert world.part().core == "reload_tests/Loop"


def test_a_blend_stands_beside_no_probation(world: World) -> None:
    value = "{probation_s: 60, bumpless: {outputs: {sum.data: 1e9}, blend_s: 1}}"
    outcome = world.ask(_replace("Other", value))
    assert not outcome.success
    assert "expected one of blend_s and probation_s" in outcome.message


def test_values_of_a_promotion_are_checked(world: World) -> None:
    assert world.ask(Step("shadow", "loop", "reload_tests/Other", "{budget_us: 50000}")).success
    for value, words in (
        ("{fresh: 3}", "fresh: expected true or false"),
        ("{speed: 3}", "expected {bumpless:"),
        ("{bumpless: {outputs: 1}}", "1 to 100 outputs"),
    ):
        outcome = world.ask(Step("promote", "loop", "", value))
        assert outcome.code == Code.INVALID
        assert words in outcome.message


def test_defaults() -> None:
    options = read_bumpless({"outputs": {"a.b.c": 1, "d": 0}}).options()
    assert [(each.port, each.field, each.step) for each in options.outputs] == [
        ("a", "b.c", 1.0),
        ("d", "", 0.0),
    ]
    assert (options.within_ns, options.budget_ns, options.blend_ns) == (2_000_000_000, 0, 0)
    assert not math.isnan(options.outputs[0].step)


def test_the_command_line_writes_what_steps_have() -> None:
    parser = argparse.ArgumentParser()
    add_bumpless(parser)
    plain = ["--bumpless", "sum.data=0.5", "--within", "3"]
    assert bumpless_text(parser.parse_args(plain)) == '{"outputs": {"sum.data": 0.5}, "within_s": 3.0}'
    blended = read_bumpless(json.loads(bumpless_text(parser.parse_args([*plain, "--blend", "0.25"]))))
    assert blended.options().blend_ns == 250_000_000
