"""Output whose reader went away, as of `mauve plugins | head -1`: a quiet end."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from synthetic_traces import record_small_bag

from mauve_rt.cli.pipe import PIPE_CLOSED, piped
from mauve_rt.parts.ament_index import share_folder

BUFFERED = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}


def nobody_reads(*words: str, both: bool = False, unbuffered: bool = False) -> tuple[int, str]:
    """Exit status and stderr of a command; nobody reads what it writes to stdout (or to `both`)."""
    reading, writing = os.pipe()
    os.close(reading)
    try:
        done = subprocess.run(
            [sys.executable, *words],
            stdout=writing,
            stderr=writing if both else subprocess.PIPE,
            text=True,
            check=False,
            env=BUFFERED | ({"PYTHONUNBUFFERED": "1"} if unbuffered else {}),
        )
    finally:
        os.close(writing)
    return done.returncode, done.stderr or ""


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> str:
    return str(record_small_bag(tmp_path_factory.mktemp("pipe") / "bag"))


@pytest.mark.parametrize(
    "words",
    [
        ("--help",),
        ("--version",),
        ("trace", "info", "--help"),
        ("plugins",),
        ("plugins", "--json"),
        ("trace", "info", "BAG"),
        ("trace", "info", "BAG", "--json"),
        ("trace", "stats", "BAG"),
        ("trace", "check", "BAG"),
        ("trace", "repair", "BAG"),
    ],
    ids=" ".join,
)
def test_a_verb_ends_quietly_when_nobody_reads(words: tuple[str, ...], bag: str):
    given = [bag if word == "BAG" else word for word in words]
    assert nobody_reads("-m", "mauve_rt.cli", *given) == (PIPE_CLOSED, "")
    if "--help" not in words and "--version" not in words:  # argparse does not say that it failed to write
        assert nobody_reads("-m", "mauve_rt.cli", *given, unbuffered=True) == (PIPE_CLOSED, "")


def test_errors_that_nobody_reads_are_no_trouble_either():
    assert nobody_reads("-m", "mauve_rt.cli", "trace", "info", "/nowhere", both=True) == (PIPE_CLOSED, "")


def test_a_check_ends_quietly_when_nobody_reads():
    share = share_folder("mauve_examples")
    assert share is not None
    architecture = share / "architecture" / "metronome.yaml"
    assert nobody_reads("-m", "mauve_rt.cli", "check", str(architecture)) == (PIPE_CLOSED, "")


def test_the_demo_ends_quietly_when_nobody_reads(tmp_path: Path):
    times = ["--duration", "15", "--link-loss-at", "3", "--link-back-at", "6"]
    options = ["--simulated-time", *times, "--out", str(tmp_path / "out")]
    assert nobody_reads("-m", "mauve_examples.mission.demo", *options) == (PIPE_CLOSED, "")
    assert nobody_reads("-m", "mauve_examples.mission.demo", "--help") == (PIPE_CLOSED, "")


def test_another_pipe_s_trouble_is_told():
    def other() -> int:
        raise BrokenPipeError

    with pytest.raises(BrokenPipeError):
        piped(other)
