"""Events are told in the order in which they were decided, when all of them is known."""

import threading
from dataclasses import replace
from typing import Any

import pytest

from mauve_rt.control.requests import Code, Outcome, Request
from mauve_rt.node.executor.events import MOST_WAITING, Event, Events
from mauve_rt.node.shared.watch import Watch

PATIENCE_S = 100.0


class Release:
    """A release that is still to come."""

    def __init__(self) -> None:
        self.came = threading.Event()
        self.asked = threading.Event()

    def look(self, outcome: Outcome, *, wait_ns: int) -> Outcome:
        self.asked.set()
        if not self.came.wait(wait_ns / 1e9):
            return outcome
        return replace(outcome, message="all is known", pending=None)


class Ear:
    """What was told, and how many it was waited for."""

    def __init__(self) -> None:
        self.heard: list[Event] = []
        self._changed = threading.Condition()

    def __call__(self, event: Event) -> None:
        with self._changed:
            self.heard.append(event)
            self._changed.notify_all()

    def messages(self, count: int) -> list[str]:
        with self._changed:
            assert self._changed.wait_for(lambda: len(self.heard) >= count, PATIENCE_S)
            return [event.outcome.message for event in self.heard]


def event(message: str, pending: Any = None) -> Event:
    return Event(Request(), Outcome(code=Code.OK, message=message, pending=pending), None)


@pytest.fixture
def ear() -> Ear:
    return Ear()


def test_an_event_waits_for_what_it_lacks_and_the_next_one_for_it(ear: Ear) -> None:
    events, release = Events(ear, Watch(pytest.fail)), Release()
    for each in (event("of a change", release), event("of a stop")):
        events.add(each)
        events.tell(each)
    assert release.asked.wait(PATIENCE_S)
    assert ear.heard == []
    release.came.set()
    assert ear.messages(2) == ["all is known", "of a stop"]
    assert ear.heard[0].outcome.pending is None
    events.close()


def test_the_one_who_asked_comes_first(ear: Ear) -> None:
    events = Events(ear, Watch(pytest.fail))
    first, second = event("first"), event("second")
    events.add(first)
    events.add(second)
    events.tell(second)
    events.tell(first)
    assert ear.messages(2) == ["first", "second"]
    events.close()


def test_at_the_end_all_are_told_with_what_is_known(ear: Ear) -> None:
    events, release = Events(ear, Watch(pytest.fail)), Release()
    events.add(event("of a change", release))  # who asked has no answer, nor has the release come
    events.close()
    assert ear.messages(1) == ["of a change"]
    assert ear.heard[0].outcome.pending is None


def test_an_event_that_cannot_be_told_keeps_no_other_one_back(ear: Ear) -> None:
    complaints: list[str] = []

    def tell(told: Event) -> None:
        if told.outcome.message == "bad":
            raise ValueError("not that one")
        ear(told)

    events = Events(tell, Watch(complaints.append))
    for each in (event("bad"), event("good")):
        events.add(each)
        events.tell(each)
    assert ear.messages(1) == ["good"]
    assert complaints[0].startswith("thread 'events' failed and goes on: ValueError: not that one")
    events.close()


def test_too_many_events_are_left_out_and_counted(ear: Ear) -> None:
    logged: list[str] = []
    events, release = Events(ear, Watch(logged.append)), Release()
    slow = event("of a change", release)
    events.add(slow)
    events.tell(slow)
    assert release.asked.wait(PATIENCE_S)
    for number in range(MOST_WAITING + 4):
        each = event(str(number))
        events.add(each)
        events.tell(each)
    release.came.set()
    events.close()
    assert ear.messages(MOST_WAITING)[-1] == str(MOST_WAITING - 2)
    assert logged == ["5 events were left out: they came faster than they can be reported"]
