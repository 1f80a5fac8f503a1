"""A candidate core in the shadow of a component: by requests, and in bags; threads and virtual time."""

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from rclpy.serialization import deserialize_message
from rebuilt_package import RebuiltPackage
from reload_world import WORLDS, World, make_world_of_bad_cores

from mauve_msgs.msg import Shadow
from mauve_rt._kernel import ShadowRecord
from mauve_rt.control.requests import Code, Step
from mauve_rt.interfaces.descriptions import component_infos
from mauve_rt.interfaces.recorded_shadows import RecordedShadows
from mauve_rt.simulation.messages import serialize

BUDGET = "{budget_us: 50000}"


@pytest.fixture(params=WORLDS)
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


class Bag:
    """What a recorder takes, each message with its time in ns."""

    def __init__(self, world: World) -> None:
        self.source = RecordedShadows(world.runtime, "/executor", serialize)
        self.source.keep_messages(on=True)
        self.found: list[tuple[int, Any]] = []
        self._world = world

    def take(self, duration_ms: int = 0) -> int:
        """Let time pass, then take; returns how many messages there were."""
        self._world.run(duration_ms)
        taken = self.source.take_messages()
        assert {(one.topic, one.type_name) for one in taken} <= {
            ("/executor/shadow", "mauve_msgs/msg/Shadow")
        }
        self.found += [(one.monotonic_ns, deserialize_message(one.data, Shadow)) for one in taken]
        return len(taken)

    def verdicts(self) -> list[int]:
        return [message.verdict for _, message in self.found]


def test_a_bag_has_a_message_each_second_and_one_after_the_end(world: World) -> None:
    bag = Bag(world)
    assert bag.take() == 0
    _shadow(world, "Louder")
    while len(bag.found) < 3:
        bag.take(50)
    assert world.ask(Step("end_shadow", "loop")).success
    while bag.take(50) or bag.verdicts()[-1] == Shadow.RUNNING:
        pass
    running = bag.verdicts().count(Shadow.RUNNING)
    assert bag.verdicts()[:running] == [Shadow.RUNNING] * running
    times = [time_ns for time_ns, _ in bag.found[:running]]
    assert min(after - before for before, after in pairwise(times)) >= 1_000_000_000
    counts = [message.compared for _, message in bag.found]
    assert counts == sorted(counts)
    record = _record(world, verdict="ended")
    _, last = bag.found[-1]
    assert (last.verdict, last.reason, last.end_ns) == (Shadow.ENDED, record.reason, record.end_ns)
    assert (last.compared, last.outputs[0].maximum) == (
        record.compared,
        record.outputs[0].numbers[0].maximum,
    )
    assert bag.take(1100) == 0, "it has ended"


def test_a_bag_that_ends_has_the_last_figures_of_a_shadow_that_runs(world: World) -> None:
    bag = Bag(world)
    _shadow(world, "Louder")
    _record(world, compared=5)
    assert bag.take() == 1
    _record(world, compared=bag.found[0][1].compared + 1)
    bag.source.finish()
    assert bag.take() == 1
    first, last = (message.compared for _, message in bag.found)
    assert bag.verdicts() == [Shadow.RUNNING] * 2
    assert last > first


def test_a_bag_has_the_shadows_of_its_own_time(world: World) -> None:
    _shadow(world, "Throws")
    before = _record(world, verdict="faulted")
    bag = Bag(world)
    assert bag.take() == 0
    _shadow(world, "Louder")
    _record(world, compared=1)
    assert bag.take() == 1
    _, message = bag.found[0]
    assert message.core == "reload_tests/Louder"
    assert message.begin_ns > before.end_ns


def _replace(world: World, core: str, greatest: float, within_s: float) -> bool:
    value = f"{{bumpless: {{outputs: {{sum.data: {greatest}}}, within_s: {within_s}}}}}"
    return world.ask(Step("replace_core", "loop", f"reload_tests/{core}", value)).success


def test_a_bag_has_the_curves_of_a_bumpless_change(world: World) -> None:
    bag = Bag(world)
    assert _replace(world, "Other", 1e9, 60)
    while not bag.found or len(bag.found[-1][1].curves[0].new_core) < 64:
        bag.take(50)
    assert bag.take(1100) == 0, "the curves are complete"
    (curve,) = bag.found[-1][1].curves
    assert curve.output == "sum.data"
    assert curve.instants_ns[-1] < curve.instant_ns <= curve.new_instants_ns[0]
    assert len(curve.instants_ns) == len(curve.live) == len(curve.candidate)
    assert list(curve.new_core) == [curve.new_core[0] + number for number in range(64)]
    (info,) = (info for info in component_infos(world.runtime) if info.name == "loop")
    assert info.shadows[0].steps
    assert not info.shadows[0].curves, "they are large, and the list is asked for often"


def test_a_refused_bumpless_change_is_in_the_bag_once(world: World) -> None:
    bag = Bag(world)
    assert not _replace(world, "Louder", 0.001, 0.1)
    while Shadow.ENDED not in bag.verdicts():
        bag.take(50)
    bag.take(1100)
    assert bag.take(1100) == 0, "a step that is not known is no news"
    (curve,) = bag.found[-1][1].curves
    assert (curve.instant_ns, list(curve.new_core)) == (0, [])
    assert len(curve.live) > 0


def test_the_shadow_of_a_removed_component_has_ended(world: World) -> None:
    bag = Bag(world)
    _shadow(world, "Louder")
    _record(world, compared=5)
    assert bag.take() == 1
    outcome = world.ask(Step("stop", "loop"), Step("remove_component", "loop"))
    assert outcome.success, outcome.message
    assert [bag.take(), bag.take()] == [1, 0]
    _, last = bag.found[-1]
    assert (last.verdict, last.reason) == (Shadow.ENDED, "the component was removed")
    assert last.end_ns > last.begin_ns
