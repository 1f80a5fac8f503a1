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
    assert USUAL in world.decisions[-1].reason


def test_a_state_that_comes_after_the_answer_confirms_it():
    world = started()
    world.talking = world.answering = False
    world.run(1.2)
    outcome = Outcome(code=Code.OK, message="", revision=world.revision + 1)
    world.engine.on_outcome(world.now_ns, world.requests[0].request_id, outcome)
    assert world.said()[-1] == "do"
    world.tell({"exploration": ComponentView("RUNNING", LOCAL)})
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


@pytest.mark.parametrize("author", ["rule another", "operator"])
def test_what_is_done_already_is_not_done_again_and_undone_where_a_rule_did_it(author: str):
    world = started()
    world.tell({"exploration": ComponentView("RUNNING", LOCAL, {"core": author})})
    world.talking = False
    world.run(2.0)
    assert world.requests == []
    assert world.said() == ["armed", "condition_true", "suppressed"]
    assert "already" in world.decisions[-1].reason
    world.talking = True
    world.run(4.0)
    assert world.cores() == ([USUAL] if author == "rule another" else [])


def test_a_person_who_swaps_back_by_hand_is_left_alone_until_the_condition_ends():
    world = started()
    world.talking = False
    world.run(1.5)
    world.tell({"exploration": ComponentView("RUNNING", USUAL)})
    assert world.said()[-1] == "suppressed"
    assert "by another requester" in world.decisions[-1].reason
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
    world.engine.on_outcome(
        world.now_ns,
        world.requests[0].request_id,
        Outcome(code=Code.OK, message="", revision=world.revision),
    )
    world.run(0.1)
    assert [request.steps[0].target for request in world.requests] == ["exploration", "mapping"]


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


def after_a_restart(*rules: Rule, author: str = "rule link_lost", **world: object) -> World:
    """A supervisor that starts when an executor runs the other core already, put in by `author`."""
    later = World(list(rules) or [rule()], **world)  # type: ignore[arg-type]
    later.talking = False
    authors = dict.fromkeys(("core", "property gain"), author) if author else {}
    later.tell({"exploration": ComponentView("RUNNING", LOCAL, authors)})
    return later


@pytest.mark.parametrize("author", ["operator: faster", "", "fallback"])
@pytest.mark.parametrize("takes_over", [True, False])
def test_what_an_operator_did_is_undone_only_where_the_rule_takes_it_over(author: str, *, takes_over: bool):
    world = after_a_restart(rule(takes_over=takes_over), author=author)
    world.talking = True  # the condition is false all along
    world.run(8.0)
    assert world.cores() == ([USUAL] if takes_over else [])
    assert ("adopted" in world.said()) == takes_over


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


def test_what_has_no_undo_or_is_undone_already_is_not_adopted():
    assert after_a_restart(rule(undo=False)).said() == ["armed"]
    assert after_a_restart(rule(usual=LOCAL)).said() == ["armed"]


def test_what_only_the_list_of_components_shows_is_adopted():
    def gain(value: float) -> dict[str, object]:
        return {"kind": "set_property", "target": "exploration", "name": "gain", "value": value}

    careful = rule(do=[gain(0.5)], undo=[gain(2.0)])
    assert after_a_restart(careful, properties={"gain": "0.50"}).said() == ["armed", "adopted"]
    assert after_a_restart(careful, properties={"gain": "0.51"}).said() == ["armed"]


def test_a_list_that_comes_late_is_asked_for_again_and_one_of_another_start_is_ignored():
    world = after_a_restart(listing=False)
    other = Inventory("zeroth", {"exploration": ListedComponent(state="RUNNING", core=LOCAL)})
    world.engine.on_inventory(world.now_ns, other)
    world.run(0.5)
    assert world.said() == ["armed"]
    world.listing = True
    world.run(1.1)
    assert world.said()[1] == "adopted"


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
    world.instance_id = "second"
    world.tell({"exploration": ComponentView("RUNNING", USUAL)})
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
    world.components = {
        name: type(view)(view.state, LOCAL, {"core": "rule link_lost"})
        for name, view in world.components.items()
    }
    world.tell()
    world.run(0.5)
    assert [each.decision for each in world.decisions][1:] == ["armed", "adopted", "condition_true"]
    world.talking = True
    world.run(1.0)
    assert world.requests[-1].steps[0].name == USUAL


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
