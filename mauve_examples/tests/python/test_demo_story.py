"""What the demo tells while it runs."""

from typing import Any

from mauve_examples.mission.demo_story import MissionStory
from mauve_msgs.msg import ReconfigurationEvent, StepReport


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
    lines = [text for _, text in story.events]
    assert lines == [
        "robot_1: exploration: A -> B, blackout 5 us, no release missed",
        "robot_1: mapping: C -> D, blackout 5 us, releases missed not measured",
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
