"""`mauve reload`: code that is built again runs in the executor that is running."""

import json
import re
import shlex
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from page_blocks import blocks
from pages import PAGES
from rebuilt_package import ROBOT, RebuiltPackage
from ros_processes import PATIENCE_S

import mauve_rt.trace
from mauve_msgs.msg import Probation, ReconfigurationEvent
from mauve_msgs.srv import ListComponents, LoadRules, Reload
from mauve_rt.cli.main import main

NODE = "/robot_1/executor"


@pytest.fixture
def running(rebuilt: RebuiltPackage, start_executor: Callable[..., Any], tmp_path: Path) -> RebuiltPackage:
    path = tmp_path / "robot.yaml"
    path.write_text(ROBOT, encoding="utf-8")
    start_executor("-p", f"architecture:={path}", "-p", f"bags:={tmp_path}")
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


def _words(page: str, begin: str) -> list[list[str]]:
    """The commands of a page's block, with the names of the package."""
    text = next(block.text for block in blocks(PAGES[page]) if block.text.startswith(begin))
    text = text.replace("\\\n", " ").replace("my_robot/Pid2", "reload_tests/Other")
    text = text.replace("my_robot", "reload_tests").replace("command.linear.x", "sum.data")
    text = text.replace("control", "loop").replace("minimum: -1, maximum: 1}", "minimum: -1, maximum: 1e9}")
    return [shlex.split(line, comments=True)[1:] for line in text.splitlines() if line.strip()]


def _until_verdict(graph: Any, begin: Callable[[], object], verdict: int, reason: str = "") -> Any:
    """Begin probations until one has this verdict: an overrun of a busy computer may revert one before."""
    for _ in range(20):
        begin()
        graph.spin_until(lambda: _loop(graph).probations[-1].verdict != Probation.RUNNING, "a verdict")
        last = _loop(graph).probations[-1]
        if last.verdict == verdict and reason in last.reason:
            return last
        assert last.verdict == Probation.INCONCLUSIVE or "overrun" in last.reason, last
    raise AssertionError(last)


def test_the_commands_of_the_probation_page(
    running: RebuiltPackage, graph: Any, mauve: Callable[..., str], tmp_path: Path
) -> None:
    events = graph.hear(ReconfigurationEvent, f"{NODE}/events")
    page = "docs/howto/try_on_probation.md"
    plain, watched, reload, listed = _words(page, "mauve replace-core")
    plain[-1] = "0.1"
    passed = _until_verdict(graph, lambda: mauve(*plain), Probation.PASSED)
    assert passed.to_core == "reload_tests/Other"
    said = mauve(*listed)
    assert "reload_tests/Other passed its probation" in said
    graph.spin_until(lambda: any("passed after" in event.message for event in events), "the event")
    mauve("replace-core", NODE, "loop", "reload_tests/Loop")
    mauve(*watched)
    assert _loop(graph).probations[-1].to_core == "reload_tests/Other"
    mauve("replace-core", NODE, "loop", "reload_tests/Loop")
    running.build("THROWS", "STEP=2.0")
    _until_verdict(graph, lambda: mauve(*reload), Probation.REVERTED, "the new code is broken")
    graph.spin_until(lambda: _loop(graph).generation == 1, "the way back")
    graph.spin_until(lambda: any(event.request.endswith("back") for event in events), "its event")
    (steps,) = (block.text for block in blocks(PAGES[page]) if block.text.startswith("- kind"))
    path = tmp_path / "steps.yaml"
    text = steps.replace("my_robot/Pid2", "reload_tests/Other").replace("control", "loop")
    path.write_text(text.replace("command.linear.x, maximum: 1}", "sum.data, maximum: 1}"), encoding="utf-8")
    _until_verdict(graph, lambda: mauve("reconfigure", NODE, str(path)), Probation.REVERTED, "above 1")


def test_a_rule_puts_the_old_core_back(
    running: RebuiltPackage, graph: Any, mauve: Callable[..., str], tmp_path: Path
) -> None:
    del running
    rules = tmp_path / "rules.yaml"
    rules.write_text(
        "mauve: 1\nrules:\n"
        "  - name: too_large\n"
        "    when: {value: {resource: sum, field: data, above: 100.0}}\n"
        "    do: [{kind: revert_core, target: loop}]\n",
        encoding="utf-8",
    )

    def begin() -> None:
        mauve("replace-core", NODE, "loop", "reload_tests/Other", "--probation", "60")
        reply = graph.ask(LoadRules, f"{NODE}/load_rules", path=str(rules))
        assert reply.success, reply.message

    _until_verdict(graph, begin, Probation.REVERTED, "a step revert_core")
    assert _loop(graph).core == "reload_tests/Loop"


def test_the_commands_of_the_shadow_page(
    running: RebuiltPackage, graph: Any, mauve: Callable[..., str], tmp_path: Path
) -> None:
    running.build("NEW_CORE")
    with running.index.open("a", encoding="utf-8") as file:
        file.write("core; reload_tests/Louder; reload_tests/LoopShell; reload_tests\n")
    mauve("reload", NODE)
    diagnostics = graph.hear(DiagnosticArray, "/diagnostics")
    mauve("record", "start", NODE, "bag")
    begin, show, promote, end = _words("docs/howto/compare_in_shadow.md", "mauve shadow")
    begin = ["50000" if word == "50" else word for word in begin]
    mauve(*[word.replace("Other", "Louder") for word in begin])
    graph.spin_until(lambda: _loop(graph).shadows[0].compared > 20, "comparisons")
    shown = mauve(*show)
    assert "reload_tests/Louder in parallel with reload_tests/Loop, running" in shown
    assert re.search(r"sum\.data +\d+ +\d", shown), shown

    def told() -> bool:
        statuses = [status for array in diagnostics for status in array.status if "shadow" in status.name]
        keys = {item.key for status in statuses for item in status.values}
        return {"max_difference[sum.data]", "rms_difference[sum.data]", "nan[sum.data]", "lag[sum]"} <= keys

    graph.spin_until(told, "/diagnostics")
    mauve(*end)
    assert "ended" in mauve(*show)
    mauve(*begin)
    graph.spin_until(lambda: _loop(graph).shadows[0].compared > 20, "comparisons")
    compared = _loop(graph).shadows[0].compared
    mauve("record", "stop", NODE)
    mauve(*promote)
    assert _loop(graph).core == "reload_tests/Other"
    mauve("report", str(tmp_path / "bag"))
    assert "a step end_shadow" in (tmp_path / "bag" / "report.html").read_text(encoding="utf-8")
    ended, running_on = mauve_rt.trace.open(tmp_path / "bag").shadows
    assert (ended.core, ended.verdict, running_on.verdict) == ("reload_tests/Louder", "ended", "running")
    assert running_on.compared >= compared, "the figures as the bag was closed"
