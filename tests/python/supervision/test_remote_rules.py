"""The rule engine against a model of an executor, in virtual time."""

import pytest
from rules_world import LOCAL, USUAL, World, rule, started

from mauve_rt.control.requests import Code, Outcome
from mauve_rt.supervision.inventory import Inventory, ListedComponent
from mauve_rt.supervision.rule import ComponentView
from mauve_rt.supervision.rules import Rule


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
    assert world.asked_at_s[0] - 100.0 == pytest.approx(1.0, abs=0.06)
    assert world.decisions[1].reason.startswith("nothing on /in for 1.0")


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
    assert world.asked_at_s[0] - lost_s > 2.79


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
    world.engine.tick(world.now_ns)  # the timer is served before the samples that wait
    world.hear()
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
    assert world.asked_at_s[1] - world.asked_at_s[0] == pytest.approx(6.0, abs=0.06)
    assert world.said().count("suppressed") == 1


def test_a_failed_action_is_tried_again_ever_later():
    world = started(rule(cooldown_s=1.0))
    world.talking = False
    world.refusals = [Outcome(code=Code.PREPARE_FAILED, message="prepare failed") for _ in range(3)]
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
        world.now_s, world.requests[0].request_id, Outcome(code=Code.OK, message="", revision=9)
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
    outcome = Outcome(code=Code.OK, message="", revision=world.revision)
    world.engine.on_outcome(world.now_ns, world.requests[0].request_id, outcome)
    assert world.said()[-1] == "failed"
    assert "~/state shows that it is not active" in world.decisions[-1].reason


def test_a_state_that_comes_after_the_answer_confirms_it():
    world = started()
    world.talking = world.answering = False
    world.run(1.2)
    outcome = Outcome(code=Code.OK, message="", revision=world.revision + 1)
    world.engine.on_outcome(world.now_ns, world.requests[0].request_id, outcome)
    assert world.said()[-1] == "do"
    world.take(world.requests[0])
    world.tell()
    assert world.said()[-1] == "done"


def test_a_wrong_revision_is_tried_again_soon_but_with_the_new_state_only():
    world = started()
    world.talking = False
    world.refusals = [Outcome(code=Code.WRONG_REVISION, message="wrong revision", revision=7)]
    world.run(2.0)
    assert world.said()[-1] == "do"
    world.tell()
    assert world.said()[-1] == "failed"
    world.run(0.1)
    assert world.said()[-1] == "done"
    assert world.requests[1].expected_revision == 7


@pytest.mark.parametrize(("author", "after"), [("operator", LOCAL), ("fallback", USUAL)])
def test_what_is_done_already_is_held_and_at_the_end_a_person_s_choice_stays(author: str, after: str):
    world = started()
    world.tell({"exploration": ComponentView("RUNNING", LOCAL, {"core": author})})
    world.talking = False
    world.run(2.0)
    assert world.asked() == ["set link_lost"]
    assert world.said() == ["armed", "condition_true", "do", "done"]
    world.talking = True
    world.run(4.0)
    assert world.asked() == ["set link_lost", "release link_lost"]
    assert world.components["exploration"].core == after


def test_what_another_rule_did_stays_as_long_as_that_is_active():
    another = rule("another")
    world = started()
    world.set_already(another)
    world.tell()
    world.talking = False
    world.run(2.0)
    world.talking = True
    world.run(4.0)
    assert world.asked() == ["set link_lost", "release link_lost"]
    assert world.components["exploration"].core == LOCAL
    world.drop("another")
    assert world.components["exploration"].core == USUAL
    assert "adopted" not in world.said(), "another is no rule of this supervisor"


def test_the_end_of_a_rule_without_steps_gives_back_what_was_there_before():
    world = started(rule(undo=[]))
    world.tell({"exploration": ComponentView("RUNNING", "mauve_examples/Hovering")})
    world.talking = False
    world.run(2.0)
    assert world.components["exploration"].core == LOCAL
    world.talking = True
    world.run(4.0)
    assert [(each.release, each.steps == ()) for each in world.requests] == [(False, False), (True, True)]
    assert world.components["exploration"].core == "mauve_examples/Hovering"
    assert world.said()[-2:] == ["undo", "done"]


def test_a_rule_is_set_again_when_the_state_no_longer_names_it_active():
    world = started()
    world.talking = False
    world.run(1.5)
    world.drop("link_lost")
    assert world.components["exploration"].core == USUAL
    world.tell()
    world.run(0.1)
    assert world.asked() == ["set link_lost", "set link_lost"]
    assert world.said()[-2:] == ["do", "done"]
    assert world.components["exploration"].core == LOCAL
    world.run(5.0)
    world.talking = True
    world.run(4.0)
    assert world.asked() == ["set link_lost", "set link_lost", "release link_lost"]
    assert world.components["exploration"].core == USUAL


def test_a_rule_that_the_state_no_longer_names_active_is_not_set_again_once_its_condition_has_ended():
    world = started()
    world.talking = False
    world.run(1.5)
    world.talking = True
    world.run(4.0)
    assert world.asked() == ["set link_lost", "release link_lost"]
    world.tell()
    world.run(4.0)
    assert world.asked() == ["set link_lost", "release link_lost"]


def test_a_person_who_swaps_back_by_hand_is_left_alone_while_the_state_names_the_rule_active():
    world = started()
    world.talking = False
    world.run(1.5)
    said = world.said()
    world.tell({"exploration": ComponentView("RUNNING", USUAL)})
    world.run(5.0)
    assert world.asked() == ["set link_lost"]
    assert world.said() == said
    world.talking = True
    world.run(4.0)
    assert world.asked() == ["set link_lost", "release link_lost"]
    world.talking = False
    world.run(2.0)
    assert world.cores() == [LOCAL, USUAL, LOCAL]


def test_without_undo_what_it_did_stays_and_the_next_silence_is_acted_on_again():
    world = started(rule(undo=False))
    world.talking = False
    world.run(1.5)
    world.talking = True
    world.run(1.0)
    assert world.asked() == ["set link_lost", "release link_lost"]
    assert world.requests[1].steps == world.requests[0].steps, "so that it stays"
    assert world.components["exploration"].core == LOCAL
    assert world.active == set()
    assert world.said() == ["armed", "condition_true", "do", "done", "condition_false"]
    world.tell({"exploration": ComponentView("RUNNING", USUAL)})
    world.talking = False
    world.run(2.0)
    assert world.asked() == ["set link_lost", "release link_lost", "set link_lost"]
    assert world.components["exploration"].core == LOCAL


def test_without_undo_what_somebody_else_has_ended_is_not_released():
    world = started(rule(undo=False))
    world.talking = False
    world.run(1.5)
    world.talking = True
    world.hear()
    world.drop("link_lost")
    world.tell()
    world.run(2.0)
    assert world.asked() == ["set link_lost"]
    assert world.said()[-1] == "condition_false"


def test_without_undo_what_it_did_stays_even_where_a_person_chose_something_before():
    world = started(rule(undo=False))
    world.tell({"exploration": ComponentView("RUNNING", "mauve_examples/Hovering")})
    world.talking = False
    world.run(1.5)
    world.talking = True
    world.run(1.0)
    assert world.asked() == ["set link_lost", "release link_lost"]
    assert world.ran == [LOCAL]


def test_one_action_at_a_time():
    world = started(rule("one"), rule("two", target="mapping"))
    world.talking = world.answering = False
    world.run(2.0)
    assert [request.steps[0].target for request in world.requests] == ["exploration"]
    assert [d.rule for d in world.decisions if d.decision == "suppressed"] == ["two"]
    world.take(world.requests[0])
    world.tell()
    world.answering = True
    world.engine.on_outcome(
        world.now_ns,
        world.requests[0].request_id,
        Outcome(code=Code.OK, message="", revision=world.revision),
    )
    world.run(0.1)
    assert [request.steps[0].target for request in world.requests] == ["exploration", "mapping"]
    assert [d.rule for d in world.decisions if d.decision == "done"] == ["one", "two"]


def test_a_target_that_faults_disarms():
    world = started()
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
    world.restart()
    assert world.said()[-1] == "armed"
    world.run(1.5)
    assert world.cores() == [LOCAL, LOCAL]


def test_what_an_executor_started_anew_names_active_is_adopted():
    world = started()
    world.talking = False
    world.run(1.5)
    world.instance_id = "second"  # it has kept what is active
    world.tell()
    assert world.said()[-2:] == ["armed", "adopted"]
    world.run(3.0)
    assert world.cores() == [LOCAL]
    world.talking = True
    world.run(4.0)
    assert world.asked() == ["set link_lost", "release link_lost"]


def test_an_executor_that_dies_with_an_action_in_flight():
    world = started()
    world.talking = world.answering = False
    world.run(1.5)
    world.answering = True
    world.restart()
    assert world.said()[-2:] == ["failed", "armed"]
    world.run(1.5)
    assert world.said()[-1] == "done"


def after_a_restart(*rules: Rule, active: bool = True, **world: object) -> World:
    """A supervisor that starts when an executor runs the other core already.

    `active`: the supervisor before has set the rule; else a person has put the core in.
    """
    later = World(list(rules) or [rule()], **world)  # type: ignore[arg-type]
    later.talking = False
    if active:
        later.set_already(later.rules[0])
        later.tell()
    else:
        later.tell({"exploration": ComponentView("RUNNING", LOCAL)})
    return later


@pytest.mark.parametrize("author", ["operator: faster", "", "fallback", "rule link_lost"])
@pytest.mark.parametrize("takes_over", [True, False])
def test_a_rule_that_is_not_active_is_not_adopted_whoever_did_what_it_does(author: str, *, takes_over: bool):
    world = World([rule(takes_over=takes_over)])
    authors = dict.fromkeys(("core", "property gain"), author) if author else {}
    world.tell({"exploration": ComponentView("RUNNING", LOCAL, authors)})
    world.run(8.0)  # the condition is false all along
    assert world.requests == []
    assert world.said() == ["armed"]


def test_what_a_rule_asks_for_names_the_rule():
    world = started()
    world.talking = False
    world.run(2.0)
    assert [request.rule for request in world.requests] == ["link_lost"]
    assert world.requests[0].author == "rule link_lost"


def test_what_a_supervisor_before_did_is_adopted_and_undone_when_the_link_has_been_back_long_enough():
    world = after_a_restart()
    assert world.said() == ["armed", "adopted"]
    world.run(5.0)
    assert world.requests == []  # nobody was heard yet: the link may still be lost
    world.talking = True
    back_s = world.now_s
    world.run(4.0)
    assert world.cores() == [USUAL]
    assert world.asked_at_s[0] - back_s >= 3.0
    assert world.said()[-3:] == ["condition_false", "undo", "done"]
    world.talking = False
    world.run(2.0)
    assert world.cores() == [USUAL, LOCAL]


def test_an_undo_that_dwells_shorter_than_the_silence_lasts_does_not_flap_after_a_restart():
    world = after_a_restart(rule(undo_for_s=0.2))
    world.run(5.0)
    assert world.requests == []
    world.tell({"exploration": ComponentView("FAULTED", LOCAL)})
    world.tell({"exploration": ComponentView("RUNNING", LOCAL)})
    assert world.said()[-2:] == ["suppressed", "armed"]
    world.run(5.0)
    assert world.requests == []
    world.talking = True
    world.run(1.0)
    assert world.cores() == [USUAL]


def test_what_has_no_undo_is_adopted_and_released_when_the_link_is_back():
    world = after_a_restart(rule(undo=False))
    assert world.said() == ["armed", "adopted"]
    world.run(5.0)
    assert world.requests == []  # nobody was heard yet: the link may still be lost
    world.talking = True
    world.run(1.0)
    assert world.asked() == ["release link_lost"]
    assert world.requests[0].steps == tuple(world.rules[0].do)
    assert world.components["exploration"].core == LOCAL
    assert not {"undo", "done"} & {*world.said()}


def test_what_is_active_is_adopted_even_where_its_undo_is_so_already():
    world = after_a_restart(rule(usual=LOCAL))
    assert world.said() == ["armed", "adopted"]
    world.talking = True
    world.run(4.0)
    assert world.asked() == ["release link_lost"]
    assert world.active == set()


def test_what_this_supervisor_has_set_is_not_adopted():
    world = started()
    world.talking = False
    world.run(1.5)
    for _ in range(3):
        world.tell()
        world.run(0.5)
    assert world.said() == ["armed", "condition_true", "do", "done"]


def test_what_was_carried_out_without_an_answer_is_adopted_and_released():
    world = started()
    world.talking = world.answering = False
    world.run(6.3)
    assert "no answer within 5 s" in world.decisions[-1].reason
    world.take(world.requests[0])
    world.tell()
    assert world.said()[-1] == "adopted"
    world.answering = world.talking = True
    world.run(4.0)
    assert world.asked() == ["set link_lost", "release link_lost"]
    assert world.active == set()


@pytest.mark.parametrize("is_active", [True, False])
@pytest.mark.parametrize("shown", ["0.50", "0.51"])
def test_what_the_list_shows_is_not_tried_and_no_reason_to_adopt(shown: str, *, is_active: bool):
    def gain(value: float) -> dict[str, object]:
        return {"kind": "set_property", "target": "exploration", "name": "gain", "value": value}

    careful = rule(do=[gain(0.5)], undo=[gain(2.0)])
    world = after_a_restart(careful, active=is_active, properties={"gain": shown})
    assert world.said() == ["armed", "adopted"] if is_active else ["armed"]
    world.talking = True
    world.run(0.5)
    tried = [[float(step.value) for step in trial.steps] for trial in world.trials]
    if is_active:
        assert tried == [[2.0]]
    else:
        assert tried == ([[0.5, 2.0]] if shown == "0.50" else [[0.5], [0.5, 2.0]])


def test_a_list_that_comes_late_is_asked_for_again_and_one_of_another_start_is_ignored():
    world = after_a_restart(listing=False)
    assert world.said() == ["armed", "adopted"], "that does not wait for the list"
    other = Inventory("zeroth", {"exploration": ListedComponent(state="RUNNING", core=LOCAL)})
    world.engine.on_inventory(world.now_ns, other)
    world.run(0.5)
    assert world.trials == []
    world.listing = True
    world.run(1.1)
    assert [[step.name for step in trial.steps] for trial in world.trials] == [[USUAL]]


def test_a_person_s_swap_while_the_supervisor_runs_is_not_adopted():
    world = started()
    world.run(1.0)
    world.tell({"exploration": ComponentView("RUNNING", LOCAL)})
    world.tell({"exploration": ComponentView("STOPPED", LOCAL)})
    world.tell({"exploration": ComponentView("RUNNING", LOCAL)})
    world.run(8.0)
    assert world.requests == []
    assert "adopted" not in world.said()


def test_an_executor_started_anew_in_its_first_state_owes_the_rule_nothing():
    world = after_a_restart()
    world.restart()
    world.talking = True
    world.run(5.0)
    assert world.requests == []
    assert world.said() == ["armed", "adopted", "armed"]


def test_what_the_executor_would_refuse_is_told_at_arming():
    world = World([rule()], known={USUAL})
    world.tell()
    world.run(1.0)
    assert world.said() == ["armed", "refused"]
    assert world.decisions[1].message == f"no core {LOCAL}"
    assert f"do: replace_core exploration {LOCAL}" in world.decisions[1].reason
    assert world.requests == []


def test_an_undo_is_tried_after_its_do_and_told_too():
    world = World([rule()], known={LOCAL})
    world.tell()
    world.run(1.0)
    assert [[step.name for step in trial.steps] for trial in world.trials] == [[LOCAL], [LOCAL, USUAL]]
    assert [trial.dry_run for trial in world.trials] == [True, True]
    assert world.said() == ["armed", "refused"]
    assert "to undo: replace_core" in world.decisions[1].reason


def test_an_undo_of_what_is_in_effect_is_tried_alone():
    world = after_a_restart(known={LOCAL})
    world.run(0.5)
    assert [[step.name for step in trial.steps] for trial in world.trials] == [[USUAL]]
    assert world.said()[:3] == ["armed", "adopted", "condition_true"]
    assert "refused" in world.said()


def test_rules_are_checked_once_for_each_start_of_the_executor():
    world = started(rule("one"), rule("two", target="mapping"))
    world.run(2.0)
    assert len(world.trials) == 4
    world.tell({"exploration": ComponentView("STOPPED", USUAL)})
    world.tell({"exploration": ComponentView("RUNNING", USUAL)})
    world.run(2.0)
    assert len(world.trials) == 4
    world.instance_id = "second"
    world.tell()
    world.run(2.0)
    assert len(world.trials) == 8


def test_an_executor_that_is_not_active_is_asked_again_when_its_state_changes():
    start = [{"kind": "start", "target": "exploration"}]
    world = World([rule(undo=False, do=start)], inactive=True)
    world.tell({"exploration": ComponentView("STOPPED", USUAL)})
    world.run(5.0)
    assert len(world.trials) == 1
    assert "refused" not in world.said()
    world.inactive = False
    world.tell()
    world.run(0.2)
    assert len(world.trials) == 2


def test_a_rule_that_the_executor_runs_is_left_to_it_and_taken_over_when_it_does_no_longer():
    world = World([rule(undo_for_s=0.5)])
    world.own_rules = frozenset({"link_lost"})
    world.talking = False
    world.tell()
    world.run(3.0)
    assert [each.decision for each in world.decisions] == ["suppressed"]
    assert "left to it" in world.decisions[0].reason
    assert world.requests == []
    world.own_rules = frozenset()
    world.set_already(world.rules[0])
    world.tell()
    world.run(0.5)
    assert [each.decision for each in world.decisions][1:] == ["armed", "adopted", "condition_true"]
    world.talking = True
    world.run(1.0)
    assert world.asked() == ["release link_lost"]
    assert world.components["exploration"].core == USUAL


def test_what_only_the_executor_hears_is_not_taken_over():
    late = {"late": {"component": "exploration", "longer_than_s": 0.001}}
    world = started(rule(when=late))
    world.run(2.0)
    assert world.said() == ["suppressed"]
    assert "wake-ups and responses of exploration are known" in world.decisions[0].reason
    world.tell()
    assert world.said() == ["suppressed"], "once"


def test_the_state_of_a_component_is_heard_by_what_the_executor_tells():
    fault = {"fault": {"component": "mapping"}}
    world = started(rule(when=fault, undo_for_s=0.5))
    world.run(2.0)
    assert world.requests == []
    world.tell({"mapping": ComponentView("FAULTED", USUAL)})
    world.run(0.1)
    assert world.cores() == [LOCAL]
    world.tell({"mapping": ComponentView("RUNNING", USUAL)})
    world.run(1.0)
    assert world.cores() == [LOCAL, USUAL]


@pytest.mark.parametrize(
    ("component", "changed"), [("mapping", "mapping"), ("mapping", "exploration"), ("", "exploration")]
)
def test_changes_are_heard_by_what_the_executor_tells(component: str, changed: str):
    told = {"component": component, "longer_than_s": 1.0} if component else {"longer_than_s": 1.0}
    stop = [{"kind": "stop", "target": "camera"}]
    world = started(rule(when={"since_change": told}, do=stop, undo=False))
    world.answering = False
    world.run(0.8)
    world.tell({changed: ComponentView("RUNNING", LOCAL)})
    world.run(0.8)
    assert bool(world.requests) is (component not in ("", changed))
    world.run(0.3)
    assert len(world.requests) == 1


def test_nobody_polls():
    """Between two things that are heard the rules are looked at shortly before silence may be long enough."""
    world = started()
    world.run(1.0)
    world.hear()
    looks, due_ns = 0, world.engine.tick(world.now_ns)
    heard_ns = world.now_ns
    while due_ns <= heard_ns + 10**9:
        assert due_ns >= heard_ns + 10**9 - 55_000_000
        looks, due_ns = looks + 1, world.engine.tick(due_ns)
    assert looks <= 12
    assert due_ns == heard_ns + 10**9 + 1
    world.hear()
    assert not world.engine.is_stirred, "a sample in time is of no interest"
