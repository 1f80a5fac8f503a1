"""What the pages about the timing proof show is what `mauve analyze` prints."""

import re
import shlex
from pathlib import Path

import pytest

from mauve_rt.cli.main import main

ROOT = Path(__file__).parents[3]
PAGE = ROOT / "docs/howto/is_my_robot_schedulable.md"


def test_the_commands_of_the_how_to_print_what_it_shows(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "mauve_examples").symlink_to(ROOT / "mauve_examples")
    monkeypatch.chdir(tmp_path)
    fenced = re.findall(r"^```(\w*)\n(.*?)^```$", PAGE.read_text("utf-8"), re.DOTALL | re.MULTILINE)
    blocks = [block for language, block in fenced if not language]
    commands = [shlex.split(block)[1:] for block in blocks if block.startswith("mauve ")]
    assert [words[0] for words in commands] == ["analyze", "analyze", "analyze", "report"]
    shown = [block for block in blocks if not block.startswith("mauve ")]
    for words, status, lines in zip(commands[1:3], (0, 1), shown, strict=True):
        assert main(words) == status
        assert lines.rstrip("\n") in re.sub(r"(?<=ms:) ", "\n", capsys.readouterr().out)
    assert main(commands[3]) == 0
    assert (tmp_path / "slow/report.html").stat().st_size > 0
