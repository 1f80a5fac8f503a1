"""The lines of an executor: written without a search for their caller, with the caller's place."""

import gc
import inspect
import weakref
from pathlib import Path
from typing import Any

import pytest
from rclpy.impl.implementation_singleton import rclpy_implementation

from mauve_rt.node.executor.console import Console


def test_a_line_names_its_caller_without_a_search(monkeypatch: pytest.MonkeyPatch) -> None:
    lines: list[tuple[Any, ...]] = []

    def search(*_: object) -> None:
        raise AssertionError("a line searched for its caller")

    monkeypatch.setattr(rclpy_implementation, "rclpy_logging_rcutils_log", lambda *line: lines.append(line))
    monkeypatch.setattr(inspect, "getframeinfo", search)
    console = Console("robot_1.executor")
    for say in (console.info, console.error):  # rclpy's own refuses a second severity from one line
        say("something happened")
    here = "test_a_line_names_its_caller_without_a_search"
    told = [
        (int(severity), name, text, function, Path(file).name)
        for severity, name, text, function, file, _ in lines
    ]
    assert told == [
        (severity, "robot_1.executor", "something happened", here, "test_console.py") for severity in (20, 40)
    ]


def test_a_line_below_the_level_is_not_written(monkeypatch: pytest.MonkeyPatch) -> None:
    lines: list[tuple[Any, ...]] = []
    monkeypatch.setattr(rclpy_implementation, "rclpy_logging_rcutils_log", lambda *line: lines.append(line))
    assert not Console("robot_1.executor").debug("a detail")
    assert lines == []


def test_a_line_keeps_nothing_of_its_caller(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rclpy_implementation, "rclpy_logging_rcutils_log", lambda *_: None)

    class Request:
        """Something large."""

    def write(request: Request) -> None:
        Console("robot_1.executor").info("something happened")

    gc.disable()  # which would find a cycle some time later
    try:
        request = Request()
        seen = weakref.ref(request)
        write(request)
        del request
        assert seen() is None
    finally:
        gc.enable()
