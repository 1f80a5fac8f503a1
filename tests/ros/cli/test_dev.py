"""`mauve dev`: a save becomes new code in a running executor; broken code never enters."""

import os
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from page_blocks import blocks
from pages import PAGES
from rebuilt_package import RebuiltPackage
from ros_processes import PATIENCE_S
from terminal import Terminal

from mauve_msgs.srv import ListComponents, ReadValues

NODE = "/robot_1/executor"
ROBOT = """\
mauve: 1
executor: {namespace: /robot_1}
components:
  loop: {shell: reload_tests/LoopShell, core: reload_tests/Loop, fsm: reload_tests/LoopFsm}
resources:
  sum: {kind: shared_data, type: std_msgs/msg/Float64}
connections:
  - [loop.sum, sum.write]
"""
# The source names a variant of the library, which was built before; `broken` has none, and the build fails.
BUILD = """\
set -e
variant=$(cat source/variant.txt)
echo "compiling $variant" | tee -a builds
if [ "$variant" = endless ]; then sleep 1000; fi
if [ ! -f "variants/$variant.so" ]; then echo "variant.cpp:7: error: $variant is not declared"; exit 3; fi
cp "variants/$variant.so" "$LIBRARY.new"
mv "$LIBRARY.new" "$LIBRARY"
"""


class Workspace(NamedTuple):
    """A folder with a source and a build command, for the package reload_tests."""

    folder: Path
    package: RebuiltPackage
    architecture: Path

    def save(self, variant: str) -> None:
        """As an editor does that renames a new file."""
        new = self.folder / "source" / "variant.new"
        new.write_text(variant, encoding="utf-8")
        new.replace(self.folder / "source" / "variant.txt")

    def prepare(self, variant: str, *macros: str) -> None:
        """Build a variant now, so that the build command only copies the library."""
        kept = self.package.library.read_bytes()
        self.package.build(*macros)
        self.package.library.replace(self.folder / "variants" / f"{variant}.so")
        self.package.library.write_bytes(kept)

    def builds(self) -> list[str]:
        """One line for each run of the build command."""
        file = self.folder / "builds"
        return file.read_text("utf-8").splitlines() if file.exists() else []

    @property
    def words(self) -> list[str]:
        """Arguments of `mauve`, without a probation."""
        return ["dev", NODE, "--build", "bash ./build.sh", "--watch", "source", "--probation", "0"]

    @property
    def variables(self) -> dict[str, str]:
        return {"LIBRARY": str(self.package.library)}


@pytest.fixture
def workspace(rebuilt: RebuiltPackage, tmp_path: Path) -> Workspace:
    folder = tmp_path / "workspace"
    for name in ("source", "variants"):
        (folder / name).mkdir(parents=True)
    (folder / "build.sh").write_text(BUILD, encoding="utf-8")
    architecture = tmp_path / "robot.yaml"
    architecture.write_text(ROBOT, encoding="utf-8")
    made = Workspace(folder, rebuilt, architecture)
    made.save("first")
    made.prepare("thousand", "STEP=1000.0")
    return made


@pytest.fixture
def robot(workspace: Workspace, start_executor: Callable[..., Any]) -> Any:
    return start_executor("-p", f"architecture:={workspace.architecture}")


@pytest.fixture
def once(workspace: Workspace, robot: Any, domain: int) -> Callable[..., subprocess.CompletedProcess[str]]:
    assert robot.process.poll() is None

    def run(*words: str) -> subprocess.CompletedProcess[str]:
        environment = {**os.environ, "ROS_DOMAIN_ID": str(domain), **workspace.variables}
        command = [sys.executable, "-m", "mauve_rt.cli", *workspace.words, "--once", *words]
        return subprocess.run(
            command, env=environment, cwd=workspace.folder, capture_output=True, text=True, check=False
        )

    return run


class Plain:
    """`mauve dev --plain`, line by line."""

    def __init__(self, workspace: Workspace, domain: int, *words: str) -> None:
        environment = {**os.environ, "ROS_DOMAIN_ID": str(domain), **workspace.variables}
        self.process = subprocess.Popen(
            [sys.executable, "-m", "mauve_rt.cli", *workspace.words, "--plain", *words],
            env=environment,
            cwd=workspace.folder,
            stdout=subprocess.PIPE,
            text=True,
        )

    def lines_until(self, word: str) -> list[str]:
        """Events, without their time, to the one that has this word."""
        lines: list[str] = []
        assert self.process.stdout is not None
        for line in self.process.stdout:
            lines.append(line.rstrip("\n").partition(" ")[2])
            if word in line:
                return lines
        raise AssertionError(f"no {word} in {lines}")


@pytest.fixture
def plain(workspace: Workspace, domain: int) -> Iterator[Callable[..., Plain]]:
    opened: list[Plain] = []

    def open_(*words: str) -> Plain:
        opened.append(Plain(workspace, domain, *words))
        return opened[-1]

    yield open_
    for each in opened:
        if each.process.poll() is None:
            each.process.kill()
        each.process.communicate()


def _generation(graph: Any) -> int:
    (loop,) = graph.ask(ListComponents, f"{NODE}/list_components").components
    return int(loop.generation)


def _writes(graph: Any) -> int:
    (value,) = graph.ask(ReadValues, f"{NODE}/read_values", names=["sum"]).values
    return int(value.writes)


def test_a_save_leads_to_new_code(
    workspace: Workspace, robot: Any, graph: Any, plain: Callable[..., Plain]
) -> None:
    assert _generation(graph) == 1
    dev = plain("--test", "echo tested > tested")
    dev.lines_until("executor answers")
    workspace.save("thousand")
    lines = dev.lines_until("in force: ")
    told = [line.removeprefix("cycle 1: ") for line in lines]
    order = ["saved variant.txt", "building", "built in", "testing", "tested in", "reloading", "reloaded in"]
    order += ["first release", "output loop.sum:data", "in force"]
    places = [next(number for number, line in enumerate(told) if line.startswith(word)) for word in order]
    assert places == sorted(places), told
    assert (workspace.folder / "tested").exists()
    [step] = [line for line in told if line.startswith("output")]
    assert float(step.rpartition(" ")[2]) >= 1000.0, "the first release of the new code adds 1000"
    assert _generation(graph) == 2
    assert robot.process.poll() is None
    dev.process.send_signal(signal.SIGINT)
    assert dev.process.wait(PATIENCE_S) == 0


def test_broken_code_never_enters(
    workspace: Workspace, robot: Any, graph: Any, plain: Callable[..., Plain]
) -> None:
    workspace.prepare("crash", "CRASH")
    writes = _writes(graph)
    dev = plain("--test", "! grep bad source/variant.txt")
    dev.lines_until("executor answers")
    workspace.save("broken")
    lines = dev.lines_until("error: broken is not declared")
    assert "cycle 1: build failed: exit status 3; the old code runs on" in lines
    assert not any("reload" in line for line in lines)
    workspace.prepare("bad", "STEP=1000.0")
    workspace.save("bad")
    lines = dev.lines_until("| bad")
    assert "cycle 2: test failed: exit status 1; the old code runs on" in lines
    assert not any("reload" in line for line in lines)
    workspace.save("crash")
    lines = dev.lines_until("crashed (SIGABRT")
    assert lines[-1].startswith("cycle 3: refused: ")
    assert _generation(graph) == 1
    assert _writes(graph) > writes, "the old code runs on"
    workspace.save("thousand")
    dev.lines_until("cycle 4: in force: ")
    assert _generation(graph) > 1
    assert robot.process.poll() is None


def test_a_violation_on_probation_puts_the_old_code_back(
    workspace: Workspace, once: Callable[..., subprocess.CompletedProcess[str]], graph: Any
) -> None:
    workspace.prepare("throws", "THROWS")
    workspace.save("throws")
    done = once("--probation", "30")
    assert (done.returncode, done.stderr) == (1, "")
    assert "cycle 1: reverted: loop: fault: the new code is broken" in done.stdout
    assert _generation(graph) == 1
    writes = _writes(graph)
    workspace.save("thousand")
    done = once("--probation", "0.2")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.splitlines()[-1].endswith("cycle 1: passed")
    assert _generation(graph) > 1
    assert _writes(graph) > writes


def test_a_save_during_a_build_starts_the_build_again(
    workspace: Workspace, robot: Any, graph: Any, plain: Callable[..., Plain]
) -> None:
    assert robot.process.poll() is None
    dev = plain()
    dev.lines_until("executor answers")
    workspace.save("endless")
    dev.lines_until("cycle 1: building")
    deadline = time.monotonic() + PATIENCE_S
    while workspace.builds() != ["compiling endless"]:
        assert time.monotonic() < deadline, "the build command never began"
        time.sleep(0.02)
    workspace.save("thousand")
    lines = dev.lines_until("in force: ")
    assert "cycle 1: superseded: sources were saved again" in lines
    assert lines[-1].startswith("cycle 2: in force")
    assert workspace.builds() == ["compiling endless", "compiling thousand"]
    assert _generation(graph) == 2


def test_keys_go_back_and_build_again(
    workspace: Workspace, robot: Any, graph: Any, terminal: Callable[..., Terminal]
) -> None:
    assert robot.process.poll() is None
    screen = terminal(*workspace.words, folder=workspace.folder, variables=workspace.variables)
    screen.await_text(f"{NODE}  answers", "watching", "q quit")
    workspace.save("thousand")
    text = screen.await_text("in force", "loop.sum:data", "step")
    assert max(len(line.strip()) for line in text.replace("\r", "").splitlines()) <= 80
    assert _generation(graph) == 2
    screen.press("b")
    screen.await_text("went back")
    assert _generation(graph) == 1
    screen.press("r")
    screen.await_text("build the present", "watching  in force")
    assert _generation(graph) > 1
    assert workspace.builds() == ["compiling thousand"] * 2
    screen.press("q")
    assert screen.process.wait(PATIENCE_S) == 0


def test_an_executor_may_end_and_come_back(
    workspace: Workspace,
    robot: Any,
    graph: Any,
    start_executor: Callable[..., Any],
    plain: Callable[..., Plain],
) -> None:
    dev = plain()
    dev.lines_until("executor answers")
    robot.process.terminate()
    robot.process.wait(PATIENCE_S)
    dev.lines_until("executor does not answer")
    workspace.save("thousand")
    assert "cycle 1: not loaded" in dev.lines_until("not loaded")[-1]
    start_executor("-p", f"architecture:={workspace.architecture}")
    dev.lines_until("executor is back")
    workspace.prepare("two", "STEP=2.0")
    workspace.save("two")
    dev.lines_until("cycle 2: in force")
    assert _generation(graph) == 2


def test_the_commands_of_the_page(
    workspace: Workspace, once: Callable[..., subprocess.CompletedProcess[str]], graph: Any
) -> None:
    commands = [shlex.split(block.text)[1:] for block in blocks(PAGES["docs/howto/develop_live.md"])]
    replaced = {
        "cmake --build build/my_robot --target install": "bash ./build.sh",
        "ctest --test-dir build/my_robot": "grep thousand source/variant.txt",
        "src/my_robot": "source",
    }
    workspace.save("thousand")
    outcomes = []
    for words in commands:
        done = once(*[replaced.get(word, word) for word in words if word not in ("dev", NODE, "--once")])
        assert (done.returncode, done.stderr) == (0, ""), done.stdout
        outcomes.append(done.stdout.splitlines()[-1].partition("cycle 1: ")[2].partition(":")[0])
    assert outcomes == ["in force", "nothing changed"], "the second build writes the same code"
    assert _generation(graph) > 1


def test_limits_are_checked_before_anything_is_built(
    workspace: Workspace, once: Callable[..., subprocess.CompletedProcess[str]], plain: Callable[..., Plain]
) -> None:
    for words, why in (
        (("--revert-on", "overun"), "unknown violation 'overun'; did you mean overrun?"),
        (("--revert-on", "{output: loop.total.data, maximum: 1}"), "'loop.total.data' is no output of loop"),
    ):
        done = once("--probation", "30", *words)
        assert done.returncode == 2
        assert why in done.stderr
        assert not done.stdout
    assert workspace.builds() == []
    dev = plain("--probation", "30", "--revert-on", "{output: loop.sum.speed, maximum: 1}")
    assert dev.process.wait(PATIENCE_S) == 2
    workspace.save("thousand")
    assert (
        once("--probation", "0.2", "--revert-on", "{output: loop.sum.data, minimum: 0}", "nan").returncode
        == 0
    )
    assert workspace.builds() == ["compiling thousand"]


def test_once_its_status_tells(
    workspace: Workspace, once: Callable[..., subprocess.CompletedProcess[str]], graph: Any
) -> None:
    done = once("--build", "true")
    assert (done.returncode, done.stderr) == (0, "")
    assert "nothing changed" in done.stdout
    workspace.save("thousand")
    done = once()
    assert (done.returncode, done.stderr) == (0, "")
    assert "cycle 1: in force" in done.stdout
    assert _generation(graph) == 2
    assert once("--test", "false").returncode == 1
    refused = once("--target", "nobody")
    assert refused.returncode == 1
    assert "'nobody' is no component" in refused.stdout
    workspace.save("broken")
    assert once().returncode == 1
    assert once("--watch", "nowhere").returncode == 2
    assert once("--probation", "-1").returncode == 2
    assert _generation(graph) == 2
