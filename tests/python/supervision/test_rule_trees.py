"""Rules whose condition is a tree, and rules of which several hold."""

from math import nan

import pytest
from rules_world import LOCAL, USUAL, World, rule, started

from mauve_rt.control.requests import Code, Outcome

Tree = dict[str, object]
OTHER = "mauve_examples/Hovering"


def silence(topic: str, longer_than_s: float = 1.0) -> Tree:
    return {"silence": {"topic": topic, "type": "mauve_msgs/msg/PeerMessage", "longer_than_s": longer_than_s}}


def done(world: World) -> list[str]:
    return [each.rule for each in world.decisions if each.decision == "done"]


@pytest.mark.parametrize(
    ("tree", "quiet", "acts"),
    [
        ({"any": [silence("a"), silence("b")]}, {"b"}, True),
        ({"any": [silence("a"), silence("b")]}, set(), False),
        ({"all": [silence("a"), silence("b")]}, {"b"}, False),
        ({"all": [silence("a"), silence("b")]}, {"a", "b"}, True),
        ({"all": [silence("a"), {"not": silence("b")}]}, {"a"}, True),
        ({"all": [silence("a"), {"not": silence("b")}]}, {"a", "b"}, False),
        ({"at_least": {"count": 2, "of": [silence("a"), silence("b"), silence("c")]}}, {"c"}, False),
        ({"at_least": {"count": 2, "of": [silence("a"), silence("b"), silence("c")]}}, {"a", "c"}, True),
    ],
)
def test_what_is_combined(tree: Tree, quiet: set[str], *, acts: bool):
    world = started(rule(when=tree))
    world.run(1.0)
    assert world.requests == []
    world.quiet = quiet
    world.run(1.0)
    assert world.requests == [], "nothing is silent yet"
    world.run(1.0)
    assert bool(world.requests) is acts


def test_a_part_that_must_hold_without_a_break():
    world = started(rule(when={"any": [{**silence("a"), "for_s": 2.0}]}))
    for _ in range(3):
        world.quiet = {"a"}
        world.run(2.5)
        world.quiet = set()
        world.run(0.5)
    assert world.requests == []
    world.quiet = {"a"}
    world.run(3.5)
    assert len(world.requests) == 1
    assert world.requests[0].cause == "link_lost: silence of /a longer than 1 s"


def test_what_held_a_while_ago():
    """One was silent, and now, within five seconds of that, the other is."""
    tree = {"all": [{**silence("a"), "within_s": 5.0}, silence("b")]}
    for pause_s, acts in ((2.0, True), (7.0, False)):
        world = started(rule(when=tree))
        world.quiet = {"a"}
        world.run(2.0)
        world.quiet = set()
        world.run(pause_s)
        world.quiet = {"b"}
        world.run(1.5)
        assert bool(world.requests) is acts


def test_a_tree_that_did_before_a_restart_holds_until_it_is_heard_otherwise():
    world = World([rule(when={"any": [silence("a"), silence("b")]}, undo_for_s=0.5)])
    world.set_already(world.rules[0])
    world.talking = False
    world.tell()
    world.run(3.0)
    assert [each.decision for each in world.decisions].count("adopted") == 1
    assert world.requests == []
    world.talking = True
    world.run(2.0)
    assert [step.name for step in world.requests[0].steps] == [USUAL]


@pytest.mark.parametrize("bad", [9.9, -0.1, nan])
def test_a_value_beyond_its_bounds(bad: float):
    told = {"topic": "a", "type": "std_msgs/msg/Float64", "field": "data", "below": 0, "above": 9.0}
    world = started(rule(when={"value": {**told, "hysteresis": 1.0}}, undo_for_s=0.5))
    for value, core in ((9.0, USUAL), (bad, LOCAL), (8.5, LOCAL), (0.5, LOCAL), (7.5, USUAL), (8.5, USUAL)):
        world.value = value
        world.run(2.0)
        assert world.components["exploration"].core == core, value
    assert world.requests[0].cause == f"link_lost: data of /a is {bad:g}"


def test_a_value_that_was_not_heard_is_no_cause():
    told = {"topic": "a", "type": "std_msgs/msg/Float64", "field": "data", "above": 9.0}
    world = started(rule(when={"value": told}))
    world.quiet, world.value = {"a"}, 10.0
    world.run(5.0)
    assert world.requests == []


def rivals(*quiet: str) -> World:
    lower = rule("lower", when=silence("a"), undo_for_s=0.5)
    do = [{"kind": "replace_core", "target": "exploration", "name": OTHER}]
    higher = rule("higher", when=silence("b"), do=do, priority=5, undo_for_s=0.5)
    world = started(lower, higher)
    world.known.add(OTHER)
    world.quiet = {*quiet}
    return world


def outranked(world: World) -> list[tuple[str, str]]:
    told = [each for each in world.decisions if "outranked" in each.reason]
    assert {each.decision for each in told} <= {"suppressed"}
    return [(each.rule, each.reason) for each in told]


LOWER_IS_OUTRANKED = ("lower", "no do: outranked by rule higher (priority 5)")


def test_of_two_that_hold_both_are_set_the_higher_first_and_it_decides():
    world = rivals("a", "b")
    world.run(10.0)
    assert world.asked() == ["set higher", "set lower"]
    assert [request.priority for request in world.requests] == [5, 0]
    assert done(world) == ["higher", "lower"]
    assert world.active == {"higher", "lower"}
    assert world.ran == [OTHER], "the lower one's core never runs"


def test_the_lower_says_once_that_a_higher_one_has_come():
    world = rivals("a")
    world.run(3.0)
    assert outranked(world) == []
    world.quiet = {"a", "b"}
    world.run(10.0)
    assert outranked(world) == [LOWER_IS_OUTRANKED]


def test_from_the_higher_one_s_end_the_lower_one_s_is_in_force_at_once():
    world = rivals("a")
    world.run(3.0)
    assert done(world) == ["lower"]
    world.quiet = {"a", "b"}
    world.run(3.0)
    assert done(world) == ["lower", "higher"]
    assert world.active == {"higher", "lower"}
    world.quiet = {"a"}
    world.run(3.0)
    assert world.asked() == ["set lower", "set higher", "release higher"], "the lower one is active all along"
    assert done(world) == ["lower", "higher", "higher"]
    assert world.components["exploration"].core == LOCAL
    world.quiet = set()
    world.run(3.0)
    assert world.asked()[3:] == ["release lower"]
    assert world.ran == [LOCAL, OTHER, LOCAL, USUAL], "the base did not run between the two"


def test_a_lower_one_that_ends_meanwhile_does_not_undo_what_the_higher_did():
    world = rivals("a")
    world.run(3.0)
    world.quiet = {"a", "b"}
    world.run(3.0)
    world.quiet = {"b"}
    world.run(5.0)
    assert world.asked() == ["set lower", "set higher", "release lower"]
    assert world.active == {"higher"}
    assert world.ran == [LOCAL, OTHER]
    world.quiet = set()
    world.run(3.0)
    assert world.asked()[3:] == ["release higher"]
    assert world.ran == [LOCAL, OTHER, USUAL]


def test_a_higher_one_that_fails_does_not_keep_the_lower_from_acting():
    world = rivals("a", "b")
    world.refusals = [Outcome(code=Code.PREPARE_FAILED, message="no")]
    world.run(3.0)
    assert [request.steps[0].name for request in world.requests] == [OTHER, LOCAL, OTHER]
    assert done(world) == ["lower", "higher"]
    assert world.ran == [LOCAL, OTHER]


def test_rules_of_one_mind_do_not_wait_for_one_another():
    world = started(
        rule("one", when=silence("a")), rule("two", when=silence("b"), target="mapping", priority=3)
    )
    world.quiet = {"a", "b"}
    world.run(3.0)
    assert sorted(done(world)) == ["one", "two"]
