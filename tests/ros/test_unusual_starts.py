"""Starts in unusual surroundings: each program starts and reports it, or refuses in one line."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from domains import draw_domain
from ros_processes import PATIENCE_S, wait_for_signals

from mauve_rt import _kernel
from mauve_rt.parts.ament_index import share_folder

PREFIX = Path(_kernel.__file__).resolve().parents[4]
BAD_INPUT, INTERRUPTED = 2, 130
CLOSED = ("sh", "-c", 'exec "$@" <&- >&- 2>&-', "sh")
FEW_FILES = ("prlimit", "--nofile=40")
TOO_FEW_FILES = ("prlimit", "--nofile=20")
NO_NAME = "robot-2.invalid"
RULES = """\
mauve: 1
rules:
  - name: silent
    when: {silence: {topic: /nothing, type: std_msgs/msg/Bool, longer_than_s: 1000}}
    do: [{kind: stop, target: metronome}]
"""
TRACE = "Traceback"


@dataclass(frozen=True)
class Surroundings:
    """What is unusual, and what each node reports of it in one line; "" where there is nothing to report."""

    report: str
    remedy: str = ""
    environment: Mapping[str, str | None] = field(default_factory=dict)  # None: not set
    wrapper: tuple[str, ...] = ()


def mounted(folder: Path, *, options: str, command: str = ":") -> tuple[str, ...]:
    """A wrapper that has a tmpfs on a folder."""
    script = f'mount -t tmpfs -o {options} none {folder} && {command}; exec "$@"'
    return ("unshare", "-m", "sh", "-c", script, "sh")


def no_home(_: Path) -> Surroundings:
    missing = {"HOME": None, "ROS_LOG_DIR": None, "ROS_HOME": None}
    return Surroundings("log folder: expected ROS_LOG_DIR or HOME", "Set ROS_LOG_DIR", missing)


def no_log_folder(_: Path) -> Surroundings:
    return Surroundings(
        "log folder /proc/no: cannot be written", "Set ROS_LOG_DIR", {"ROS_LOG_DIR": "/proc/no"}
    )


def read_only_home(folder: Path) -> Surroundings:
    home = {"HOME": str(folder), "ROS_LOG_DIR": None, "ROS_HOME": None}
    wrapper = mounted(folder, options="ro,size=64k")
    return Surroundings(
        f"log folder {folder}/.ros/log: cannot be written (Read-only", "Set ROS_LOG_DIR", home, wrapper
    )


def full_log_folder(folder: Path) -> Surroundings:
    fill = f"dd if=/dev/zero of={folder}/all bs=4k count=99 2>/dev/null"
    wrapper = mounted(folder, options="size=64k", command=fill)
    return Surroundings(
        f"log folder {folder}: cannot be written (No space",
        "Set ROS_LOG_DIR",
        {"ROS_LOG_DIR": str(folder)},
        wrapper,
    )


def another_ros(folder: Path) -> Surroundings:
    (folder / "rclpy").mkdir()
    (folder / "rclpy" / "__init__.py").write_text("raise ImportError('built for another Python')\n", "utf-8")
    return Surroundings("", "", {"PYTHONPATH": f"{folder}:{os.environ['PYTHONPATH']}"})


def unresolved_peer(_: Path) -> Surroundings:
    peers = {"ROS_STATIC_PEERS": NO_NAME}
    return Surroundings(f"no address is found for {NO_NAME}", "Connect the network", peers)


def closed_streams(_: Path) -> Surroundings:
    return Surroundings("", wrapper=CLOSED)


def few_files(_: Path) -> Surroundings:
    return Surroundings("This process may open 40 files", "ulimit -n 1024", wrapper=FEW_FILES)


ALL = (
    no_home,
    no_log_folder,
    read_only_home,
    full_log_folder,
    another_ros,
    unresolved_peer,
    closed_streams,
    few_files,
)
OF_ROOT = (read_only_home, full_log_folder)  # a mount


@pytest.fixture(params=ALL, ids=lambda made: made.__name__)
def surroundings(request: pytest.FixtureRequest, tmp_path: Path) -> Surroundings:
    if request.param in OF_ROOT and os.geteuid() != 0:
        pytest.skip("a mount is made as root")
    if request.param is another_ros and "PYTHONPATH" not in os.environ:
        pytest.skip("the environment is an installed one")
    folder = tmp_path / "unusual"
    folder.mkdir()
    made: Surroundings = request.param(folder)
    return made


def environment_of(surroundings: Surroundings, domain: int) -> dict[str, str]:
    given = {**os.environ, "ROS_DOMAIN_ID": str(domain), **surroundings.environment}
    return {name: value for name, value in given.items() if value is not None}


Node = Callable[..., subprocess.Popen[bytes]]


def lines_with(log: Path, words: str) -> list[str]:
    return [line for line in log.read_text("utf-8").splitlines() if words in line]


def await_line(log: Path, words: str) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while not lines_with(log, words):
        assert time.monotonic() < deadline, f"never printed: {words}\n{log.read_text('utf-8')}"
        time.sleep(0.02)


def test_executor_supervisor_and_command_work_and_report(
    surroundings: Surroundings, domain: int, tmp_path: Path
) -> None:
    share = share_folder("mauve_examples")
    (tmp_path / "rules.yaml").write_text(RULES, "utf-8")
    environment = environment_of(surroundings, domain)
    files = {
        "executor": f"architecture:={share}/architecture/metronome.yaml",
        "supervisor": f"rules:={tmp_path}/rules.yaml",
    }
    nodes: dict[str, subprocess.Popen[bytes]] = {}
    logs = {name: tmp_path / f"{name}.log" for name in files}
    try:
        for name, file in files.items():
            words = [*surroundings.wrapper, PREFIX / "lib" / "mauve_rt" / name, "--ros-args", "-p", file]
            with logs[name].open("wb") as log:
                nodes[name] = subprocess.Popen(words, env=environment, stdout=log, stderr=subprocess.STDOUT)
        for name, node in nodes.items():
            wait_for_signals(node.pid)
            if surroundings.report:
                await_line(logs[name], surroundings.report)
        for descriptor in range(3) if surroundings.wrapper == CLOSED else ():
            assert Path(f"/proc/{nodes['executor'].pid}/fd/{descriptor}").readlink() == Path("/dev/null")
        command = [*surroundings.wrapper, PREFIX / "bin" / "mauve", "list", "/executor"]
        listed = subprocess.run(
            command, env=environment, capture_output=True, text=True, check=False, timeout=PATIENCE_S
        )
        assert (listed.returncode, TRACE in listed.stderr) == (0, False), listed.stderr
        assert ("metronome" in listed.stdout) == (surroundings.wrapper != CLOSED)
        assert len(listed.stderr.splitlines()) == (NO_NAME in listed.stderr), listed.stderr
    finally:
        for node in nodes.values():
            node.send_signal(signal.SIGTERM)
        statuses = {name: node.wait(PATIENCE_S) for name, node in nodes.items()}
    assert statuses == {"executor": 0, "supervisor": 0}, [log.read_text("utf-8") for log in logs.values()]
    for log in logs.values():
        assert TRACE not in log.read_text("utf-8")
        if surroundings.report:
            (line,) = lines_with(log, surroundings.report)
            assert surroundings.remedy in line


@pytest.mark.parametrize("program", ["lib/mauve_rt/executor", "lib/mauve_rt/supervisor", "bin/mauve", "demo"])
def test_too_few_open_files_are_refused_in_one_line(program: str) -> None:
    words = (
        [sys.executable, "-P", "-m", "mauve_examples.mission.demo"]
        if program == "demo"
        else [PREFIX / program]
    )
    done = subprocess.run([*TOO_FEW_FILES, *words], capture_output=True, text=True, check=False)
    (line,) = done.stderr.splitlines()
    assert (done.returncode, done.stdout) == (BAD_INPUT, "")
    assert line == (
        f"{Path(program).name}: open files: expected at least 32. This process may open 20 files. "
        "Allow more: ulimit -n 1024; in a systemd service LimitNOFILE=1024."
    )


@pytest.mark.parametrize("program", ["lib/mauve_rt/executor", "lib/mauve_rt/supervisor", "bin/mauve", "demo"])
@pytest.mark.parametrize("number", ["abc", "500"])
def test_a_domain_that_is_none_is_refused_in_one_line(program: str, number: str, tmp_path: Path) -> None:
    (tmp_path / "rules.yaml").write_text(RULES, "utf-8")
    words = {
        "executor": [
            "--ros-args",
            "-p",
            f"architecture:={share_folder('mauve_examples')}/architecture/metronome.yaml",
        ],
        "supervisor": ["--ros-args", "-p", f"rules:={tmp_path}/rules.yaml"],
    }
    command = [PREFIX / program, *words.get(Path(program).name, ["nodes"])]
    if program == "demo":
        command = [sys.executable, "-P", "-m", "mauve_examples.mission.demo", "--out", str(tmp_path / "out")]
    given = {**os.environ, "ROS_DOMAIN_ID": number}
    done = subprocess.run(command, env=given, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (BAD_INPUT, "")
    (line,) = done.stderr.splitlines()
    found = f"ROS_DOMAIN_ID: expected a number from 0 to 232, found {number}. Choose one from 0 to 101."
    assert line == f"{Path(program).name}: {found}"


def demo(
    domain: int, *words: str, wrapper: tuple[str, ...] = (), **environment: str
) -> subprocess.Popen[str]:
    command = [*wrapper, sys.executable, "-P", "-m", "mauve_examples.mission.demo", *words]
    given = {**os.environ, "ROS_DOMAIN_ID": str(domain), **environment}
    return subprocess.Popen(command, env=given, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def test_the_demo_runs_in_all_of_them_at_once(tmp_path: Path) -> None:
    (tmp_path / "ros").mkdir()
    other = another_ros(tmp_path / "ros").environment
    closed_input = ("sh", "-c", 'unset HOME; exec "$@" <&-', "sh")
    wrapper = (*FEW_FILES, *closed_input)
    domain = draw_domain()
    given = {
        "ROS_STATIC_PEERS": NO_NAME,
        "ROS_LOG_DIR": "",
        **{key: str(value) for key, value in other.items()},
    }
    mission = demo(domain, "--out", str(tmp_path / "out"), wrapper=wrapper, **given)
    assert mission.stdout is not None
    said = []
    for line in mission.stdout:
        said.append(line)
        if line.startswith("All have met"):
            break
    mission.send_signal(signal.SIGINT)
    output, errors = mission.communicate(timeout=PATIENCE_S)
    assert (mission.returncode, errors) == (INTERRUPTED, ""), "".join(said) + output
    warnings = [line for line in said if line.startswith("Warning: ")]
    for words in ("expected ROS_LOG_DIR or HOME", NO_NAME, "may open 40 files"):
        assert len([line for line in warnings if words in line]) == 1, said
    logs = [log.read_text("utf-8") for log in (tmp_path / "out" / "log").iterdir()]
    assert len(logs) == 5
    assert not [log for log in logs if TRACE in log]


def test_a_results_folder_that_cannot_be_written_is_refused_in_one_line(domain: int) -> None:
    mission = demo(domain, "--out", "/proc/nothing/out")
    output, errors = mission.communicate(timeout=PATIENCE_S)
    assert (mission.returncode, output) == (BAD_INPUT, "")
    (line,) = errors.splitlines()
    assert line.startswith("demo: results folder /proc/nothing/out: cannot be written (")
    assert line.endswith("Choose another: --out DIR.")
