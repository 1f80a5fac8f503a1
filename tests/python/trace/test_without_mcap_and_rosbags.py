"""In a colcon workspace nothing brings mcap and rosbags: recording works, reading says how to get them."""

import subprocess
import sys
from pathlib import Path

import pytest
from synthetic_traces import record_small_bag

from mauve_rt.trace.reading.reader import open_trace

BLOCKED = """
import sys

for name in ("mcap", "rosbags", "zstandard", "lz4"):
    sys.modules[name] = None  # an import of it fails
"""
RECORD = f"""{BLOCKED}
from pathlib import Path

from mauve_rt.trace.format.records import Kind
from mauve_rt.trace.recording.recorder import Recorder
from mauve_rt.trace.recording.synthetic import SyntheticSource

source = SyntheticSource(["a"])
source.add("a", Kind.MARK, 7, name="hello", a=1)
recorder = Recorder(source, Path(sys.argv[1]), node_name="/robot/executor")
recorder.start()
recorder.stop()
"""
COMMAND = f"""{BLOCKED}
from mauve_rt.cli.main import main

sys.exit(main())
"""
OPEN = f"""{BLOCKED}
import mauve_rt.trace

try:
    mauve_rt.trace.open(sys.argv[1])
except mauve_rt.trace.TraceError as error:
    print(error)
"""
LIBRARIES = {"mcap", "rosbags", "zstandard", "lz4"}


def run(program: str, *words: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", program, *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_a_bag_is_recorded(tmp_path: Path):
    done = run(RECORD, tmp_path / "bag")
    assert (done.returncode, done.stderr) == (0, "")
    assert len(open_trace(tmp_path / "bag").of("a")) == 1


def test_recording_does_not_load_them(tmp_path: Path):
    program = RECORD.removeprefix(BLOCKED)
    done = run(
        f"import sys\n{program}\nprint(*{{name.partition('.')[0] for name in sys.modules}})", tmp_path / "b"
    )
    assert done.returncode == 0, done.stderr
    assert "mauve_rt" in done.stdout.split()
    assert LIBRARIES & set(done.stdout.split()) == set()


@pytest.mark.parametrize(
    "words",
    [
        ["trace", "info", "BAG"],
        ["trace", "check", "BAG"],
        ["trace", "stats", "BAG"],
        ["trace", "repair", "BAG"],
        ["trace", "export", "BAG"],
        ["trace", "export", "BAG", "--format", "csv"],
        ["report", "BAG"],
        ["rules", "explain", "BAG"],
    ],
    ids=" ".join,
)
def test_what_reads_a_bag_says_in_a_line_how_to_get_them(tmp_path: Path, words: list[str]):
    bag = record_small_bag(tmp_path / "bag")
    done = run(COMMAND, *[bag if word == "BAG" else word for word in words])
    assert done.returncode == 2
    assert done.stdout == ""
    (line,) = done.stderr.splitlines()
    assert line.startswith("mauve: reading bags needs more (")
    assert line.endswith("; install it by: pip install mcap rosbags")


def test_so_does_the_api(tmp_path: Path):
    done = run(OPEN, record_small_bag(tmp_path / "bag"))
    assert (done.returncode, done.stderr) == (0, "")
    assert "pip install mcap rosbags" in done.stdout
