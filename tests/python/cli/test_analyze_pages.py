"""What the pages about the timing proof show is what `mauve analyze` prints."""

import shlex
from pathlib import Path

import pytest
from page_blocks import blocks

from mauve_rt.cli.main import main
from mauve_rt.model import load_architecture

ROOT = Path(__file__).parents[3]
PAGE = ROOT / "docs/howto/is_my_robot_schedulable.md"
BLOCKS = tuple(blocks(PAGE.read_text(encoding="utf-8")))


def test_the_commands_of_the_how_to_print_what_it_shows(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "mauve_examples").symlink_to(ROOT / "mauve_examples")
    monkeypatch.chdir(tmp_path)
    texts = [block.text for block in BLOCKS if block.is_fenced and not block.language and not block.not_run]
    commands = [shlex.split(text)[1:] for text in texts if text.startswith("mauve ")]
    assert [words[0] for words in commands] == ["analyze"] * 3 + ["report", "analyze"]
    shown = [text for text in texts if not text.startswith("mauve ")]
    for words, status, lines in zip((*commands[1:3], commands[4]), (0, 1, 0), shown, strict=True):
        assert main(words) == status
        assert " ".join(lines.split()) in " ".join(capsys.readouterr().out.split())
    assert main(commands[3]) == 0
    assert (tmp_path / "slow/report.html").stat().st_size > 0


def test_the_pieces_of_files_are_accepted(tmp_path: Path) -> None:
    file = tmp_path / "robot.yaml"
    pieces = [block.text for block in BLOCKS if block.language == "yaml"]
    for piece in pieces:
        control = "control: {shell: a/A, core: a/A, fsm: a/A}\n"
        if piece.startswith("executor:"):
            file.write_text(f"mauve: 1\n{piece}components:\n  {control}", encoding="utf-8")
        else:
            parts = piece.replace("...", "shell: a/A, core: a/A, fsm: a/A")
            file.write_text(f"mauve: 1\ncomponents:\n  {parts}", encoding="utf-8")
        assert [*load_architecture(file).components] == ["control"]
    assert len(pieces) == 4
