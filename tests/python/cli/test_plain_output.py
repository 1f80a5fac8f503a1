"""Control characters in the names of others, as in a bag of somebody else: a terminal gets none of them."""

import json
import os
import subprocess
import sys

import pytest

from mauve_rt.cli.main import main
from mauve_rt.cli.plain_output import plain
from mauve_rt.trace.format.records import Kind
from mauve_rt.trace.recording.recorder import Recorder
from mauve_rt.trace.recording.synthetic import SyntheticSource

HOSTILE = "esc\x1b]0;owned\x07\x1b[2J\x9b\u202egpj.exe"
SEEN = r"esc\x1b]0;owned\x07\x1b[2J\x9b\u202egpj.exe"


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> str:
    source = SyntheticSource([HOSTILE])
    source.add(HOSTILE, Kind.DEPLOYMENT, 0, a=1000, c=1000)
    source.add(HOSTILE, Kind.START, 1, a=1000)
    instant = 1000
    for _ in range(3):
        instant = source.cycle(HOSTILE, instant, states={HOSTILE: 250}, wait_ns=1000, wakeup_ns=20)
    source.add(HOSTILE, Kind.FAULT, instant, name=HOSTILE)
    recorder = Recorder(source, tmp_path_factory.mktemp("hostile") / "bag", node_name="/robot/executor")
    recorder.start()
    recorder.stop()
    return str(recorder.directory)


@pytest.mark.parametrize("verb", ["info", "stats"])
@pytest.mark.parametrize("as_json", [False, True])
def test_no_control_character_of_a_bag_is_printed(
    verb: str, bag: str, capsys: pytest.CaptureFixture[str], *, as_json: bool
) -> None:
    assert main(["trace", verb, bag, *(["--json"] if as_json else [])]) == 0
    printed = capsys.readouterr()
    assert all(each.isprintable() or each == "\n" for each in printed.out + printed.err)
    if as_json:
        assert json.dumps(HOSTILE) in json.dumps(json.loads(printed.out))
    else:
        assert SEEN in printed.out


def test_colours_of_our_own_are_left(bag: str) -> None:
    command = [sys.executable, "-m", "mauve_rt.cli", "trace", "stats", bag]
    done = subprocess.run(command, capture_output=True, check=True, env=os.environ | {"FORCE_COLOR": "1"})
    assert b"\x1b[1m" in done.stdout
    assert b"\x1b[2J" not in done.stdout
    assert b"\x1b]" not in done.stdout


def test_errors_are_plain_too(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["trace", "info", f"/nowhere/{HOSTILE}"]) == 2
    assert SEEN in capsys.readouterr().err


def test_lines_tabs_and_letters_of_all_languages_stay() -> None:
    text = "a\tb\nä €\u6c34 \U0001f916\n"
    assert plain(text) == text
    assert plain("a\rb\udc80") == r"a\rb\udc80"
