"""A core on probation, as requests ask for it: verdicts, reasons, refusals; threads and virtual time."""

from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from rebuilt_package import RebuiltPackage
from reload_world import WORLDS, World, make_world_of_bad_cores

from mauve_rt.control.probations import ProbationWatch, Verdict
from mauve_rt.control.reloads import Reload
from mauve_rt.control.requests import Code, Outcome, Request, Step
from mauve_rt.interfaces.descriptions import component_infos
from mauve_rt.model.probation import read_probation

CORE = "reload_tests/{}"


@pytest.fixture(params=WORLDS)
def world(request: pytest.FixtureRequest, rebuilt: RebuiltPackage, tmp_path: Path) -> Iterator[World]:
    yield from make_world_of_bad_cores(request.param, tmp_path, rebuilt)


def _replace(world: World, core: str, probation: str) -> Outcome:
    return world.ask(Step("replace_core", "loop", CORE.format(core), probation))


def test_a_core_that_does_nothing_wrong_passes(world: World) -> None:
    outcome = _replace(world, "Other", "{probation_s: 0.05}")
    assert outcome.success, outcome.message
    assert outcome.report[0].taken == ("sum", "rounds")
    record = world.decided()
    assert (record.verdict, record.reason) == ("passed", "")
    assert record.releases >= 1
    assert world.part().core == CORE.format("Other")


REVERTED = {
    "Throws": ("{probation_s: 60}", "fault: the new code is broken in state act"),
    "Nan": ("{probation_s: 60}", "output loop.sum.data is nan"),
    "Loud": (
        "{probation_s: 60, revert_on: [{output: sum.data, maximum: 1000000.0}]}",
        "output loop.sum.data is 1e+09, above 1e+06",
    ),
}


@pytest.mark.parametrize("core", REVERTED)
def test_a_violation_puts_the_old_core_back(world: World, core: str) -> None:
    probation, reason = REVERTED[core]
    before, first = world.sum()
    assert _replace(world, core, probation).success
    record = world.decided()
    assert (record.verdict, record.reason) == ("reverted", reason)
    assert (record.from_core, record.to_core) == (CORE.format("Loop"), CORE.format(core))
    part = world.part()
    assert (part.core, part.state) == (CORE.format("Loop"), "RUNNING")
    assert world.mean_step() == 1.0, "the old core goes on with its own sum"
    after, last = world.sum()
    assert before + 1 <= after <= before + last - first + 1
    (told,) = ProbationWatch().look(world.runtime.probations())
    assert told.message == (
        f"probation of {CORE.format(core)} in component 'loop': reverted after "
        f"{record.releases} release{'s' * (record.releases != 1)}: {reason}; {CORE.format('Loop')} is back"
    )
    request, event = told.event(7)
    assert (str(request), request.requested_by) == ("revert_core loop", "kernel")
    assert (event.from_core, event.to_core) == (CORE.format(core), CORE.format("Loop"))


def test_too_few_releases_are_inconclusive(world: World) -> None:
    assert _replace(world, "Other", "{probation_s: 0.02, releases: 1000000}").success
    record = world.decided()
    assert record.verdict == "inconclusive"
    assert record.reason.endswith("releases, expected at least 1000000")
    assert world.part().core == CORE.format("Other")


def test_a_step_puts_the_old_core_back(world: World) -> None:
    """By which a rule of any condition does it."""
    assert _replace(world, "Other", "{probation_s: 60}").success
    assert world.ask(Step("revert_core", "loop")).success
    record = world.decided()
    assert (record.verdict, record.reason) == ("reverted", "a step revert_core")
    assert world.part().core == CORE.format("Loop")
    assert world.ask(Step("revert_core", "loop")).success, "there is nothing to do"


def test_the_probation_is_listed(world: World) -> None:
    assert _replace(world, "Other", "{probation_s: 60}").success
    info = next(info for info in component_infos(world.runtime) if info.name == "loop")
    (probation,) = info.probations
    assert (probation.verdict, probation.to_core) == (probation.RUNNING, CORE.format("Other"))
    assert probation.end_ns - probation.begin_ns == 60 * 10**9


def test_what_makes_no_sense_is_refused(world: World) -> None:
    for value, words in (
        ("{probation_s: 0}", "probation_s: expected more than 0"),
        ("{probation_s: 1, revert_on: [overun]}", "unknown violation 'overun'; did you mean overrun?"),
        ("{probation_s: 1, revert_on: [{silence: {}}]}", "write a rule with the step revert_core"),
        ("{probation_s: 1, revert_on: [{output: sum.data, maximum: x}]}", "expected numbers"),
        ("{probation_s: 1, revert_on: [{output: total}]}", "total"),
        (
            "{probation_s: 1, revert_on: [{output: sum.data, minimum: 2, maximum: 1}]}",
            "component 'loop': output sum.data: no number is within the limit; expected minimum <= maximum",
        ),
        ("{probation: 1}", "unknown key 'probation'"),
        ("5", "expected probation_s and revert_on"),
    ):
        outcome = _replace(world, "Other", value)
        assert not outcome.success, value
        assert words in outcome.message
    assert world.part().core == CORE.format("Loop")


def test_a_reload_on_probation_goes_back_as_a_whole(world: World, rebuilt: RebuiltPackage) -> None:
    rebuilt.build("THROWS", "STEP=2.0", "NEW_CORE")
    outcome = world.reload("loop", probation="{probation_s: 60}")
    assert outcome.success, outcome.message
    assert "on probation for 60 s" in outcome.message
    record = world.decided()
    assert record.verdict == "reverted", record.reason
    (verdict,) = [
        one for one in ProbationWatch().look(world.runtime.probations()) if one.record.component == "loop"
    ]
    request = world.control.way_back(verdict)
    assert request is not None
    assert world.control.handle(request).success
    assert world.control.way_back(verdict) is None
    assert [info.generation for info in component_infos(world.runtime)] == [1, 1, 1]
    assert world.mean_step() == 1.0


def test_a_verdict_that_comes_before_the_reload_ends_leads_back_too(
    world: World, rebuilt: RebuiltPackage, monkeypatch: pytest.MonkeyPatch
) -> None:
    requests: list[Request | None] = []
    commit = Reload.commit

    def commit_late(reload: Reload) -> None:
        if not requests:
            requests.append(world.control.way_back(Verdict(world.decided())))
        commit(reload)

    monkeypatch.setattr(Reload, "commit", commit_late)
    rebuilt.build("THROWS", "STEP=2.0", "NEW_CORE")
    assert world.reload("loop", probation="{probation_s: 60}").success
    (request,) = requests
    assert request is not None
    assert world.control.handle(request).success
    assert world.generation() == 1


def test_a_reload_that_passes_stays(world: World, rebuilt: RebuiltPackage) -> None:
    rebuilt.build("STEP=2.0", "NEW_CORE")
    assert world.reload("loop", probation="{probation_s: 0.05}").success
    assert world.decided().verdict == "passed"
    assert world.mean_step() == 2.0


def test_a_changed_shell_cannot_be_on_probation(world: World, rebuilt: RebuiltPackage) -> None:
    rebuilt.build("OTHER_SHELL", "NEW_CORE")
    refused = world.reload("loop", probation="{probation_s: 5}")
    assert refused.code is Code.INVALID
    assert "shell reload_tests/LoopShell has changed" in refused.message
    assert world.generation() == 1


def test_the_value_of_a_step_is_that_of_the_request() -> None:
    value = {"probation_s": 2.0, "revert_on": ["nan", {"output": "a.b", "minimum": 1}], "releases": 3}
    assert read_probation(value).value() == value


def test_each_verdict_is_told_once_and_in_its_order() -> None:
    """The last one and the present one are both listed until the present one is settled."""
    earlier: Any = SimpleNamespace(component="loop", verdict="inconclusive", begin_ns=1)
    present: Any = SimpleNamespace(component="loop", verdict="reverted", begin_ns=2)
    watch = ProbationWatch()
    assert [told.record for told in watch.look([earlier, present])] == [earlier, present]
    assert list(watch.look([earlier, present])) == []
    assert list(watch.look([present])) == []


def test_an_earlier_verdict_is_not_that_of_the_reload(world: World, rebuilt: RebuiltPackage) -> None:
    assert _replace(world, "Other", "{probation_s: 60}").success
    assert world.ask(Step("replace_core", "loop", CORE.format("Loop"))).success
    earlier = Verdict(world.decided())
    assert earlier.record.verdict == "inconclusive"
    rebuilt.build("THROWS", "STEP=2.0", "NEW_CORE")
    assert world.reload("loop", probation="{probation_s: 60}").success
    assert world.control.way_back(earlier) is None
    for _ in range(1000):
        (*_, record) = [each for each in world.runtime.probations() if each.component == "loop"]
        if record.verdict == "reverted":
            break
        world.run(5)
        world.runtime.host.settle_probations()
    assert world.control.way_back(Verdict(record)) is not None
