"""The how-to pages whose commands need no executor: they print what the page shows."""

import ast
import html
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml
from page_blocks import Block, blocks
from pages import PAGES

from mauve_rt import _kernel
from mauve_rt.cli.main import build_parser, main
from mauve_rt.model import load_architecture

ROOT = Path(__file__).parents[3]
INSTALLED = Path(_kernel.__file__).resolve().parents[4]


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


def test_a_pose_in_another_frame_is_refused_as_the_page_says(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "install").symlink_to(INSTALLED)
    commands, shown = _blocks("look_up_frames")
    edit, check = commands.text.splitlines()
    subprocess.run(["sh", "-ec", edit], check=True, timeout=60)
    assert main(shlex.split(check)[1:]) == 2
    place, _, refusal = capsys.readouterr().err.partition(" component ")
    assert place.startswith("wrong.yaml:"), place
    assert f"component {refusal}" == shown.text.strip() + "\n"


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


def test_the_test_in_virtual_time_passes(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    [program] = [block.text for block in _blocks("ci_for_your_package") if block.language == "python"]
    (tmp_path / "install").symlink_to(INSTALLED)
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    exec(compile(program, "test_metronome.py", "exec"), names)  # noqa: S102 - a reader would run it too
    names["test_ten_beats_in_a_second"]()


def test_the_checks_of_ci_end_with_status_0(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    [commands] = [block.text for block in _blocks("ci_for_your_package") if not block.language]
    (tmp_path / "install").symlink_to(INSTALLED)
    monkeypatch.chdir(tmp_path)
    for line in commands.splitlines():
        command = [sys.executable, "-m", "mauve_rt.cli", *shlex.split(line)[1:]]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr


def test_the_jobs_of_ci_have_one_set_of_commands() -> None:
    texts = [block.text for block in _blocks("ci_for_your_package") if block.language == "yaml"]
    github, gitlab = (yaml.safe_load(text) for text in texts)
    job = github["jobs"]["test"]
    runs = [step["run"] for step in job["steps"] if "run" in step]
    script = gitlab["test"]["script"][1:]
    assert [line.replace('"', "") for line in script] == [line.replace('"', "") for line in runs]
    assert job["container"] == gitlab["test"]["image"]
    assert job["env"]["MAUVE_RT_URL"] == gitlab["test"]["variables"]["MAUVE_RT_URL"]
    for line in runs:
        if words := re.findall(r"&& (mauve .*)", line):
            assert build_parser().parse_args(shlex.split(words[0])[1:]).verb is not None


def test_uninstalling_leaves_nothing_but_the_sources(tmp_path: Path) -> None:
    """What git ignores is what scripts and tests make."""
    ignored = (ROOT / ".gitignore").read_text(encoding="utf-8").splitlines()
    names = [line.strip("/") for line in ignored if line and not line.startswith("#") and "*." not in line]
    assert {".venv", "build", "install", "out", "mauve_rt/_*.so"} <= {*names, "mauve_rt/_*.so"}
    made = [name for name in names if name not in {"__pycache__", "dist", "compile_commands.json"}]
    assert [name for name in made if f"`{name}`" not in PAGES["docs/howto/uninstall.md"]] == []
    for folder in (*made, "mauve_rt", "mauve_examples"):
        (tmp_path / folder).mkdir(parents=True, exist_ok=True)
    links = {"mauve_rt/_kernel.so", "mauve_rt/_bridge.so", "mauve_examples/_mission.so"}
    for link in links:
        (tmp_path / link).symlink_to(tmp_path / "install" / "lib")
    (tmp_path / "mauve_rt" / "api.py").touch()
    for block in _blocks("uninstall"):
        subprocess.run(["bash", "-ec", block.text], cwd=tmp_path, check=True)
    left = {str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*")}
    assert left == {"mauve_rt", "mauve_rt/api.py", "mauve_examples"}


def test_the_links_that_the_page_about_uninstalling_names_are_all() -> None:
    modules = {
        path.name.partition(".")[0] for path in INSTALLED.glob("lib/python3*/site-packages/mauve_*/_*.so")
    }
    assert modules == set(re.findall(r"`mauve_\w+/(_\w+)\*\.so`", PAGES["docs/howto/uninstall.md"]))


def test_the_launch_file_of_the_page_gives_arguments_there_are() -> None:
    page = PAGES["docs/howto/launch_files.md"]
    source = (INSTALLED / "share/mauve_rt/launch/executor.launch.py").read_text(encoding="utf-8")
    declared = re.findall(r'(?:DeclareLaunchArgument|_optional)\(\s*"(\w+)"', source)
    assert set(re.findall(r"^\| `(\w+)` \|", page, re.MULTILINE)) == set(declared)
    [program] = [block.text for block in _blocks("launch_files") if block.language == "python"]
    tree = ast.parse(program)
    given = [node for node in ast.walk(tree) if isinstance(node, ast.Dict)]
    assert {ast.literal_eval(key) for node in given for key in node.keys if key is not None} < set(declared)
    for line in re.findall(r"ros2 launch (.*)", page):
        package, file, *arguments = shlex.split(line)
        text = (INSTALLED / "share" / package / "launch" / file).read_text(encoding="utf-8")
        assert all(f'"{argument.partition(":=")[0]}"' in text for argument in arguments)
    files = re.findall(r'share, "architecture", "(\S+)"', program)
    assert all((INSTALLED / "share/mauve_examples/architecture" / name).is_file() for name in files)
    assert len(files) == 2


def test_the_services_that_the_page_about_security_names_are_there() -> None:
    names = set(re.findall(r"`~/(\w+)`", PAGES["docs/howto/dds_security.md"]))
    assert names <= set(re.findall(r"`~/(\w+)`", PAGES["docs/howto/operate.md"]))
    assert len(names) > 5
