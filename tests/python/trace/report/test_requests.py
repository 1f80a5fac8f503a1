"""Whose event tells of which reconfiguration."""

from types import SimpleNamespace
from typing import Any

from mauve_rt.trace.reading.facts import Message
from mauve_rt.trace.reading.reconfigurations import Reconfiguration
from mauve_rt.trace.report.requests import join_requests
from mauve_rt.trace.report.timeline import swap_title

MS = 1_000_000


def swap(component: str, parked_ns: int, blackout_ns: int) -> Reconfiguration:
    return Reconfiguration(
        component=component,
        what="",
        committed=True,
        parked_ns=parked_ns,
        armed_ns=parked_ns + blackout_ns,
        pending_ns=0,
        adopt_ns=0,
        take_ns=0,
        nominal_ns=None,
        actual_ns=None,
        missed_releases=None,
        phase_nominal_ns=None,
        phase_actual_ns=None,
        complete=True,
    )


def step(component: str, text: str, blackout_ns: int, cores: tuple[str, str] = ("", "")) -> Any:
    return SimpleNamespace(
        step=text,
        component=component,
        prepare_ns=2,
        blackout_ns=blackout_ns,
        from_core=cores[0],
        to_core=cores[1],
    )


def event(time_ns: int, *steps: Any) -> Message:
    told = SimpleNamespace(success=True, requested_by="me", cause="", report=list(steps))
    return Message("/robot/executor/events", 0, time_ns, told)


def test_a_transaction_s_event_tells_each_component_of_its_own_steps():
    told = event(
        20 * MS,
        step("a", "replace_core p/B", 7, ("p/A", "p/B")),
        step("a", "set_property gain 2", 7),
        step("b", "set_property gain 3", 8),
        step("c", "replace_core p/D", 9, ("p/C", "p/D")),
    )
    measured = [swap("a", 10 * MS, 7), swap("b", 10 * MS, 8), swap("c", 10 * MS, 9)]
    found = [request for request in join_requests(measured, [told]) if request is not None]
    assert [(one.from_core, one.to_core, one.steps) for one in found] == [
        ("p/A", "p/B", "replace_core p/B, set_property gain 2"),
        ("", "", "set_property gain 3"),
        ("p/C", "p/D", "replace_core p/D"),
    ]
    assert [one.prepare_ns for one in found] == [4, 2, 2]


def test_an_event_that_waited_for_a_release_is_not_taken_for_the_next_one():
    measured = [swap("a", 10 * MS, 7), swap("a", 11 * MS, 8)]
    events = [
        event(15 * MS, step("a", "replace_core p/B", 7, ("p/A", "p/B"))),
        event(16 * MS, step("a", "replace_core p/A", 8, ("p/B", "p/A"))),
    ]
    assert [one and one.to_core for one in join_requests(measured, events)] == ["p/B", "p/A"]


def test_the_title_of_a_change_names_all_of_it():
    what = "set_property gain, replace_core p/B"
    assert swap_title(what) == "set_property gain, replace_core B"
    assert swap_title(what, "p/B") == "B"
    assert swap_title("") == "reconfigured"
