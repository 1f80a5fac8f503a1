"""The bar that long work of `mauve trace` and `mauve report` shows on a terminal."""

import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

import mauve_rt.cli.progress
from mauve_rt.cli.main import main
from mauve_rt.cli.progress import shown
from mauve_rt.trace.format.records import Kind
from mauve_rt.trace.recording.recorder import Recorder
from mauve_rt.trace.recording.synthetic import SyntheticSource

_END = "<end>"


class Terminal:
    """Standard error of this process, on a pseudo terminal."""

    def __init__(self) -> None:
        self._master, slave = os.openpty()
        self.stream = os.fdopen(slave, "w", encoding="utf-8")

    def text(self) -> str:
        """What was written since the last call."""
        self.stream.write(_END)
        self.stream.flush()
        found = ""
        while not found.endswith(_END):
            found += os.read(self._master, 1 << 16).decode(errors="replace")
        return found.removesuffix(_END)

    def close(self) -> None:
        self.stream.close()
        os.close(self._master)


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> Iterator[Terminal]:
    made = Terminal()
    monkeypatch.setenv("TERM", "xterm")
    yield made
    made.close()


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    source = SyntheticSource(["c"])
    source.add("c", Kind.MARK, 7, name="hello")
    recorder = Recorder(source, tmp_path / "bag", node_name="/executor")
    recorder.start()
    recorder.stop()
    return tmp_path / "bag"


@pytest.mark.parametrize("verb", ["trace stats", "trace check", "trace export", "report"])
def test_each_verb_shows_how_far_it_is_on_a_terminal_alone(
    verb: str,
    bag: Path,
    terminal: Terminal,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(sys, "stderr", terminal.stream)  # here: pytest sets it before each test
    monkeypatch.setattr(mauve_rt.cli.progress, "SHOWN_AFTER_S", 0.0)
    monkeypatch.chdir(bag.parent)
    out = ["--force"] if verb == "trace export" else []
    assert main([*verb.split(), str(bag), *out]) == 0
    assert "%" in terminal.text()
    with Path(os.devnull).open("w", encoding="utf-8") as piped:
        monkeypatch.setattr(sys, "stderr", piped)
        assert main([*verb.split(), str(bag), *out]) == 0
    assert terminal.text() == ""


def test_short_work_shows_nothing(terminal: Terminal, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stderr", terminal.stream)
    monkeypatch.setattr(mauve_rt.cli.progress, "SHOWN_AFTER_S", 3600.0)
    with shown() as progress:
        progress(0.5, "reading")
    assert terminal.text() == ""


def test_long_work_shows_its_share_and_what_is_done(
    terminal: Terminal, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "stderr", terminal.stream)
    with shown() as progress:
        progress(0.1, "reading")
        time.sleep(mauve_rt.cli.progress.SHOWN_AFTER_S)
        progress(0.5, "drawing")
    found = terminal.text()
    assert "50%" in found
    assert "drawing" in found
    assert "10%" not in found
