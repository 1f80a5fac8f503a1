"""Examples of README and docs/ do what they say: commands, files and programs are taken from there."""

import ast
import importlib
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from page_blocks import blocks
from pages import ALL, PAGES
from synthetic_traces import deploy, run

from mauve_examples.figures import runs
from mauve_rt import _kernel
from mauve_rt.cli.main import build_parser
from mauve_rt.model import load_architecture
from mauve_rt.model.resource_kinds import given_kinds
from mauve_rt.trace.recording.recorder import Recorder
from mauve_rt.trace.recording.synthetic import SyntheticSource

ROOT = Path(__file__).parents[3]
README = ALL  # and what it links to
BLOCKS = tuple(block for page in PAGES.values() for block in blocks(page))
INSTALLED = Path(_kernel.__file__).resolve().parents[4]
ROBOT = ROOT / "mauve_examples" / "architecture" / "robot.yaml"
COMPONENTS = "mauve: 1\ncomponents:\n  one: {shell: a/A, core: a/A, fsm: a/A}\n"


def _commands(first: str) -> list[list[str]]:
    """The command lines of README that begin with a word, as the shell would split them."""
    indented = "".join(block.text for block in BLOCKS if not block.is_fenced)
    lines = (line.strip() for line in indented.replace("\\\n", " ").splitlines())
    return [shlex.split(line, comments=True) for line in lines if line.split()[:1] == [first]]


def _indented(begin: str) -> str:
    """The indented block that begins with a line, without its indent."""
    return next(block.text for block in BLOCKS if not block.is_fenced and block.text.startswith(begin))


def _fenced(language: str, word: str) -> str:
    return next(block.text for block in BLOCKS if block.language == language and word in block.text)


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    """A short run of a component named control."""
    source = SyntheticSource(["control"])
    deploy(source, "control")
    run(source, "control", 20)
    recorder = Recorder(source, tmp_path / "bag", node_name="/executor")
    recorder.start()
    recorder.stop()
    return tmp_path / "bag"


def test_every_command_is_one_that_mauve_takes() -> None:
    commands = [words[:-1] if words[-1] == "&" else words for words in _commands("mauve")]
    assert len(commands) > 15
    for words in commands:
        placed = [word.replace("DIR...", "DIR") for word in words[1:]]
        assert build_parser().parse_args(placed).verb is not None, words


def test_the_steps_fit_the_mission(tmp_path: Path) -> None:
    text = re.search(r"cat > steps.yaml <<END\n(.*?)\n    END\n", README, re.DOTALL)
    assert text is not None
    steps = tmp_path / "steps.yaml"
    steps.write_text("\n".join(line[4:] for line in text[1].splitlines()), encoding="utf-8")
    # In a process of its own: in this one other tests' plug-ins may have declared the mission's types.
    command = [sys.executable, "-m", "mauve_rt.cli", "check", ROBOT, steps]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert f"{steps}: 2 steps, checked with {ROBOT}: no error found" in done.stdout


def test_the_pieces_of_architecture_files_are_accepted(tmp_path: Path) -> None:
    file = tmp_path / "robot.yaml"
    resources = _indented("resources:") + _indented("  lamp:")
    thresholds = _indented("executor: {diagnostics").replace("...", "shell: a/A, core: a/A, fsm: a/A")
    for text in (COMPONENTS + resources, f"mauve: 1\n{thresholds}"):
        file.write_text(text, encoding="utf-8")
        model = load_architecture(file)
    assert model.components["control"].diagnostics.wakeup_max_us is not None
    states = _indented("control: {..., deadline_ns").replace("...", "shell: a/A, core: a/A, fsm: a/A")
    file.write_text(f"mauve: 1\ncomponents:\n  {states}", encoding="utf-8")
    assert load_architecture(file).components["control"].states["Control"].wcet_ns == 200_000
    enforced = _indented("control: {..., enforce_wcet").replace("...", "shell: a/A, core: a/A, fsm: a/A")
    file.write_text(f"mauve: 1\ncomponents:\n  {enforced}", encoding="utf-8")
    assert load_architecture(file).components["control"].enforce_wcet
    logging = _fenced("yaml", "guidance: {..., log_level").replace("...", "shell: a/A, core: a/A, fsm: a/A")
    file.write_text(f"mauve: 1\n{logging}", encoding="utf-8")
    assert load_architecture(file).components["guidance"].log_level == "debug"
    assert load_architecture(file).resources["scan"].log_level == "warn"
    sender = re.search(r"`(executor: {sender: .*?}})`", README, re.DOTALL)
    assert sender is not None
    file.write_text(f"{COMPONENTS}{' '.join(sender[1].split())}\n", encoding="utf-8")
    assert load_architecture(file).sender.priority == 70


def test_every_kind_of_resource_is_told() -> None:
    concepts = README[README.index("**Resources** hold data") :]
    assert [kind for kind in given_kinds() if f"`{kind}`" not in concepts] == []


def test_service_calls_have_fields_of_their_services() -> None:
    calls = [words for words in _commands("ros2") if words[1:3] == ["service", "call"]]
    assert len(calls) >= 2
    for _, _, _, service, type_name, fields in calls:
        package, kind, name = type_name.split("/")
        known = getattr(importlib.import_module(f"{package}.{kind}"), name).Request
        given = re.findall(r"(\w+):", re.sub(r"\[.*\]", "", fields))
        assert set(given) <= set(known.get_fields_and_field_types()), service


def test_launch_arguments_are_declared() -> None:
    launched = [words for words in _commands("ros2") if words[1] == "launch"]
    assert len(launched) == 2
    for _, _, package, name, *arguments in launched:
        source = (ROOT / package / "launch" / name).read_text(encoding="utf-8")
        texts = {node.value for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Constant)}
        assert {argument.partition(":=")[0] for argument in arguments} <= texts, name


def test_the_python_example_reads_a_bag(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    program = _fenced("python", "all_statistics").replace('"DIR"', repr(str(bag)))
    exec(compile(program, "README.md", "exec"), {})  # noqa: S102 - a reader would run it too
    assert "control" in capsys.readouterr().out


def test_the_python_example_plots_a_value(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MPLBACKEND", "Agg")
    program = _fenced("python", "import matplotlib").replace("docs/sample", str(ROOT / "docs/sample"))
    program = program.replace("beats.png", str(tmp_path / "beats.png"))
    exec(compile(program, "record_and_report.md", "exec"), {})  # noqa: S102 - a reader would run it too
    assert (tmp_path / "beats.png").stat().st_size > 1000


def test_the_report_is_written_from_python(
    bag: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    call = re.search(r"`(mauve_rt\.trace\.report\.write_report\(.*?\))`", README)
    assert call is not None
    monkeypatch.chdir(tmp_path)
    program = f"import mauve_rt.trace.report\nfrom pathlib import Path\n{call[1]}".replace('"DIR"', '"bag"')
    exec(compile(program, "README.md", "exec"), {})  # noqa: S102
    assert (tmp_path / "report.html").stat().st_size > 10_000


def test_the_smallest_component_is_replaced_live(capsys: pytest.CaptureFixture[str]) -> None:
    program = _fenced("python", "class Up(Core[Shell])")
    assert len([line for line in program.splitlines() if line]) <= 25
    names: dict[str, Any] = {"__name__": "example"}
    exec(compile(program, "README.md", "exec"), names)  # noqa: S102
    assert re.fullmatch(r"\d+ releases missed\n", capsys.readouterr().out)
    core = names["architecture"].component("counter").core
    assert type(core) is names["Down"]
    assert 0 < core.count < 500, "it went on from the old core's count, downwards"


def _lines_not_in(listing: str, source: Path, *, but: Sequence[str]) -> list[str]:
    present = {line.strip() for line in source.read_text(encoding="utf-8").splitlines()}
    lines = [line.strip() for line in listing.splitlines() if not any(word in line for word in but)]
    assert len(lines) > 10
    return [line for line in lines if line and line not in present]


def test_listings_stand_in_the_sources() -> None:
    tutorials = ROOT / "mauve_examples" / "tutorials"
    shortened = ("...", "property(", "};")
    assert _lines_not_in(_fenced("cpp", "Metronome"), tutorials / "metronome.hpp", but=shortened) == []
    python = _fenced("python", "class Metronome")
    assert _lines_not_in(python, tutorials / "python_cores.py", but=("class Metronome",)) == []


METRONOME = """
import sys
from mauve_rt.api import Architecture, Deployer, PluginRegistry
from mauve_rt.model import PluginIndex, PluginLoader

registry = PluginRegistry()
loader = PluginLoader(registry, PluginIndex.installed())
parts = {"shell": "MetronomeShell", "core": "Metronome", "fsm": "MetronomeFsm"}
for kind, name in parts.items():
    loader.require(kind, f"mauve_examples/{name}")
architecture = Architecture(registry)
architecture.add_component("metronome", *(f"mauve_examples/{name}" for name in parts.values()))
architecture.add_resource("beat", kind="shared_data", type="std_msgs/msg/Float64")
architecture.connect("metronome", "beat", "beat", "write")
architecture.configure()
deployer = Deployer(architecture)
deployer.deploy()
assert architecture.components()[0].state == "RUNNING"
deployer.shutdown()
"""


def test_architecture_and_deployer_need_no_ros(tmp_path: Path) -> None:
    (tmp_path / "rclpy.py").write_text("raise ImportError('no ROS here')\n", encoding="utf-8")
    path = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])
    command = [sys.executable, "-c", METRONOME]
    environment = {**os.environ, "PYTHONPATH": path}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_the_kernel_knows_neither_ros_nor_python() -> None:
    library = INSTALLED / "lib" / "libmauve_rt.so"
    needed = subprocess.run(["readelf", "-d", library], capture_output=True, text=True, check=True).stdout
    libraries = re.findall(r"NEEDED.*\[(.*)\]", needed)
    assert libraries
    assert [
        name for name in libraries if re.match(r"lib(rcl|rmw|ros|python|fastrtps|mauve_msgs)", name)
    ] == []


def test_the_folders_of_the_house_are_there() -> None:
    folders = re.findall(r"^\| `([\w/]+/)` \|", README, re.MULTILINE)
    assert len(folders) >= 10
    assert [folder for folder in folders if not (ROOT / folder).is_dir()] == []


def test_files_that_readme_names_are_there() -> None:
    folders = "mauve_\\w+|tests|docs|benchmarks|scripts"
    named = re.findall(rf"[`(]((?:{folders})/[\w./]*(?:\.\w+|/))[`)]", PAGES["README.md"])
    assert len(named) > 15
    assert [name for name in named if not (ROOT / name).exists()] == []


def test_the_page_of_figures_tells_the_tasks_that_run() -> None:
    """What a run adds to it, system/test_figures.py holds to the traces."""
    said = PAGES["docs/figures.md"]
    first, second = (f"&tau;<sub>{number}</sub>" for number in (1, 2))
    assert f"runs every {runs.PERIOD_MS} ms: {first}" in said
    assert f"computes for {runs.WORK_MS[0]} ms, {second} for {runs.WORK_MS[1]} ms" in said


def test_the_licence_is_the_one_named() -> None:
    assert "GNU LESSER GENERAL PUBLIC LICENSE" in (ROOT / "LICENSE").read_text(encoding="utf-8")[:200]
    assert "<license>LGPL-3.0-or-later</license>" in (ROOT / "package.xml").read_text(encoding="utf-8")
