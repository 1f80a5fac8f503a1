"""`mauve reload`: code that is built again runs in the executor that is running."""

import json
import re
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from page_blocks import blocks
from pages import PAGES
from rebuilt_package import RebuiltPackage
from ros_processes import PATIENCE_S

from mauve_msgs.msg import ReconfigurationEvent
from mauve_msgs.srv import ListComponents, Reload
from mauve_rt.cli.main import main

NODE = "/robot_1/executor"
ROBOT = """\
mauve: 1
executor: {namespace: /robot_1}
components:
  loop: {shell: reload_tests/LoopShell, core: reload_tests/Loop, fsm: reload_tests/LoopFsm,
         alternatives: installed}
resources:
  sum: {kind: shared_data, type: std_msgs/msg/Float64, topic: {name: sum, direction: publish}}
connections:
  - [loop.sum, sum.write]
"""


@pytest.fixture
def running(rebuilt: RebuiltPackage, start_executor: Callable[..., Any], tmp_path: Path) -> RebuiltPackage:
    path = tmp_path / "robot.yaml"
    path.write_text(ROBOT, encoding="utf-8")
    start_executor("-p", f"architecture:={path}")
    return rebuilt


@pytest.fixture
def mauve(
    domain: int, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> Callable[..., str]:
    monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))

    def run(*words: str) -> str:
        assert main(list(words)) == 0, capsys.readouterr().err
        return capsys.readouterr().out

    return run


def _loop(graph: Any) -> Any:
    (loop,) = graph.ask(ListComponents, f"{NODE}/list_components").components
    return loop


def test_the_commands_of_the_page(running: RebuiltPackage, graph: Any, mauve: Callable[..., str]) -> None:
    page = next(blocks(PAGES["docs/howto/reload_code.md"])).text
    commands = [line.partition("#")[0].split()[1:] for line in page.splitlines() if line.strip()]
    everything, package, listed, back = [
        [word.replace("my_robot", "reload_tests") for word in command] for command in commands
    ]
    assert "nothing has changed" in mauve(*everything)
    before = _loop(graph)
    assert (before.generation, before.built_ns) == (1, running.library.stat().st_mtime_ns)
    running.build("STEP=2.0")
    said = mauve(*everything)
    assert str(running.library) in said
    assert re.search(r"replace_core reload_tests/Loop: .*took over sum, rounds", said), said
    assert re.search(r"generation +built", mauve(*listed))
    first = _loop(graph)
    assert first.generation > 1
    assert first.built_ns == running.library.stat().st_mtime_ns > before.built_ns
    running.build("STEP=3.0")
    mauve(*package)
    assert _loop(graph).generation > first.generation
    mauve(*back)
    assert _loop(graph).generation == first.generation
    assert _loop(graph).overruns == 0 or _loop(graph).releases > before.releases


def test_a_refusal_is_told_by_event_and_status(
    running: RebuiltPackage, graph: Any, capsys: pytest.CaptureFixture[str], mauve: Callable[..., str]
) -> None:
    del mauve  # its domain
    heard = graph.hear(ReconfigurationEvent, f"{NODE}/events") if hasattr(graph, "hear") else None
    running.build("CRASH")
    assert main(["reload", NODE]) != 0
    assert "crashed (SIGABRT" in capsys.readouterr().err
    reply = graph.ask(Reload, f"{NODE}/reload", request_id="one", requested_by="test")
    assert not reply.success
    again = graph.ask(Reload, f"{NODE}/reload", request_id="one", requested_by="test")
    assert again.message == reply.message, "a repeated request gets its outcome"
    assert _loop(graph).generation == 1
    if heard is not None:
        graph.spin_until(lambda: any(not event.success for event in heard), "the event")


def test_a_core_that_is_new_in_the_package(
    running: RebuiltPackage, graph: Any, mauve: Callable[..., str]
) -> None:
    running.build("NEW_CORE")
    with running.index.open("a", encoding="utf-8") as file:
        file.write("core; reload_tests/New; reload_tests/LoopShell; reload_tests\n")
    mauve("reload", NODE)
    deadline = time.monotonic() + PATIENCE_S
    while "reload_tests/New" not in _loop(graph).alternatives and time.monotonic() < deadline:
        time.sleep(0.1)
    mauve("replace-core", NODE, "loop", "reload_tests/New")
    listed = json.loads(mauve("list", NODE, "--json"))
    assert listed["components"][0]["core"] == "reload_tests/New"
