"""The parts of the demo that need no mission."""

import io
import signal
import time
from pathlib import Path
from typing import Any

import pytest

from mauve_examples.mission.demo_ending import ending
from mauve_examples.mission.demo_errors import BadInputError
from mauve_examples.mission.demo_lock import MissionLock
from mauve_examples.mission.demo_options import parse_options
from mauve_examples.mission.processes import Processes
from mauve_examples.mission.progress import (
    LiveProgress,
    MissionPicture,
    PlainProgress,
    RobotPicture,
    open_progress,
)

STUBBORN = """\
import signal, time
signal.signal(signal.SIGINT, signal.SIG_IGN)
print("ready", flush=True)
time.sleep(60)
"""
WILLING = "print('ready', flush=True)\nimport time\ntime.sleep(60)\n"


@pytest.fixture
def modules(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder whose Python files can be started as modules."""
    monkeypatch.setenv("PYTHONPATH", str(tmp_path), prepend=":")
    return tmp_path


def wait_for(log: Path, word: str) -> None:
    deadline_s = time.monotonic() + 20.0
    while word not in (log.read_text(encoding="utf-8") if log.exists() else ""):
        assert time.monotonic() < deadline_s
        time.sleep(0.02)


def test_a_process_that_ignores_the_interrupt_is_killed_and_named(modules: Path):
    (modules / "stubborn.py").write_text(STUBBORN, encoding="utf-8")
    (modules / "willing.py").write_text(WILLING, encoding="utf-8")
    processes = Processes(modules / "log")
    for name in ("stubborn", "willing"):
        processes.start(name, name)
        wait_for(modules / "log" / f"{name}.log", "ready")
    assert processes.ended() is None
    assert processes.stop(lambda: 0.0 if processes.ended() else 60.0) == ["stubborn"]
    assert processes.stop(lambda: 1.0) == []


def test_a_process_hears_the_interrupt_though_who_started_it_ignores_it(
    modules: Path, request: pytest.FixtureRequest
):
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)  # as in a shell's background job
    request.addfinalizer(lambda: signal.signal(signal.SIGINT, before))
    (modules / "willing.py").write_text(WILLING, encoding="utf-8")
    processes = Processes(modules / "log")
    processes.start("willing", "willing")
    wait_for(modules / "log" / "willing.log", "ready")
    assert processes.stop(lambda: 50.0) == []


def test_a_process_that_ends_is_told_with_its_last_words(modules: Path):
    (modules / "brief.py").write_text(
        "import sys\nprint('no such thing', flush=True)\nsys.exit(3)\n", encoding="utf-8"
    )
    processes = Processes(modules / "log")
    processes.start("brief", "brief")
    deadline_s = time.monotonic() + 20.0
    while (ended := processes.ended()) is None:
        assert time.monotonic() < deadline_s
    assert ended.describe() == "brief ended (exit status 3): no such thing"
    processes.stop(lambda: 1.0)


def test_one_mission_at_a_time_on_a_domain(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", "101")
    lock = MissionLock()
    with pytest.raises(BadInputError, match=r"another mission is running \(ROS domain 101\)"):
        MissionLock()
    monkeypatch.setenv("ROS_DOMAIN_ID", "102")
    MissionLock().release()
    lock.release()
    monkeypatch.setenv("ROS_DOMAIN_ID", "101")
    MissionLock().release()


def picture(time_s: float, *events: str, link_up: bool = True) -> MissionPicture:
    robots = [RobotPicture("robot_1", 0.25, "Exploration"), RobotPicture("robot_2", 0.5, "", "done")]
    return MissionPicture(time_s, 90.0, link_up, robots, 0.625, list(events))


def test_plain_progress_tells_events_once_and_everybody_every_five_seconds():
    stream = io.StringIO()
    with open_progress(stream) as progress:
        assert isinstance(progress, PlainProgress)
        progress.show(picture(0.5))
        progress.show(picture(1.0, "one"))
        progress.show(picture(5.5, "one", "two", link_up=False))
        progress.show(picture(6.0, "one", "two"))
    assert stream.getvalue().splitlines() == [
        "   0.5 s  link up   | robot_1  25% Exploration | robot_2  50% - (done) | together  62%",
        "one",
        "two",
        "   5.5 s  link DOWN | robot_1  25% Exploration | robot_2  50% - (done) | together  62%",
    ]


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_live_progress_shows_the_same_on_a_terminal(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("TERM", "xterm")
    stream = Terminal()
    with open_progress(stream) as progress:
        assert isinstance(progress, LiveProgress)
        progress.show(picture(1.0, "one [not markup]"))
        progress.show(picture(2.0, "one [not markup]", "two"))
    text = stream.getvalue()
    assert text.count("one [not markup]") == 1
    for words in ("two", "robot_2", "62%", "Exploration", "done", "link up"):
        assert words in text


def test_options_have_the_defaults_of_the_mission(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    options = parse_options([])
    assert options.names == ["robot_1", "robot_2"]
    assert options.map_file.name == "office.yaml"
    assert (options.link_loss_at_s, options.link_back_at_s, options.duration_s) == (20.0, 45.0, 90.0)
    assert options.supervisor
    assert options.out.parent == tmp_path / "out"
    assert list(tmp_path.iterdir()) == []


def test_the_ending_of_a_failure_says_why_and_what_is_missing():
    swap = {"component": "exploration", "from": "a/Exploration", "to": "a/Local", "silence_ms": None}
    figures = {"prepare_us": 1500.0, "blackout_us": 41.4, "missed_releases": 0}
    summary: dict[str, Any] = {
        "success": False,
        "reasons": ["it rained"],
        "coverage": {"robot_1": 0.5, "union": 0.5},
        "robots": {
            "robot_1": {"reconfigurations": [swap | figures, swap | {"from": None, "to": None} | figures]}
        },
        "supervisors_saved": None,
        "collisions": {"events": 2, "pair_seconds": 1.234, "nearest_m": 0.1},
        "realtime": {"granted": False, "missing": ["rtprio is 0"]},
        "simulation": None,
    }
    text = ending(Path("out"), summary)
    assert (
        "robot_1  exploration: Exploration -> Local, prepared in 1500 us, blackout 41 us, 0 releases missed"
        in text
    )
    assert "robot_1  exploration: changed, prepared" in text
    for words in ("FAILED:\n  it rained", "  rtprio is 0", "robot_1 50%, together 50%", "out/summary.json"):
        assert words in text
    assert "Collisions: 2, for 1.23 s in all." in text
