"""The how-to pages whose commands need no executor: they print what the page shows."""

import html
import re
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest
from page_blocks import Block, blocks
from pages import PAGES

from mauve_rt.cli.main import main
from mauve_rt.model import load_architecture

ROOT = Path(__file__).parents[3]


def _blocks(name: str) -> list[Block]:
    """The blocks of docs/howto/NAME.md that are run, in its order."""
    return [block for block in blocks(PAGES[f"docs/howto/{name}.md"]) if not block.not_run]


def _plain(text: str) -> str:
    return " ".join(text.split())


def _shown_in(output: str, shown: str) -> list[str]:
    """The lines of a block that the output does not have; a line may be the end of a longer one."""
    found = _plain(output)
    return [line for line in shown.splitlines() if _plain(line) not in found]


def _text_of(page: Path) -> str:
    return html.unescape(re.sub("<[^>]*>", "", page.read_text(encoding="utf-8")))


def test_the_commands_that_find_an_overrun_print_what_it_shows(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "mauve_examples").symlink_to(ROOT / "mauve_examples")
    monkeypatch.chdir(tmp_path)
    output, verbs, checked = "", [], 0
    for block in _blocks("find_an_overrun"):
        words = shlex.split(block.text) if block.text.startswith("mauve ") else []
        if not words:
            assert _shown_in(output, block.text) == [], verbs[-1]
            checked += 1
            continue
        verbs.append(words[1])
        assert main(words[1:]) in {0, 1}, words
        output = capsys.readouterr().out
        if words[1] == "report":
            output = _text_of(tmp_path / words[2] / "report.html")
    assert verbs == ["analyze", "analyze", "report", "report", "trace"]
    assert checked == 3


def test_systemd_knows_each_line_of_the_units(tmp_path: Path) -> None:
    verify = shutil.which("systemd-analyze")
    if verify is None:
        pytest.skip("systemd-analyze is not installed")
    units = [block.text for block in _blocks("systemd") if block.text.startswith("[Unit]")]
    for name, unit in zip(("mauve-executor", "mauve-supervisor"), units, strict=True):
        (tmp_path / f"{name}.service").write_text(unit, encoding="utf-8")
    files = sorted(tmp_path.glob("*.service"))
    done = subprocess.run([verify, "verify", *files], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "Unknown key" not in done.stderr
    assert not [line for line in done.stderr.splitlines() if str(tmp_path) in line], done.stderr


def test_the_wakeup_latency_is_measured_and_used_as_the_page_says(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ROOT)
    texts = [block.text for block in _blocks("pin_and_isolate_cpus") if not block.language][1:]
    assert [text.split()[1] for text in texts[::2]] == ["trace", "analyze"]
    for command, shown in zip(texts[::2], texts[1::2], strict=True):
        assert main(shlex.split(command)[1:]) == 0
        assert _shown_in(capsys.readouterr().out, shown) == []


def test_the_settings_of_pinned_components_are_accepted(tmp_path: Path) -> None:
    file = tmp_path / "robot.yaml"
    pieces = [block.text for block in _blocks("pin_and_isolate_cpus") if block.language == "yaml"]
    models = []
    for piece in pieces:
        parts = piece.replace("...", "shell: a/A, core: a/A, fsm: a/A")
        parts = parts.replace("cpus: [2]", "cpus: [0]")  # one that each computer has
        file.write_text(f"mauve: 1\ncomponents:\n  {parts}", encoding="utf-8")
        models.append(load_architecture(file).components["control"])
    assert models[0].cpus == [0]
    assert models[1].diagnostics.wakeup_max_us is not None
    assert len(models) == 2


def test_a_cpu_that_is_not_there_is_refused_as_the_page_says(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    [shown] = [block.text for block in _blocks("pin_and_isolate_cpus") if "asks for a CPU" in block.text]
    file = tmp_path / "robot.yaml"
    parts = "{shell: a/A, core: a/A, fsm: a/A, cpus: [1000]}"
    file.write_text(f"mauve: 1\ncomponents:\n  control: {parts}\n", encoding="utf-8")
    assert main(["check", str(file)]) != 0
    said = re.sub(r"of [\d, ]+, found \d+", "of 0, 1, found 2", capsys.readouterr().err)
    assert _plain(shown) in _plain(said)
