"""What is built, from what, and what is not built twice."""

import json
import os
import pickle
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
SCRIPTS = ROOT / "scripts"
# What CMake needs to configure the kernel.
KERNEL_SOURCES = ("CMakeLists.txt", "package.xml", "cmake", "mauve_rt/kernel", "mauve_rt/rules")

TASK_STEPS = "run/task_steps.cpp"  # of the kernel, in no unit


def _configured(build: Path, *options: str, sources: Path = ROOT) -> None:
    words = ["cmake", "-G", "Ninja", "-S", sources, "-B", build, "-DMAUVE_BUILD_TESTS=OFF", *options]
    subprocess.run([*words, "-DCMAKE_EXPORT_COMPILE_COMMANDS=ON"], check=True, capture_output=True)


def _compiled(build: Path) -> list[str]:
    """Each file that is compiled, by its name."""
    commands = json.loads((build / "compile_commands.json").read_text("utf-8"))
    return [Path(command["file"]).name for command in commands]


def _setup_that_runs(commands: str, clone: Path) -> Path:
    """Make scripts/setup of an otherwise empty clone, which runs these commands in place of its own main."""
    shutil.copytree(SCRIPTS, clone / "scripts")
    (clone / "build").mkdir()
    program = (SCRIPTS / "setup").read_text("utf-8").removesuffix('main "$@"\n')
    setup = clone / "scripts" / "setup"
    setup.write_text(f"{program}{commands}\n", encoding="utf-8")
    return setup


@pytest.mark.parametrize(("option", "least", "most"), [("ON", 3, 6), ("OFF", 80, 1000)])
def test_a_library_is_compiled_in_units_unless_told_otherwise(
    tmp_path: Path, option: str, least: int, most: int
):
    _configured(tmp_path, "-DMAUVE_BUILD_ROS=OFF", f"-DMAUVE_UNITS={option}")
    assert least <= len(_compiled(tmp_path)) <= most


@pytest.mark.skipif("AMENT_PREFIX_PATH" not in os.environ, reason="no ROS is sourced")
def test_the_demo_builds_only_what_it_runs(tmp_path: Path):
    built = {}
    for only in ("ON", "OFF"):
        _configured(tmp_path / only, f"-DMAUVE_DEMO_ONLY={only}", f"-DPython3_EXECUTABLE={sys.executable}")
        words = ["ninja", "-C", tmp_path / only, "-t", "targets", "all"]
        said = subprocess.run(words, check=True, capture_output=True, text=True).stdout
        built[only] = {Path(line.partition(":")[0]).name for line in said.splitlines()}
    left_out = {name for name in built["OFF"] - built["ON"] if name.startswith("libmauve")}
    assert left_out == {
        "libmauve_figures.so",
        "libmauve_msgs__rosidl_typesupport_cpp.so",
        "libmauve_msgs__rosidl_typesupport_fastrtps_cpp.so",
        "libmauve_msgs__rosidl_typesupport_introspection_cpp.so",
        "libmauve_rt_elements.so",
        "libmauve_rt_joint_elements.so",
        "libmauve_tutorials.so",
    }
    assert {"libmauve_rt_rules.so", "libmauve_examples.so"} <= built["ON"]
    assert "mauve_listings" in built["OFF"] - built["ON"]


@pytest.mark.parametrize(
    ("asked", "cached", "expected"),
    [("--for-demo", "", "ON"), ("--for-demo", "ON", "ON"), ("--for-demo", "OFF", "OFF"), ("", "ON", "OFF")],
)
def test_who_asked_for_all_keeps_all(tmp_path: Path, asked: str, cached: str, expected: str):
    setup = _setup_that_runs('parse_arguments "$@"\ndemo_only', tmp_path)
    if cached:
        (tmp_path / "build" / "CMakeCache.txt").write_text(
            f"MAUVE_DEMO_ONLY:BOOL={cached}\n", encoding="utf-8"
        )
    words = ["bash", setup, *asked.split()]
    assert subprocess.run(words, check=True, capture_output=True, text=True).stdout == f"{expected}\n"
    assert "mauve_ready --for-demo" in (SCRIPTS / "demo").read_text("utf-8")


def test_setup_tells_the_cpu_time_of_its_commands(tmp_path: Path):
    work = f"{sys.executable} -c 'import time\nwhile time.process_time() < 2: pass'"
    words = ["bash", _setup_that_runs(f'step "work" {work}', tmp_path)]
    said = subprocess.run(words, check=True, capture_output=True, text=True).stderr
    told = re.fullmatch(r"setup: work: [\d.]+ s, ([\d.]+) s of CPU time", said.splitlines()[-1])
    assert told is not None
    assert 1.9 <= float(told[1]) < 4


def _copied_kernel(clone: Path) -> Path:
    for name in KERNEL_SOURCES:
        (clone / name).parent.mkdir(parents=True, exist_ok=True)
        copy = shutil.copytree if (ROOT / name).is_dir() else shutil.copy
        copy(ROOT / name, clone / name)
    return clone


def _compile_one_source(clone: Path, build: Path, cache: Path) -> subprocess.CompletedProcess[str]:
    """Compile TASK_STEPS of a clone by a ccache of its own."""
    environment = {name: text for name, text in os.environ.items() if not name.startswith("CCACHE_")}
    environment["CCACHE_DIR"] = str(cache)
    _configured(build, "-DMAUVE_BUILD_ROS=OFF", sources=clone)
    words = ["ninja", "-C", build, f"mauve_rt/kernel/CMakeFiles/mauve_rt_kernel.dir/{TASK_STEPS}.o"]
    return subprocess.run(words, env=environment, check=False, capture_output=True, text=True)


@pytest.mark.skipif(not shutil.which("ccache"), reason="ccache is not installed")
def test_a_clone_and_a_workspace_share_what_was_compiled(tmp_path: Path):
    cache = tmp_path / "cache"
    clone, workspace = tmp_path / "clone", tmp_path / "of" / "colcon"
    builds = {
        clone / "build": _copied_kernel(clone),
        workspace / "build" / "mauve_rt": _copied_kernel(workspace / "src" / "mauve_rt"),
    }
    for build, sources in builds.items():
        _compile_one_source(sources, build, cache).check_returncode()
    words = ["ccache", "--print-stats"]
    environment = os.environ | {"CCACHE_DIR": str(cache)}
    said = subprocess.run(words, env=environment, check=True, capture_output=True, text=True).stdout
    counts = dict(line.split() for line in said.splitlines())
    assert (counts["cache_miss"], counts["direct_cache_hit"]) == ("1", "1")
    units = [sorted((build / "mauve_rt").rglob("unit_*.cpp")) for build in builds]
    assert units[0]
    assert [unit.read_bytes() for unit in units[0]] == [unit.read_bytes() for unit in units[1]]


@pytest.mark.skipif(not shutil.which("ccache"), reason="ccache is not installed")
def test_an_error_names_the_source_by_its_real_path(tmp_path: Path):
    clone = _copied_kernel(tmp_path / "clone")
    source = clone / "mauve_rt" / "kernel" / TASK_STEPS
    source.write_text("#error wrong\n", encoding="utf-8")
    done = _compile_one_source(clone, clone / "build", tmp_path / "cache")
    assert f"\n{source}:1:2: error: #error wrong\n" in done.stdout


def test_an_interface_is_parsed_once(tmp_path: Path):
    pytest.importorskip("rosidl_parser")
    interface, parsed = tmp_path / "msg" / "Pump.idl", tmp_path / "msg" / "Pump.idl.parsed"
    interface.parent.mkdir()
    generator = tmp_path / "generator.py"  # prints what it was given and the members of a message
    generator.write_text(
        "import pathlib, sys\n"
        "from rosidl_parser.definition import IdlLocator, Message\n"
        "from rosidl_parser.parser import parse_idl_file\n"
        "file = parse_idl_file(IdlLocator(pathlib.Path(sys.argv[2]), pathlib.Path('msg/Pump.idl')))\n"
        "[message] = file.content.get_elements_of_type(Message)\n"
        "print(sys.argv[1], *(member.name for member in message.structure.members))\n",
        encoding="utf-8",
    )

    def generated() -> str:
        words = [sys.executable, ROOT / "mauve_msgs" / "parse_once.py", sys.executable, generator]
        words += ["--generator-arguments-file", tmp_path]
        return subprocess.run(words, check=True, capture_output=True, text=True).stdout

    def write(member: str) -> None:
        text = f"module pumps {{ module msg {{ struct Pump {{ double {member}; }}; }}; }};\n"
        interface.write_text(text, encoding="utf-8")

    write("rate")
    assert generated() == "--generator-arguments-file rate\n"
    digest, content = pickle.loads(parsed.read_bytes())  # noqa: S301
    assert generated() == "--generator-arguments-file rate\n"
    content.elements[0].structure.members[0].name = "kept"
    parsed.write_bytes(pickle.dumps((digest, content)))
    assert generated() == "--generator-arguments-file kept\n", "parsed again"
    write("flow")
    assert generated() == "--generator-arguments-file flow\n", "of another text"
    parsed.write_bytes(b"half")
    assert generated() == "--generator-arguments-file flow\n"


def test_other_commands_of_the_build_run_as_they_are(tmp_path: Path):
    pytest.importorskip("rosidl_parser")
    words = [
        sys.executable,
        ROOT / "mauve_msgs" / "parse_once.py",
        "sh",
        "-c",
        "echo $0 $1; exit 3",
        "a",
        "b",
    ]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (3, "a b\n")
