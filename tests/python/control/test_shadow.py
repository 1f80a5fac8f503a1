"""A candidate core in the shadow of a component, as requests ask for it; threads and virtual time."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from rebuilt_package import RebuiltPackage
from reload_world import World, make_world_of_bad_cores

from mauve_rt._kernel import ShadowRecord
from mauve_rt.control.requests import Code, Step
from mauve_rt.interfaces.descriptions import component_infos

BUDGET = "{budget_us: 50000}"


@pytest.fixture(params=["threads", "virtual time"])
def world(request: pytest.FixtureRequest, rebuilt: RebuiltPackage, tmp_path: Path) -> Iterator[World]:
    yield from make_world_of_bad_cores(request.param, tmp_path, rebuilt)


def _shadow(world: World, core: str, value: str = BUDGET) -> None:
    outcome = world.ask(Step("shadow", "loop", f"reload_tests/{core}", value))
    assert outcome.success, outcome.message


def _record(world: World, *, compared: int = 0, verdict: str = "running") -> ShadowRecord:
    for _ in range(2000):
        world.runtime.host.settle_probations()
        (record,) = world.runtime.shadows()
        if record.compared >= compared and record.verdict == verdict:
            return record
        world.run(5)
    raise AssertionError(f"{record.verdict}, {record.compared} compared: {record.reason}")


def test_the_difference_of_each_output_is_told(world: World) -> None:
    _shadow(world, "Louder")
    first = _record(world, compared=20)
    (output,) = first.outputs
    (number,) = output.numbers
    assert (output.port, number.path) == ("sum", "data")
    assert number.nan == number.live_nan == 0
    assert 0 < number.rms <= number.maximum
    assert world.part().core == "reload_tests/Loop"
    assert world.mean_step() == 1.0, "what the candidate writes reaches nobody"
    info = next(info for info in component_infos(world.runtime) if info.name == "loop")
    (message,) = info.shadows
    assert (message.core, message.verdict) == ("reload_tests/Louder", message.RUNNING)
    assert message.outputs[0].maximum >= number.maximum
    assert world.ask(Step("end_shadow", "loop")).success
    assert _record(world, verdict="ended").core == "reload_tests/Louder"


def test_a_candidate_that_writes_nan_or_raises_harms_nobody(world: World) -> None:
    _shadow(world, "Nan")
    assert _record(world, compared=10).outputs[0].numbers[0].nan == 1
    assert world.ask(Step("end_shadow", "loop")).success
    _shadow(world, "Throws")
    record = _record(world, verdict="faulted")
    assert "the new code is broken" in record.reason
    part = world.part()
    assert (part.state, part.fault) == ("RUNNING", "")


def test_the_warm_candidate_is_promoted(world: World) -> None:
    _shadow(world, "Other")
    rounds = _record(world, compared=20).compared
    outcome = world.ask(Step("promote", "loop"))
    assert outcome.success, outcome.message
    assert world.part().core == "reload_tests/Other"
    assert world.mean_step() == 1.0
    assert world.sum()[0] >= rounds, "with the sum that it had in the shadow"
    assert _record(world, verdict="promoted").core == "reload_tests/Other"


def test_what_makes_no_sense_is_refused(world: World) -> None:
    for step, code, words in (
        (Step("shadow", "loop", "reload_tests/Other", "{budget: 1}"), Code.INVALID, "budget_us"),
        (Step("shadow", "loop", "reload_tests/Other", "{budget_us: 0}"), Code.INVALID, "more than 0"),
        (Step("shadow", "loop", "reload_tests/None", BUDGET), Code.UNKNOWN_CORE, "not installed"),
        (Step("shadow", "twin", "reload_tests/Other", BUDGET), Code.UNDECLARED_CORE, "not declared"),
        (Step("promote", "loop"), None, "shadow"),
    ):
        outcome = world.ask(step)
        assert not outcome.success, step
        assert words in outcome.message
        assert code in (None, outcome.code)
