"""What the demo tells while it runs."""

from typing import Any

import numpy as np
from rich.style import Style

from mauve_examples.mission.demo_story import MissionStory
from mauve_examples.mission.plan import SHARED, UNKNOWN, WALL, Plan, colour
from mauve_msgs.msg import ReconfigurationEvent, StepReport, SupervisorDecision
from mauve_rt.supervision.remote_rules import LEFT_TO_EXECUTOR


def _step(component: str, **fields: Any) -> Any:
    return StepReport(component=component, blackout_ns=5_000, **fields)


def test_a_transaction_s_core_is_told_of_the_component_that_has_it():
    story = MissionStory(["robot_1"], clock=lambda: 1.0)
    report = [
        _step("exploration", from_core="p/A", to_core="p/B"),
        _step("guidance"),
        _step("mapping", from_core="p/C", to_core="p/D", missed_releases=StepReport.NOT_MEASURED),
    ]
    story.on_event("robot_1", ReconfigurationEvent(success=True, report=report))
    told = [(swap.component, swap.from_core, swap.to_core) for swap in story.robots["robot_1"].swaps]
    assert told == [("exploration", "A", "B"), ("mapping", "C", "D")]
    assert story.lines(to_the_end=True) == [
        "   1.0 s  robot_1: exploration: A -> B, blackout 5 us, no release missed",
        "   1.0 s  robot_1: mapping: C -> D, blackout 5 us",
    ]


def test_a_fallback_core_is_told():
    story = MissionStory(["robot_1"], clock=lambda: 1.0)
    none = StepReport.NOT_MEASURED
    fell_back = StepReport(component="exploration", from_core="p/A", to_core="p/B", blackout_ns=none)
    event = ReconfigurationEvent(success=True, requested_by="kernel", from_core="p/A", to_core="p/B")
    event.report = [fell_back]
    story.on_event("robot_1", event)
    assert [(swap.component, swap.to_core) for swap in story.robots["robot_1"].swaps] == [
        ("exploration", "B")
    ]


def test_a_cause_that_is_told_late_comes_before_its_effect():
    now = 20.6
    story = MissionStory(["robot_1"], clock=lambda: now, age_s=lambda stamp: now - stamp.sec)
    step = _step("exploration", from_core="p/A", to_core="p/B")
    event = ReconfigurationEvent(success=True, report=[step], requested_by="/robot_1/executor")
    story.on_event("robot_1", event)
    assert story.lines() == [], "something earlier may still come"
    now = 21.1
    reason = "nothing on /in for 1.00 s"
    decision = SupervisorDecision(rule="link_lost", decision="condition_true", reason=reason)
    decision.stamp.sec = 20
    story.on_decision("robot_1", decision)
    now = 22.0
    assert story.lines() == [
        "  20.0 s  robot_1: link_lost: nothing on /in for 1.00 s",
        "  20.6 s  robot_1: exploration: A -> B, blackout 5 us, no release missed",
    ]


def test_what_is_nothing_to_those_who_look_is_left_out():
    story = MissionStory(["robot_1"], clock=lambda: 1.0)
    story.on_event("robot_1", ReconfigurationEvent(success=True, request="replace_core a p/B (dry run)"))
    left = SupervisorDecision(rule="link_lost", decision="suppressed", reason=LEFT_TO_EXECUTOR)
    story.on_decision("robot_1", left)
    assert story.lines(to_the_end=True) == []
    story.on_event("robot_1", ReconfigurationEvent(success=False, request="a (dry run)", message="no"))
    assert story.lines(to_the_end=True) == ["   1.0 s  robot_1: refused: a (dry run): no"]


def test_each_robot_s_knowledge_is_in_its_colour():
    cells = np.zeros((4, 6), np.int8)
    cells[0] = 1  # of a map in mode scale: not free, so robots keep away from there
    known = {name: np.zeros((4, 6), np.bool_) for name in ("one", "two")}
    known["one"][:, :3] = True
    known["two"][:, 2:4] = True
    lines = Plan(cells, known).drawn().split("\n")
    assert [line.plain for line in lines][:2] == ["\N{UPPER HALF BLOCK}" * 6] * 2
    styles = [span.style for span in lines[1].spans if isinstance(span.style, Style)]
    below = [style.bgcolor.name for style in styles if style.bgcolor]
    assert below == [WALL, WALL, WALL, WALL, UNKNOWN, UNKNOWN], "the row of the lowest y, where all is wall"
    above = [style.color.name for style in styles if style.color]
    assert above == [colour(0), colour(0), SHARED, colour(1), UNKNOWN, UNKNOWN]


def test_a_large_map_is_drawn_small():
    cells = np.zeros((999, 2000), np.int8)
    lines = Plan(cells, {"one": np.ones((999, 2000), np.bool_)}).drawn().plain.splitlines()
    assert len(lines) <= 14
    assert max(map(len, lines)) <= 72
