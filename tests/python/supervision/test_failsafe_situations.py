"""Situations that the failsafes of PX4-Autopilot met, each on the real engine of a simulated executor."""

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from mauve_rt._kernel import ActionStep, Simulation
from mauve_rt.control.control import Control
from mauve_rt.control.requests import OVER_RULES, Code, Request
from mauve_rt.model.steps import Step
from mauve_rt.supervision.decisions import Decision
from mauve_rt.supervision.rehearsed_rules import RehearsedRules
from mauve_rt.supervision.rules import RulesFile
from mauve_rt.supervision.stand_ins import StandInRuntime

MANUAL = "p/Manual"


class Vehicle:
    """Its component `mode` has the core of the mode in which it flies; each topic says yes (1) or no (0)."""

    def __init__(self, simulation: Simulation, file: RulesFile) -> None:
        self._simulation = simulation
        self.runtime = StandInRuntime(simulation, file)
        self.runtime.configure()
        self.runtime.activate()
        self._control = Control(self.runtime)
        self.ask(MANUAL)
        self.decisions: list[Decision] = []
        self.rules = RehearsedRules(simulation, self.runtime, file, self.decisions.append)

    @property
    def mode(self) -> str:
        (core,) = (part.core for part in self.runtime.components() if part.name == "mode")
        return core

    def say(self, **topics: bool) -> None:
        for number, signal in enumerate(self.rules.signals):
            if signal.target in topics:
                self.rules.tell(number, float(topics[signal.target]))
        self.rules.look()

    def fly(self, seconds: float) -> set[str]:
        """The modes in which it flew."""
        end_ns = self._simulation.now_ns() + round(seconds * 1e9)
        modes = {self.mode}
        while self._simulation.now_ns() < end_ns:
            self.rules.run_until(min(end_ns, self._simulation.now_ns() + 50_000_000))
            self.rules.look()
            modes.add(self.mode)
        return modes

    def ask(self, mode: str, **how: Any) -> Code:
        """The pilot selects a mode."""
        outcome = self._control.handle(Request(steps=(Step("replace_core", "mode", mode),), **how))
        return outcome.code

    def did(self, rule: str) -> list[str]:
        return [each.decision for each in self.decisions if each.rule == rule]


Fly = Callable[..., Vehicle]


@pytest.fixture
def vehicle(tmp_path: Path) -> Iterator[Fly]:
    """vehicle(rule, ...): one that flies in manual mode, with these rules."""
    simulations: list[Simulation] = []

    def build(*rules: dict[str, Any]) -> Vehicle:
        # The pilot's modes are named by a rule that never holds.
        never = rule("never", "never", MANUAL) | {"do": [core(MANUAL), core("p/Position")]}
        text = json.dumps({"mauve": 1, "rules": [*rules, never]})
        (tmp_path / "rules").write_text(text, encoding="utf-8")
        simulations.append(Simulation(trace=False))
        return Vehicle(simulations[-1], RulesFile(tmp_path / "rules"))

    yield build
    for simulation in simulations:
        simulation.shutdown()


def core(mode: str) -> dict[str, Any]:
    return {"kind": "replace_core", "target": "mode", "name": mode}


def says(topic: str) -> dict[str, Any]:
    return {"value": {"topic": topic, "type": "std_msgs/msg/Float64", "field": "data", "above": 0.5}}


def rule(name: str, topic: str, mode: str, **more: Any) -> dict[str, Any]:
    return {"name": name, "when": says(topic), "do": [core(mode)], "undo": {}, **more}


@pytest.mark.parametrize("where", ["executor", "supervisor"])
def test_a_delay_before_a_warning_changes_no_mode(vehicle: Fly, where: str) -> None:
    """Issue #27554: the delay of a failsafe that should do nothing put the aircraft in hold on the ground."""
    lamp = {"kind": "set_property", "target": "panel", "name": "lamp", "value": "true"}
    warn = rule("low_time", "low_time", MANUAL, for_s=5.0) | {"do": [lamp], "in": where}
    hold = rule("hold", "lost", "p/Hold", priority=1)
    craft = vehicle(warn, hold)
    craft.say(low_time=True, lost=False)
    assert craft.fly(4.9) == {MANUAL}
    assert "do" not in craft.did("low_time")
    assert craft.fly(5.0) == {MANUAL}
    assert craft.did("low_time")[-1] == "done"


@pytest.mark.parametrize("where", ["executor", "supervisor"])
def test_a_cause_that_is_gone_before_its_rule_may_act_is_not_acted_on(vehicle: Fly, where: str) -> None:
    """Pull request #25180: a deferred failsafe acted when deferring ended, although its cause was gone."""
    defer = rule("defer", "external", "p/External", priority=1)
    lost = rule("lost", "lost", "p/Return") | {"in": where}
    craft = vehicle(defer, lost)
    craft.say(external=True, lost=False)
    craft.say(lost=True)
    assert craft.fly(1.0) == {"p/External"}
    craft.say(lost=False)
    craft.fly(1.0)
    craft.say(external=False)
    assert craft.fly(5.0) == {MANUAL}


@pytest.mark.parametrize("where", ["executor", "supervisor"])
def test_a_deferred_rule_is_in_force_before_the_pilot_s_next_request(vehicle: Fly, where: str) -> None:
    """Pull request #25180: a mode switch right at the end of deferring got past the failsafe."""
    defer = rule("defer", "external", "p/External", priority=1)
    lost = rule("lost", "lost", "p/Return") | {"in": where}
    craft = vehicle(defer, lost)
    craft.say(external=True, lost=True)
    craft.fly(1.0)
    craft.say(external=False)
    assert craft.mode == "p/Return", "it went there straight"
    assert craft.ask("p/Position") is Code.HELD_BY_RULE
    assert craft.mode == "p/Return"


@pytest.mark.parametrize("where", ["executor", "supervisor"])
def test_a_refused_mode_switch_leaves_the_failsafe_in_force(vehicle: Fly, where: str) -> None:
    """Pull request #24424: after a refused mode switch the vehicle left return for a mode without a pilot."""
    craft = vehicle(rule("rc_lost", "lost", "p/Return") | {"in": where})
    craft.say(lost=True)
    assert craft.ask("p/Position") is Code.HELD_BY_RULE
    assert craft.fly(5.0) == {"p/Return"}
    craft.say(lost=False)
    assert craft.fly(1.0) == {MANUAL}, "no request was taken: the mode of before comes back"


def test_a_latched_failsafe_stays_when_its_cause_is_gone(vehicle: Fly) -> None:
    """Pull request #24424: the vehicle stays in return, also with the link back, until the pilot acts."""
    craft = vehicle(rule("rc_lost", "lost", "p/Return", latch=True))
    craft.say(lost=True)
    craft.say(lost=False)
    assert craft.fly(5.0) == {"p/Return"}
    assert craft.ask("p/Position", over=OVER_RULES) is Code.OK
    assert craft.fly(1.0) == {"p/Position"}


@pytest.mark.parametrize("where", ["executor", "supervisor"])
def test_the_pilot_takes_over_from_a_degraded_failsafe(vehicle: Fly, where: str) -> None:
    """Pull request #26237: return was not possible, so the vehicle landed; the pilot could not take over."""
    back = rule("return", "lost", "p/Return", priority=1) | {"in": where}
    land = rule("land", "lost", "p/Land") | {"in": where}
    craft = vehicle(back, land)
    craft.runtime.architecture.overlays.reject(ActionStep("replace_core", "mode", "p/Return"))
    craft.say(lost=True)
    assert craft.fly(1.0) == {"p/Land"}
    assert craft.ask(MANUAL) is Code.HELD_BY_RULE
    assert craft.ask(MANUAL, over=OVER_RULES) is Code.OK
    assert craft.fly(5.0) == {MANUAL}
