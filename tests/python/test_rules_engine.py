"""The rule engine against a model of an executor, in virtual time."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import pytest

from mauve_rt.model.rules import Rule
from mauve_rt.node.supervisor_conditions import SilenceCondition
from mauve_rt.node.supervisor_engine import Decision, Outcome, Request, RuleEngine
from mauve_rt.node.supervisor_rule import ArchitectureView, ComponentView

TICK_S = 0.05
LOCAL = "mauve_examples/LocalExploration"
USUAL = "mauve_examples/Exploration"


def rule(
    name: str = "link_lost", *, target: str = "exploration", undo: bool = True, **changes: object
) -> Rule:
    content: dict[str, object] = {
        "name": name,
        "when": {"silence": {"topic": "in", "type": "mauve_msgs/msg/PeerMessage", "longer_than_s": 1.0}},
        "do": [{"kind": "replace_core", "target": target, "name": LOCAL}],
    }
    if undo:
        content["undo"] = {"for_s": 3.0, "do": [{"kind": "replace_core", "target": target, "name": USUAL}]}
    return Rule(**content | changes)


@dataclass
class World:
    """Virtual time, a peer that speaks every 0.2 s while `talking`, and an executor that answers at once."""

    rules: list[Rule]
    now_s: float = 100.0
    talking: bool = True
    answering: bool = True
    telling: bool = True  # the executor publishes ~/state
    refusals: list[Outcome] = field(default_factory=list)  # one for each of the next requests
    decisions: list[Decision] = field(default_factory=list)
    requests: list[Request] = field(default_factory=list)
    asked_at_s: list[float] = field(default_factory=list)
    revision: int = 5
    instance_id: str = "first"
    components: dict[str, ComponentView] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.conditions = [SilenceCondition("/in", longer_than_s=1.0) for _ in self.rules]
        pairs = list(zip(self.rules, self.conditions, strict=True))
        self.engine = RuleEngine(pairs, act=self._act, decide=self.decisions.append)
        self.components = {name: ComponentView("RUNNING", USUAL) for name in ("exploration", "mapping")}
        self._last_word_s = self.now_s

    def tell(self, components: Mapping[str, ComponentView] | None = None) -> None:
        """The executor publishes its state, changed."""
        self.components.update(components or {})
        self.revision += 1
        if self.telling:
            view = ArchitectureView(self.instance_id, self.revision, dict(self.components))
            self.engine.on_state(self.now_s, view)

    def run(self, seconds: float) -> None:
        end_s = self.now_s + seconds - TICK_S / 2
        while self.now_s < end_s:
            self.now_s += TICK_S
            if self.talking and self.now_s - self._last_word_s >= 0.2:
                self._last_word_s = self.now_s
                for condition in self.conditions:
                    condition.hear(self.now_s)
            self.engine.tick(self.now_s)

    def _act(self, request: Request) -> None:
        self.requests.append(request)
        self.asked_at_s.append(self.now_s)
        if not self.answering:
            return
        if self.refusals:
            self.engine.on_outcome(self.now_s, request.number, self.refusals.pop(0))
            return
        step = request.steps[0]
        self.tell({step.target: ComponentView("RUNNING", step.name)})
        outcome = Outcome(success=True, message="done", revision=self.revision)
        self.engine.on_outcome(self.now_s, request.number, outcome)

    def said(self) -> list[str]:
        return [decision.decision for decision in self.decisions]

    def cores(self) -> list[str]:
        return [request.steps[0].name for request in self.requests]


def started(*rules: Rule) -> World:
    world = World(list(rules) or [rule()])
    world.tell()
    return world


def test_nothing_is_armed_before_the_target_runs():
    world = World([rule()])
    world.talking = False
    world.tell({"exploration": ComponentView("STOPPED", USUAL)})
    world.run(5.0)
    assert world.decisions == []
    world.tell({"exploration": ComponentView("RUNNING", USUAL)})
    assert world.said() == ["armed"]


def test_a_peer_that_never_spoke_is_silent_from_arming_on():
    world = started()
    world.talking = False
    world.run(1.0)
    assert world.said() == ["armed"]
    world.run(0.2)
    assert world.said() == ["armed", "condition_true", "do", "done"]
    assert world.asked_at_s[0] - 100.0 == pytest.approx(1.1, abs=0.06)
    assert "from arming on" in world.decisions[1].reason


def test_a_lost_link_is_acted_on_and_undone_when_it_has_been_back_long_enough():
    world = started()
    world.run(4.0)
    assert world.said() == ["armed"]
    world.talking = False
    world.run(2.0)
    assert world.cores() == [LOCAL]
    request, do = world.requests[0], world.decisions[2]
    assert request.cause.startswith("link_lost: nothing on /in for 1.")
    assert request.expected_revision == 6
    assert do.decision == "do"
    assert 1.0 < do.silence_s < 1.2
    world.talking = True
    back_s = world.now_s
    world.run(2.5)
    assert world.cores() == [LOCAL]
    world.run(1.5)
    assert world.cores() == [LOCAL, USUAL]
    assert world.asked_at_s[1] - back_s >= 3.0
    assert world.said() == ["armed", "condition_true", "do", "done", "condition_false", "undo", "done"]


def test_a_dwell_lets_a_short_silence_pass():
    world = started(rule(for_s=2.0))
    world.talking = False
    world.run(2.5)
    world.talking = True
    world.run(1.0)
    assert world.said() == ["armed", "condition_true", "condition_false"]
    world.talking = False
    lost_s = world.now_s
    world.run(5.0)
    assert world.asked_at_s[0] - lost_s > 2.8


def test_a_flapping_link_causes_one_swap_until_it_is_steady():
    world = started()
    for _ in range(5):
        world.talking = False
        world.run(2.0)
        world.talking = True
        world.run(2.0)
    assert world.cores() == [LOCAL]
    assert world.said().count("condition_true") == 5
    world.run(2.0)
    assert world.cores() == [LOCAL, USUAL]


def test_a_process_that_slept_is_no_silence():
    world = started()
    world.run(1.0)
    world.now_s += 5.0
    world.engine.tick(world.now_s)  # the timer is served before the samples that wait
    world.conditions[0].hear(world.now_s)
    world.run(2.0)
    assert world.said() == ["armed"]


def test_the_cooldown_delays_the_next_action_and_says_so_once():
    world = started(rule(cooldown_s=6.0))
    world.talking = False
    world.run(1.2)
    world.talking = True
    world.run(5.0)
    assert world.cores() == [LOCAL]
    assert world.said()[-1] == "suppressed"
    assert "cooldown" in world.decisions[-1].reason
    world.run(2.0)
    assert world.cores() == [LOCAL, USUAL]
    assert world.asked_at_s[1] - world.asked_at_s[0] >= 6.0
    assert world.said().count("suppressed") == 1


def test_a_failed_action_is_tried_again_ever_later():
    world = started(rule(cooldown_s=1.0))
    world.talking = False
    world.refusals = [Outcome(success=False, message="prepare failed") for _ in range(3)]
    world.run(12.0)
    assert world.said().count("failed") == 3
    assert world.said()[-1] == "done"
    gaps = [later - sooner for sooner, later in zip(world.asked_at_s, world.asked_at_s[1:], strict=False)]
    assert gaps == pytest.approx([1.0, 2.0, 4.0], abs=0.11)
    assert world.decisions[3].message == "prepare failed"


def test_an_executor_that_does_not_answer_is_asked_again():
    world = started()
    world.talking = world.answering = False
    world.run(6.3)
    assert "no answer within 5 s" in world.decisions[-1].reason
    world.answering = True
    world.run(2.0)
    assert world.said()[-2:] == ["do", "done"]


def test_an_answer_that_comes_too_late_is_ignored():
    world = started()
    world.talking = world.answering = False
    world.run(6.3)
    said = world.said()
    world.engine.on_outcome(
        world.now_s, world.requests[0].number, Outcome(success=True, message="", revision=9)
    )
    assert world.said() == said


def test_a_success_that_the_state_does_not_confirm_is_a_failure():
    world = started()
    world.talking = world.telling = False
    world.run(1.5)
    assert world.said()[-1] == "do"
    world.run(2.0)
    assert world.said()[-1] == "failed"
    assert "did not confirm" in world.decisions[-1].reason


def test_a_success_that_the_state_contradicts_is_a_failure():
    world = started()
    world.talking = world.answering = False
    world.run(1.2)
    world.tell()
    outcome = Outcome(success=True, message="", revision=world.revision)
    world.engine.on_outcome(world.now_s, world.requests[0].number, outcome)
    assert world.said()[-1] == "failed"
    assert USUAL in world.decisions[-1].reason


def test_a_state_that_comes_after_the_answer_confirms_it():
    world = started()
    world.talking = world.answering = False
    world.run(1.2)
    outcome = Outcome(success=True, message="", revision=world.revision + 1)
    world.engine.on_outcome(world.now_s, world.requests[0].number, outcome)
    assert world.said()[-1] == "do"
    world.tell({"exploration": ComponentView("RUNNING", LOCAL)})
    assert world.said()[-1] == "done"


def test_a_wrong_revision_is_tried_again_soon_but_with_the_new_state_only():
    world = started()
    world.talking = False
    world.refusals = [Outcome(success=False, message="wrong revision", revision=7, wrong_revision=True)]
    world.run(2.0)
    assert world.said()[-1] == "failed"
    world.tell()
    world.run(0.1)
    assert world.said()[-1] == "done"
    assert world.requests[1].expected_revision == 7


def test_what_is_done_already_is_not_done_again_but_undone():
    world = started()
    world.tell({"exploration": ComponentView("RUNNING", LOCAL)})
    world.talking = False
    world.run(2.0)
    assert world.requests == []
    assert world.said() == ["armed", "condition_true", "suppressed"]
    assert "already" in world.decisions[-1].reason
    world.talking = True
    world.run(4.0)
    assert world.cores() == [USUAL]


def test_a_person_who_swaps_back_by_hand_is_left_alone_until_the_condition_ends():
    world = started()
    world.talking = False
    world.run(1.5)
    world.tell({"exploration": ComponentView("RUNNING", USUAL)})
    assert world.said()[-1] == "suppressed"
    assert "by another hand" in world.decisions[-1].reason
    world.run(5.0)
    world.talking = True
    world.run(4.0)
    assert world.cores() == [LOCAL]
    world.talking = False
    world.run(2.0)
    assert world.cores() == [LOCAL, LOCAL]


def test_without_undo_the_next_silence_is_acted_on_again():
    world = started(rule(undo=False))
    world.talking = False
    world.run(1.5)
    world.talking = True
    world.run(1.0)
    world.tell({"exploration": ComponentView("RUNNING", USUAL)})
    world.talking = False
    world.run(2.0)
    assert world.cores() == [LOCAL, LOCAL]


def test_one_action_at_a_time():
    world = started(rule("one"), rule("two", target="mapping"))
    world.talking = world.answering = False
    world.run(2.0)
    assert [request.steps[0].target for request in world.requests] == ["exploration"]
    assert [d.rule for d in world.decisions if d.decision == "suppressed"] == ["two"]
    world.tell({"exploration": ComponentView("RUNNING", LOCAL)})
    world.answering = True
    world.engine.on_outcome(world.now_s, 1, Outcome(success=True, message="", revision=world.revision))
    world.run(0.1)
    assert [request.steps[0].target for request in world.requests] == ["exploration", "mapping"]


def test_a_target_that_stops_disarms_and_a_held_one_does_not():
    world = started()
    world.tell({"exploration": ComponentView("HELD", USUAL)})
    assert world.said() == ["armed"]
    world.tell({"exploration": ComponentView("FAULTED", USUAL)})
    assert world.said() == ["armed", "suppressed"]
    world.talking = False
    world.run(3.0)
    assert world.requests == []
    world.tell({"exploration": ComponentView("RUNNING", USUAL)})
    world.run(0.9)
    assert world.requests == []  # silence counts from the new arming on
    world.run(0.5)
    assert world.cores() == [LOCAL]


def test_an_executor_started_anew_is_a_new_story():
    world = started()
    world.talking = False
    world.run(1.5)
    world.instance_id = "second"
    world.tell({"exploration": ComponentView("RUNNING", USUAL)})
    assert world.said()[-1] == "armed"
    world.run(1.5)
    assert world.cores() == [LOCAL, LOCAL]


def test_an_executor_that_dies_with_an_action_in_flight():
    world = started()
    world.talking = world.answering = False
    world.run(1.5)
    world.instance_id = "second"
    world.answering = True
    world.tell({"exploration": ComponentView("RUNNING", USUAL)})
    assert world.said()[-2:] == ["failed", "armed"]
    world.run(1.5)
    assert world.said()[-1] == "done"
