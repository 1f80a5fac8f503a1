"""scripts/: what each says before anything is built, and what setup does to the machine."""

import contextlib
import fcntl
import os
import pty
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
SCRIPTS = ROOT / "scripts"
PROGRAMS = sorted(path.name for path in SCRIPTS.iterdir() if path.is_file() and os.access(path, os.X_OK))
NOBODY = 65534


def folder_of_programs(folder: Path, *names: str) -> Path:
    """A PATH with nothing else on it."""
    folder.mkdir()
    for name in names:
        (folder / name).symlink_to(shutil.which(name) or name)
    return folder


def bash(script: str, **environment: str) -> list[str]:
    """A command that has the functions of setup's parts at hand."""
    parts = "".join(
        f"source {SCRIPTS}/{part}.sh; " for part in ("lib", "progress", "python_packages", "system_packages")
    )
    settings = "".join(f"{name}={value}; " for name, value in environment.items())
    nothing = "with_lint=false with_tests=false with_benchmarks=false jazzy="
    return ["bash", "-c", f"set -euo pipefail; {parts} {nothing}; {settings} {script}"]


@contextlib.contextmanager
def terminal() -> Iterator[tuple[int, int]]:
    """(what a person has, what a program has)."""
    ours, theirs = pty.openpty()
    try:
        yield ours, theirs
    finally:
        os.close(ours)
        os.close(theirs)


# ---- --help ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", PROGRAMS)
def test_help_needs_nothing_that_is_built_or_installed(name: str, tmp_path: Path):
    shutil.copytree(SCRIPTS, tmp_path / "clone" / "scripts", ignore=shutil.ignore_patterns("__pycache__"))
    needed = ["env", "python3"] if name.endswith(".py") else ["env", "bash", "dirname"]
    path = folder_of_programs(tmp_path / "path", *needed)
    done = subprocess.run(
        [tmp_path / "clone" / "scripts" / name, "--help"],
        env={"PATH": str(path), "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert f"scripts/{name}" in done.stdout
    assert [path.name for path in (tmp_path / "clone").iterdir()] == ["scripts"]


@pytest.mark.parametrize(
    ("name", "command"),
    [
        ("demo", ["-m", "mauve_examples.mission.demo"]),
        ("figures", ["-m", "mauve_examples.figures"]),
        ("bench", [ROOT / "benchmarks" / "run.py"]),
    ],
)
def test_help_tells_every_option_of_the_program_behind(name: str, command: list[str | Path]):
    of_program = subprocess.run(
        [sys.executable, *command, "--help"], capture_output=True, text=True, check=True
    )
    of_script = subprocess.run([SCRIPTS / name, "--help"], capture_output=True, text=True, check=True)
    options = set(re.findall(r"--[a-z][a-z-]+", of_program.stdout)) - {"--help"}
    assert set(re.findall(r"^  (--[a-z-]+)", of_script.stdout, re.MULTILINE)) == options
    for choices in re.findall(r"\{([a-z,-]+)\}", of_program.stdout.replace("\n", "")):
        assert set(choices.split(",")) <= set(of_script.stdout.split())


@pytest.mark.parametrize("name", ["demo", "figures", "bench"])
def test_an_unknown_option_is_refused_before_anything_is_built(name: str, tmp_path: Path):
    shutil.copytree(SCRIPTS, tmp_path / "clone" / "scripts", ignore=shutil.ignore_patterns("__pycache__"))
    done = subprocess.run(
        [tmp_path / "clone" / "scripts" / name, "--nosuch=1"], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == f"{name}: unknown option --nosuch=1. scripts/{name} --help lists the options.\n"
    assert [path.name for path in (tmp_path / "clone").iterdir()] == ["scripts"]


# ---- system packages ------------------------------------------------------------------------------------


@pytest.mark.parametrize("program", ["g++", "make", "cmake", "ninja"])
def test_a_missing_tool_is_among_the_packages_to_install(program: str, tmp_path: Path):
    others = {"g++", "make", "cmake", "ninja", "python3", "bash", "dirname"} - {program}
    path = folder_of_programs(tmp_path / "path", *others)
    bare = subprocess.run(
        bash(f"PATH={path}; missing_system_packages"), capture_output=True, text=True, check=True
    )
    packages = {"ninja": "ninja-build"}
    assert packages.get(program, program) in bare.stdout.split()
    assert not {packages.get(other, other) for other in others} & set(bare.stdout.split())


def missing_packages(folder: Path, **settings: str) -> list[str]:
    """What setup would install where nothing is."""
    path = folder_of_programs(folder / "path", "python3", "bash", "dirname")
    command = bash(f"PATH={path}; missing_system_packages || true", **settings)
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()


@pytest.mark.parametrize("with_tests", ["true", "false"])
def test_ccache_comes_with_the_tests(with_tests: str, tmp_path: Path):
    assert ("ccache" in missing_packages(tmp_path, with_tests=with_tests)) is (with_tests == "true")


@pytest.mark.skipif(os.geteuid() != 0, reason="only root installs it without a question")
@pytest.mark.skipif(Path("/usr/include/boost").exists(), reason="Boost is installed")
@pytest.mark.parametrize("with_benchmarks", ["true", "false"])
def test_boost_comes_with_the_benchmarks(with_benchmarks: str, tmp_path: Path):
    assert ("libboost-dev" in missing_packages(tmp_path, with_benchmarks=with_benchmarks)) is (
        with_benchmarks == "true"
    )


@pytest.fixture
def machine(tmp_path: Path) -> Iterator[Path]:
    """A folder for PATH: sudo wants a password and is given it; apt-get only says how it was called."""
    folder = Path("/tmp") / f"mauve_scripts_{os.getpid()}"  # noqa: S108 - others have to enter it
    folder.mkdir()
    (folder / "sudo").write_text(
        f'#!/bin/bash\necho sudo "$@" >>{folder}/log\n'
        'case $1 in -n) exit 1 ;; -v) exit 0 ;; *) exec "$@" ;; esac\n'
    )
    (folder / "apt-get").write_text(f'#!/bin/bash\necho apt-get "$@" >>{folder}/log\n')
    (folder / "log").touch()
    for path in folder.iterdir():
        path.chmod(0o777)
    folder.chmod(0o777)
    yield folder
    shutil.rmtree(folder)


def as_nobody(command: list[str], machine: Path, *, stdin: int) -> subprocess.CompletedProcess[str]:
    """Run it as somebody who is not root."""
    user = {"user": NOBODY, "group": NOBODY, "extra_groups": []} if os.getuid() == 0 else {}
    environment = {"PATH": f"{machine}:{os.defpath}"}
    return subprocess.run(
        command, env=environment, stdin=stdin, capture_output=True, text=True, check=False, cwd="/", **user
    )


def readable(command: list[str], machine: Path) -> list[str]:
    """The command with a copy of the scripts that everybody may read."""
    shutil.copytree(SCRIPTS, machine / "clone" / "scripts")
    for path in [machine / "clone", *(machine / "clone").rglob("*")]:
        path.chmod(0o755)
    return [word.replace(str(SCRIPTS), str(machine / "clone" / "scripts")) for word in command]


def test_sudo_asks_for_its_password_on_a_terminal(machine: Path):
    command = readable(bash("get_root g++ && apt_install g++", MAUVE_BUILD=str(machine)), machine)
    with terminal() as (_, theirs):
        done = as_nobody(command, machine, stdin=theirs)
    assert done.returncode == 0, done.stderr
    assert "sudo asks for your password, to install them" in done.stderr
    log = (machine / "log").read_text().splitlines()
    assert log[:2] == ["sudo -n true", "sudo -v"]
    [update, install] = [line for line in log if line.startswith("apt-get")]
    assert update.endswith(" update")
    assert install.endswith(" g++")


def test_without_a_terminal_the_command_to_type_is_told(machine: Path):
    command = readable(bash("get_root g++ && apt_install g++", MAUVE_BUILD=str(machine)), machine)
    done = as_nobody(command, machine, stdin=subprocess.DEVNULL)
    assert done.returncode == 2
    assert "no terminal" in done.stderr
    expected = "sudo apt-get update && sudo apt-get install -y --no-install-recommends g++"
    assert expected in done.stderr.splitlines()[-1]
    assert (machine / "log").read_text().splitlines() == ["sudo -n true"]


@pytest.mark.skipif(shutil.which("apt-get") is None, reason="there is no apt-get here")
def test_apt_s_lock_is_waited_for(tmp_path: Path):
    for folder in ("lists/partial", "cache/archives/partial", "etc/apt.conf.d", "etc/preferences.d"):
        (tmp_path / folder).mkdir(parents=True)
    settings = {"Dir::State::Lists": "lists", "Dir::Cache": "cache", "Dir::Etc": "etc"}
    lines = [f'{name} "{tmp_path / folder}";' for name, folder in settings.items()]
    (tmp_path / "apt.conf").write_text("\n".join(lines) + "\n")
    lock = (tmp_path / "lists" / "lock").open("w")
    fcntl.lockf(lock, fcntl.LOCK_EX)
    waiting = subprocess.Popen(
        bash("as_root=(); apt_get update", MAUVE_BUILD=str(tmp_path)),
        env=os.environ | {"APT_CONFIG": str(tmp_path / "apt.conf")},
        stdout=subprocess.PIPE,
        text=True,
    )
    assert waiting.stdout is not None
    for line in waiting.stdout:
        if line.startswith("waiting for another package manager"):
            break
    lock.close()
    waiting.stdout.read()
    assert waiting.wait() == 0
    assert "Could not get lock" not in (tmp_path / ".apt-get.log").read_text()


# ---- setup ----------------------------------------------------------------------------------------------


def test_progress_says_how_far_what_and_how_long(tmp_path: Path):
    log = tmp_path / "log"
    log.write_text(
        "[9/9] earlier.cpp\n### build: cmake\n[1/3] Building CXX object a/b.dir/task.cpp.o\na warning\n"
    )
    with terminal() as (ours, theirs):
        command = bash(f"start_progress 'setup: build' {log}; read -r; stop_progress")
        with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=theirs) as process:
            said = b""
            while b"task.cpp" not in said:
                said += os.read(ours, 1000)
            process.communicate(b"\n")
    assert re.search(rb"\rsetup: build \.\.\. \d+ s  \[1/3\] task\.cpp$", said.replace(b"\x1b[K", b""))
    assert process.returncode == 0


def test_the_plan_and_too_little_space_are_told_before_anything_is_begun(tmp_path: Path):
    small = tmp_path / "small"
    small.mkdir()
    script = f"""
        mount -t tmpfs -o size=60m small {small} && echo mounted || exit
        mkdir {small}/clone && cp -r {SCRIPTS} {ROOT}/requirements {small}/clone
        {small}/clone/scripts/setup
        echo "310.5 s on 2026-01-01" >{small}/clone/build/.setup-took
        {small}/clone/scripts/setup --quiet
        status=$?
        ls -A {small}/clone
        exit $status"""
    done = subprocess.run(
        ["unshare", "--mount", "sh", "-c", script],
        env={"PATH": os.defpath},
        capture_output=True,
        text=True,
        check=False,
    )
    if not done.stdout.startswith("mounted\n"):
        pytest.skip(f"may not mount a small disk here ({done.stderr.strip()})")
    assert done.returncode == 2
    assert re.search(r"expected \d{3,} MB free .*, found \d\d MB; make room", done.stderr)
    assert done.stdout.split()[1:] == ["build", "requirements", "scripts"]
    plans = re.findall(r"^setup: (?!expected)(.*)$", done.stderr, re.MULTILINE)
    first, second = plans[: len(plans) // 2], plans[len(plans) // 2 :]
    assert "this will install Python packages into .venv (to build and run)" in first
    assert first[-3:] == [
        "this will compile MAUVE RT in build/",
        "this will install it to install/",
        "the first time in this clone",
    ]
    assert second == [*first[:-1], "the last time took 310.5 s on 2026-01-01"]


@pytest.mark.parametrize("locale", ["C", "C.UTF-8"])
def test_a_path_that_rosidl_cannot_use_is_refused_before_anything_is_begun(tmp_path: Path, locale: str):
    clone = tmp_path / "wörk"
    shutil.copytree(SCRIPTS, clone / "scripts", ignore=shutil.ignore_patterns("__pycache__"))
    done = subprocess.run(
        [clone / "scripts" / "setup"],
        env={"PATH": os.defpath, "LC_ALL": locale},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == (
        f"setup: {clone}: expected a path of ASCII letters, which rosidl needs. "
        "Move the clone, such as to /opt/mauve_rt.\n"
    )
    assert [entry.name for entry in clone.iterdir()] == ["scripts"]


def test_a_demo_builds_no_test_program():
    build = ROOT / "build"
    cache = build / "CMakeCache.txt"
    if not cache.is_file() or "MAUVE_BUILD_TESTS:BOOL=ON" not in cache.read_text(encoding="utf-8"):
        pytest.skip("not built by scripts/setup, or without tests")

    def commands(target: str) -> set[str]:
        words = ["ninja", "-C", build, "-t", "commands", target]
        said = subprocess.run(words, capture_output=True, text=True, check=True).stdout
        return {line for line in said.splitlines() if not line.startswith("ninja:")}

    lean, full = commands("without_tests"), commands("all")
    in_tests = {line for line in full if re.search(r"(^|[ /])tests/", line)}
    assert in_tests
    assert full - lean == in_tests


def test_patching_leaves_the_installer_s_cache_as_it_was(tmp_path: Path):
    cached, installed = tmp_path / "cached.cmake", tmp_path / "prefix" / "share" / "x" / "installed.cmake"
    cached.write_text("include(/opt/python/cp311-cp311/lib)\n")
    installed.parent.mkdir(parents=True)
    installed.hardlink_to(cached)
    program = "import pathlib, sys, patch_wheels; patch_wheels.patch(pathlib.Path(sys.argv[1]))"
    subprocess.run([sys.executable, "-c", program, tmp_path / "prefix"], cwd=SCRIPTS, check=True)
    assert installed.read_text() == f"include({tmp_path}/prefix/lib)\n"
    assert cached.read_text() == "include(/opt/python/cp311-cp311/lib)\n"
    assert [path.name for path in installed.parent.iterdir()] == ["installed.cmake"]


def test_the_slowest_cases_are_listed(tmp_path: Path):
    cases = '<testcase classname="tests.x" name="slow" time="3.25"/><testcase name="quick" time="0.5"/>'
    (tmp_path / "python.xml").write_text(f"<testsuites><testsuite>{cases}</testsuite></testsuites>")
    kernel = '<testsuite><testcase classname="a.B" name="a.B" time="2"/></testsuite>'
    (tmp_path / "kernel.xml").write_text(kernel)
    words = [sys.executable, SCRIPTS / "count_results.py", "--slowest", "2", tmp_path]
    said = subprocess.run(words, check=True, capture_output=True, text=True).stdout
    assert said == "    3.2 s  python  tests.x::slow\n    2.0 s  kernel  a.B\n"
    assert "--slowest 30" in (SCRIPTS / "test").read_text("utf-8")


def test_failed_cases_are_named_with_the_end_of_their_output(tmp_path: Path):
    out = "<system-out>" + "\n".join(f"line {i}" for i in range(100)) + "</system-out>"
    kernel = f'<testsuite><testcase name="a.B" classname="a.B" status="fail">{out}</testcase></testsuite>'
    (tmp_path / "tsan.xml").write_text(kernel)
    (tmp_path / "python.xml").write_text('<testsuite><testcase classname="tests.x" name="good"/></testsuite>')
    words = [sys.executable, SCRIPTS / "count_results.py", tmp_path]
    done = subprocess.run(words, check=False, capture_output=True, text=True)
    assert done.returncode == 1
    first, *lines, last = done.stdout.splitlines()
    assert first == "FAILED tsan: a.B"
    assert lines[-1] == "    line 99"
    assert len(lines) < 100
    assert last == "1 passed, 1 failed, 0 skipped"
