"""Threads and callbacks of a node that do not end in silence."""

import threading
from collections.abc import Callable
from typing import Any

import pytest

from mauve_rt.errors import exception_text
from mauve_rt.node.shared import watch as watch_module
from mauve_rt.node.shared.watch import Watch

PATIENCE_S = 100.0


class _NoText(Exception):  # noqa: N818 - not an error of ours
    def __str__(self) -> str:
        raise SystemExit


@pytest.fixture
def told() -> list[str]:
    return []


@pytest.fixture(autouse=True)
def no_pause(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(watch_module, "_PAUSE_S", 0.0)


def run(watch: Watch, step: Callable[[], None], ending: threading.Event) -> None:
    thread = watch.thread("worker", step, ending=ending)
    thread.start()
    thread.join(PATIENCE_S)
    assert not thread.is_alive()


@pytest.mark.parametrize("raised", [ValueError("bad"), SystemExit(3), KeyboardInterrupt(), _NoText()])
def test_a_thread_goes_on_with_the_next_item(told: list[str], raised: BaseException) -> None:
    ending, steps = threading.Event(), []

    def step() -> None:
        steps.append(len(steps))
        if len(steps) == 5:
            ending.set()
        elif len(steps) < 4:
            raise raised

    watch = Watch(told.append)
    run(watch, step, ending)
    assert len(steps) == 5
    assert not watch.broken.is_set()
    (line,) = told  # the same again is told a minute later
    assert line.startswith(f"thread 'worker' failed and goes on: {exception_text(raised)}\n")
    assert "in step" in line


def test_a_thread_that_cannot_go_on_ends_the_process(told: list[str]) -> None:
    def step() -> None:
        raise OSError("gone")

    watch = Watch(told.append)
    run(watch, step, threading.Event())
    assert watch.broken.is_set()
    assert told[-1] == "thread 'worker' failed 100 times in a row: the executor ends"


def test_a_guarded_callback_never_raises(told: list[str]) -> None:
    def callback(request: str, response: list[int]) -> list[int]:
        raise SystemExit(request)

    def otherwise(request: str, response: list[int], error: BaseException) -> tuple[Any, ...]:
        return (request, response, str(error))

    watch = Watch(told.append)
    assert watch.guarded("it", callback, otherwise=otherwise)("no", [1]) == ("no", [1], "no")
    assert watch.guarded("it", callback)("no", [1]) is None
    assert len(told) == 1


def test_a_log_that_fails_ends_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    def log(text: str) -> None:
        raise RuntimeError(f"no log for {len(text)} characters")

    Watch(log).tell("it", ValueError("bad"))
    assert "no log for" in capsys.readouterr().err


def test_the_text_of_what_was_raised() -> None:
    assert exception_text(ValueError("two\n lines")) == "ValueError: two lines"
    assert exception_text(ValueError("\udcff")) == "ValueError: \\udcff"
    assert exception_text(_NoText()) == "_NoText: its text cannot be had (SystemExit)"
