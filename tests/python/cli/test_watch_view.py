"""What `mauve watch` shows of what it knows, on a terminal of 80 columns."""

import io
from collections import deque
from types import SimpleNamespace
from typing import Any

import pytest
from rich.console import Console

from mauve_msgs.msg import BoundViolation, ComponentInfo, JobBound, PortInfo, ReconfigurationEvent, RuleInfo
from mauve_msgs.srv import ListComponents
from mauve_rt.cli.watch_verb import press
from mauve_rt.cli.watch_view import SORTED_BY, Selection, sparkline, view
from mauve_rt.cli.watched import Figures, Followed

EXECUTOR = "/robot_1/executor"


class Known(SimpleNamespace):
    """As WatchedExecutor."""

    def open(self, component: str) -> None:
        self.opened = component


def known(**others: Any) -> Known:
    components = [
        ComponentInfo(name="guidance", core="p/Fast", state=ComponentInfo.RUNNING, overruns=3),
        ComponentInfo(name="control", core="p/Pid", state=ComponentInfo.FAULTED, fault="cable [on] fire"),
    ]
    figures = {
        "guidance": Figures(rate_hz=99.9, wakeup_ns=34_000, response_ns=120_000, execution_ns=80_000),
        "control": Figures(wakeup_ns=50_000, remark="overruns 2"),
    }
    facts = {
        "name": EXECUTOR,
        "listed": ListComponents.Response(components=components, revision=7),
        "rules": (),
        "figures": figures,
        "values": {},
        "last_event": None,
        "last_violation": None,
        "is_there": True,
        "opened": "",
    }
    return Known(**{**facts, **others})


def shown(*executors: Known, selection: Selection | None = None) -> list[str]:
    out = io.StringIO()
    console = Console(file=out, width=80, highlight=False)
    console.print(view(executors, selection or Selection()))
    lines = [line.rstrip() for line in out.getvalue().splitlines() if line.strip()]
    assert max(map(len, lines)) <= 80
    return lines


def names(lines: list[str]) -> list[str]:
    """In the order of the lines."""
    return [line.split()[0] for line in lines if line.split()[0] in ("guidance", "control")]


def test_a_line_for_each_component() -> None:
    lines = shown(known())
    assert lines[0].split() == [EXECUTOR, "revision", "7", "real", "time"]
    guidance = next(line for line in lines if "guidance" in line)
    assert guidance.split() == [
        *("guidance", "Fast", "RUNNING", "100", "34", "us", "120", "us", "80", "us", "3")
    ]
    assert any("cable [on] fire" in line for line in lines)


def test_ten_executors_are_told_apart() -> None:
    several = [known(name=f"/robot_{number}/executor") for number in range(10)]
    lines = shown(*several)
    assert [line.split()[:2] for line in lines if "Fast" in line] == [
        [f"/robot_{number}", "guidance"] for number in range(10)
    ]


def test_rules_and_values_of_several_tell_whose_they_are() -> None:
    rule = RuleInfo(name="lost", armed=True)
    values = {"pose": Followed(text="x 1", writes=1)}
    event = ReconfigurationEvent(request="stop control", success=True)
    facts = {"rules": [rule], "values": values, "last_event": event}
    lines = shown(known(**facts), known(name="/robot_2/executor", **facts))
    for whose in ("/robot_1", "/robot_2"):
        assert any(line.startswith(f"rule {whose} lost") for line in lines)
        assert any(line.split()[:2] == [whose, "pose"] for line in lines)
        assert any("last change" in line and f"{whose} stop control" in line for line in lines)


def test_rules_values_and_the_last_change() -> None:
    rule = RuleInfo(name="lost", armed=True, holds=True, known=True, next="do", next_in_s=0.8, since_s=2.0)
    unknown = RuleInfo(name="stop", armed=True, since_s=2.0)
    other = RuleInfo(name="idle")
    values = {"pose:x": Followed(text="x 1.5", age_ns=2_000_000, writes=4, numbers=deque([1.0, 2.0, 0.0]))}
    event = ReconfigurationEvent(request="replace_core guidance", requested_by="mauve", success=True)
    text = "\n".join(shown(known(rules=[rule, unknown, other], values=values, last_event=event)))
    assert "rule lost  true for 2 s, do in 0.8 s" in text
    assert "rule stop  unknown for 2 s" in text
    assert "rule idle  not armed" in text
    assert [*next(line for line in text.splitlines() if "pose:x" in line).split()] == [
        *("pose:x", "x", "1.5", "▅█▁", "2", "ms")
    ]
    assert "replace_core guidance by mauve: done" in text


def test_an_executor_that_does_not_answer_keeps_its_last_values() -> None:
    lines = shown(known(is_there=False), known(name="/new/executor", listed=None))
    assert "does not answer" in lines[0]
    assert "/new/executor  no answer yet" in lines[1]
    assert names(lines)[:2] == ["guidance", "control"] or "guidance" in "".join(lines)


def test_keys_sort_and_filter() -> None:
    executor, selection = known(), Selection()
    assert names(shown(executor, selection=selection))[:2] == ["guidance", "control"]
    orders = {}
    for _ in SORTED_BY:
        orders[selection.sorted_by] = names(shown(executor, selection=selection))[0]
        assert press("s", selection, [executor])
    assert selection.sorted_by == "file", "round"
    assert orders["wake-up"] == "control"
    assert orders["response"] == "guidance"
    assert orders["state"] == "control"
    for key in ("/", "c", "o", "x", "\x7f", "enter"):
        assert press(key, selection, [executor])
    assert selection.filter == "co"
    assert set(names(shown(executor, selection=selection))) == {"control"}
    assert press("escape", selection, [executor])
    assert selection.filter == ""


def test_keys_open_a_component() -> None:
    port = PortInfo(name="goal", kind=PortInfo.READ, resource="goal", service="read")
    components = [
        ComponentInfo(name="control", core="p/Pid", properties=["gain=2"], ports=[port]),
        ComponentInfo(name="guidance", core="p/Fast"),
    ]
    values = {"control.goal": Followed(text="x 4", writes=1, numbers=deque([4.0]))}
    executor = known(listed=ListComponents.Response(components=components), values=values)
    selection = Selection()
    for key in ("down", "down", "up", "up", "up"):
        press(key, selection, [executor])
        shown(executor, selection=selection)
    press("enter", selection, [executor])
    assert executor.opened == "control"
    text = "\n".join(shown(executor, selection=selection))
    assert "goal.read" in text
    assert "x 4" in text
    assert [line.split() for line in text.splitlines() if "gain" in line] == [["gain", "2"]]
    press("escape", selection, [executor])
    assert (selection.opened, executor.opened) == (None, "")
    assert not press("q", selection, [executor])


@pytest.mark.parametrize(
    ("numbers", "bars"),
    [([], ""), ([1.0, 1.0], "▁▁"), ([0.0, 7.0], "▁█"), ([0.0, float("nan"), 1.0], "▁ █")],
)
def test_sparklines(numbers: list[float], bars: str) -> None:
    assert sparkline(numbers) == bars


def test_the_last_job_above_its_bound() -> None:
    lines = shown(known(last_violation=BoundViolation(message="component 'control': too long")))
    assert any(line.startswith("above its bound") and "component 'control'" in line for line in lines)


def test_an_opened_component_shows_its_bounds() -> None:
    bound = JobBound(after="Pause", states=["Act"], until="Pause", bound_ns=3_000_000, longest_ns=2_000_000)
    executor = known()
    executor.listed.components[0].bounds = [bound]
    text = "\n".join(shown(executor, selection=Selection(opened=(EXECUTOR, "guidance"))))
    assert "Pause -> Act -> Pause" in text
