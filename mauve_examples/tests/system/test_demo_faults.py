"""Missions that end badly: interrupted, killed, without rights, beside another one."""

import json
import os
import shutil
import signal
import time
from pathlib import Path

import pytest
from bag_reading import topics
from demo_harness import DOMAIN, PATIENCE_S, Demo, Starter

SHORT = ("--duration", "25", "--link-loss-at", "4", "--link-back-at", "12")


def bags(demo: Demo) -> list[Path]:
    """Every bag there is; each must open."""
    found = sorted(path for path in (demo.out / "bag").glob("*") if path.is_dir())
    for bag in found:
        topics(bag)
    return found


@pytest.mark.parametrize("after_s", [0.05, 0.3, 0.6, 1.0, 1.5, 2.0, 2.5, 3.0])
def test_ctrl_c_while_it_starts(start: Starter, after_s: float):
    demo = start(*SHORT)
    time.sleep(after_s)
    begun = demo.handles_signals()  # else the interpreter itself is still loading
    status = demo.interrupt() if begun else demo.interrupt_until_heard()
    assert status in (130, 1, -signal.SIGINT)
    assert not begun or "Traceback" not in demo.errors
    assert demo.processes() == {}
    bags(demo)


@pytest.mark.parametrize(
    "words", ["All have met", "link up", "link is LOST", "LocalExploration, blackout", "is back"]
)
def test_ctrl_c_while_it_runs(start: Starter, words: str):
    demo = start(*SHORT)
    demo.wait_for(words)
    assert demo.interrupt() == 130
    assert demo.processes() == {}
    assert "Traceback" not in demo.errors
    assert bags(demo)


def test_ctrl_c_leaves_results(start: Starter):
    demo = start(*SHORT)
    demo.wait_for("LocalExploration, blackout")
    demo.interrupt()
    summary = json.loads((demo.out / "summary.json").read_text(encoding="utf-8"))
    assert summary["success"] is False
    assert any("interrupted" in reason for reason in summary["reasons"])
    assert len(bags(demo)) == 2


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_other_ways_to_be_told_to_end(start: Starter, number: signal.Signals):
    demo = start(*SHORT)
    demo.wait_for("link up")
    demo.process.send_signal(number)
    assert demo.finish() == 130
    assert demo.processes() == {}


def test_a_killed_executor_leaves_a_bag_that_opens(start: Starter):
    demo = start(*SHORT)
    demo.wait_for("4.")
    architecture = demo.out / "architecture" / "robot_1.yaml"
    os.kill(demo.pid_of(f"node.executor.main --ros-args -p architecture:={architecture}"), signal.SIGKILL)
    assert demo.finish() == 1
    text = "\n".join(demo.lines)
    assert "robot_1_executor ended (SIGKILL)" in text
    assert demo.processes() == {}
    assert [bag.name for bag in bags(demo)] == ["robot_1", "robot_2"]
    counts = topics(demo.out / "bag" / "robot_1")
    assert counts["/robot_1/pose"] > 0
    summary = json.loads((demo.out / "summary.json").read_text(encoding="utf-8"))
    assert any("SIGKILL" in reason for reason in summary["reasons"])


def test_a_killed_demo_takes_its_processes_along(start: Starter):
    demo = start(*SHORT)
    demo.wait_for("link up")
    demo.process.kill()
    demo.process.wait()
    deadline_s = time.monotonic() + PATIENCE_S
    while demo.processes() and time.monotonic() < deadline_s:
        time.sleep(0.1)
    assert demo.processes() == {}
    assert len(bags(demo)) == 2


def test_a_second_mission_on_the_same_domain_is_refused(start: Starter):
    first = start(*SHORT)
    first.wait_for("link up")
    second = start(*SHORT, out=start.folder / "second")
    assert second.finish() == 2
    assert "another mission is running" in second.errors
    assert f"domain {DOMAIN}" in second.errors
    assert second.errors.count("\n") == 1
    assert not second.out.exists()
    assert first.interrupt() == 130


def test_without_privileges_it_runs_and_says_what_is_missing(start: Starter):
    prefix: tuple[str, ...] = ()
    if os.geteuid() == 0:
        if shutil.which("setpriv") is None:
            pytest.skip("setpriv (util-linux) is not installed: root cannot give its privileges away")
        prefix = ("setpriv", "--bounding-set=-all", "--inh-caps=-all")
    # Lost late: without rights a robot may start seconds after the other, which then thinks itself alone.
    demo = start("--duration", "34", "--link-loss-at", "12", "--link-back-at", "20", prefix=prefix)
    status = demo.finish()
    summary = json.loads((demo.out / "summary.json").read_text(encoding="utf-8"))
    if summary["realtime"]["granted"]:
        pytest.skip("this user has real-time rights (rtprio and memlock limits)")
    assert status == 0, "\n".join(demo.lines[-10:])
    missing = summary["realtime"]["missing"]
    assert any("rtprio" in line for line in missing)
    text = "\n".join(demo.lines)
    assert "Real time was not granted" in text
    assert all(line in text for line in missing)
    for robot in summary["robots"].values():
        assert {component["policy"] for component in robot["components"].values()} == {"SCHED_OTHER"}
