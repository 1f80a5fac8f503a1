"""What rules and persons want of the same: requests carried out on real components without ROS."""

import pytest

from mauve_rt.control.control import Control
from mauve_rt.control.requests import OVER_RULES, Code, Outcome, Request, Step
from mauve_rt.control.runtime import Runtime

USUAL, SAFE, THIRD = "executor_tests/Counter", "executor_tests/Backwards", "executor_tests/Reluctant"
COMPONENT = (
    "{shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm, "
    "alternatives: [executor_tests/Backwards, executor_tests/Reluctant]}"
)
FILE = f"""\
mauve: 1
executor: {{namespace: /robot_1}}
components:
  one: {COMPONENT}
  two: {COMPONENT}
"""


class World:
    """Requests of supervisors' rules and of persons."""

    def __init__(self, runtime: Runtime) -> None:
        self.runtime = runtime
        self.control = Control(runtime)

    def act(self, rule: str, *steps: Step, priority: int = 0, release: bool = False) -> Outcome:
        request = Request(
            steps=steps, rule=rule, priority=priority, release=release, requested_by="/robot_1/supervisor"
        )
        outcome = self.control.handle(request)
        assert outcome.success, outcome.message
        return outcome

    def ask(self, *steps: Step, over: str = "", base: bool = False, dry_run: bool = False) -> Outcome:
        request = Request(steps=steps, over=over, base=base, dry_run=dry_run, requested_by="operator")
        return self.control.handle(request)

    def core(self, component: str = "one") -> str:
        return next(part.core for part in self.runtime.components() if part.name == component)

    def state(self, component: str = "one") -> str:
        return next(part.state for part in self.runtime.components() if part.name == component)

    def step_of(self, component: str = "two") -> object:
        part = next(part for part in self.runtime.components() if part.name == component)
        return next(item.value for item in part.properties if item.name == "step")

    def holder(self, element: str = "core") -> str:
        held = self.runtime.architecture.overlays.table()
        return next((each.wanted.rule or each.wanted.by for each in held if each.element == element), "")


@pytest.fixture
def world(runtime: Runtime) -> World:
    return World(runtime)


def core(name: str, component: str = "one") -> Step:
    return Step("replace_core", component, name)


def step(value: float, component: str = "two") -> Step:
    return Step("set_property", component, "step", repr(value))


def test_what_was_there_comes_back_whoever_put_it_there(world: World) -> None:
    for before in (USUAL, SAFE):
        assert world.ask(core(before)).success
        world.act("low", core(SAFE), step(7.0))
        assert (world.core(), world.step_of()) == (SAFE, 7.0)
        world.act("low", release=True)
        assert (world.core(), world.step_of()) == (before, 1.0)


def test_of_two_rules_each_element_is_decided_by_itself(world: World) -> None:
    world.act("low", core(SAFE), step(7.0))
    world.act("high", step(9.0), priority=5)
    assert (world.core(), world.step_of()) == (SAFE, 9.0)
    world.act("low", core(SAFE), step(7.0))
    assert world.step_of() == 9.0, "it asked again"
    world.act("high", release=True)
    assert (world.core(), world.step_of()) == (SAFE, 7.0)
    world.act("high", step(9.0), priority=5)
    world.act("low", release=True)
    assert (world.core(), world.step_of()) == (USUAL, 9.0)
    world.act("high", release=True)
    assert world.step_of() == 1.0


def test_what_a_rule_holds_is_refused_and_named(world: World) -> None:
    world.act("degrade", core(SAFE))
    for dry_run in (False, True):
        refused = world.ask(core(USUAL), step(3.0), dry_run=dry_run)
        assert refused.code is Code.HELD_BY_RULE
        for word in ("rule 'degrade'", "the core of 'one'", "--over-rules", "--base"):
            assert word in refused.message
    assert (world.core(), world.step_of()) == (SAFE, 1.0), "all or nothing"
    assert world.ask(step(3.0)).success, "nobody holds it"
    assert world.ask(core(SAFE)).success, "it is what the rule wants"
    world.act("degrade", release=True)
    assert world.core() == USUAL


def test_over_a_rule_until_it_is_released_or_ends(world: World) -> None:
    world.act("degrade", core(SAFE))
    assert world.ask(core(USUAL), over=OVER_RULES).success
    assert (world.core(), world.holder()) == (USUAL, "over")
    assert world.control.release("degrade").success
    assert (world.core(), world.holder()) == (SAFE, "degrade")
    assert world.ask(core(USUAL), over=OVER_RULES).success
    world.act("degrade", release=True)
    assert (world.core(), world.holder()) == (USUAL, "")
    world.act("degrade", core(SAFE))
    assert world.core() == SAFE, "what was over it has ended with it"


def test_a_value_over_a_rule_that_is_refused_leaves_the_rule(world: World) -> None:
    world.act("degrade", core(SAFE))
    assert world.ask(core("executor_tests/Nobody"), over=OVER_RULES).code is Code.UNKNOWN_CORE
    assert (world.core(), world.holder()) == (SAFE, "degrade")


def test_the_base_changes_under_a_rule(world: World) -> None:
    world.act("degrade", step(9.0))
    outcome = world.ask(step(4.0), core(SAFE), base=True)
    assert outcome.success, outcome.message
    assert (world.core(), world.step_of()) == (SAFE, 9.0), "what no rule holds is changed at once"
    assert "once the rules" in world.ask(step(5.0), base=True).message
    world.act("degrade", release=True)
    assert world.step_of() == 5.0


def test_a_stop_is_never_refused_and_is_above_rules_until_a_start(world: World) -> None:
    world.act("run", Step("start", "one"), core(SAFE, "two"))
    assert world.ask(Step("stop", "one")).success
    assert (world.state(), world.holder("state")) == ("STOPPED", "stop")
    assert world.ask(Step("start", "one")).success
    assert world.state() == "RUNNING"
    world.act("halt", Step("stop", "one"), priority=3)
    assert world.ask(Step("start", "one")).code is Code.HELD_BY_RULE
    assert world.ask(Step("stop", "two")).success
    assert world.ask(Step("start", "one"), over=OVER_RULES).success
    assert world.state() == "RUNNING"


def test_a_rejected_value_is_put_in_by_a_person_only(world: World) -> None:
    overlays = world.runtime.architecture.overlays
    world.act("degrade", core(SAFE))
    assert world.ask(core("executor_tests/Counter"), base=True).success
    overlays.reject(next(each.base for each in overlays.table() if each.base is not None))
    outcome = world.act("degrade", release=True)
    assert world.core() == SAFE or "stopped" in outcome.message or world.state() == "STOPPED"
    assert world.control.forgive("one").success
    assert not overlays.rejected()


def test_the_rule_that_is_not_active_has_nothing_to_release(world: World) -> None:
    world.act("nobody", core(SAFE), release=True)
    assert world.core() == USUAL


def test_a_rule_without_undo_leaves_only_what_was_in_force(world: World) -> None:
    world.act("high", core(SAFE), priority=5)
    world.act("low", core(THIRD), step(7.0))
    world.act("low", core(THIRD), step(7.0), release=True)
    assert (world.core(), world.step_of()) == (SAFE, 7.0)
    world.act("high", release=True)
    assert (world.core(), world.step_of()) == (USUAL, 7.0), "the core was outranked all the time"
    world.act("low", core(SAFE))
    world.act("high", core(USUAL), priority=5)
    world.act("low", core(SAFE), release=True)
    world.act("high", release=True)
    assert world.core() == SAFE, "it was there before"
