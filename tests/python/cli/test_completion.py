"""Completion of the names of executors and their parts, by a cache that the test writes.

tests/ros/cli/test_completion.py fills the cache from a real executor.
"""

import argparse
import fcntl
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from mauve_rt.cli import completion, completion_cache
from mauve_rt.cli.completion import (
    complete_components,
    complete_cores,
    complete_executors,
    complete_properties,
    complete_values,
)
from mauve_rt.cli.completion_cache import Cache, CachedComponent, CachedExecutor, CachedGraph

NODE, OTHER = "/robot_1/executor", "/robot_2/executor"
PATIENCE_S = 100.0
# Stands for ROS, which cannot be loaded here: leaves a file when a program tries to.
NO_ROS = """\
import os, pathlib
pathlib.Path(os.environ["LOADED"], __name__).touch()
raise ImportError("not here")
"""
COMPONENTS = (
    CachedComponent(
        name="counter",
        alternatives=("tests/Backwards", "tests/PyCounter"),
        ports=("count", "set"),
        properties=("period_ms",),
    ),
    CachedComponent(name="guard", ports=("count",)),
)


class Shell(NamedTuple):
    """What a shell does at a TAB."""

    environment: Mapping[str, str]
    loaded: Path  # has a file for each module that a program tried to load

    def complete(self, line: str, **more: str) -> list[str]:
        """The words that may stand at the end of the line; fails where anything else is printed."""
        answer = self.loaded.parent / "answer"
        asked = {"_ARGCOMPLETE": "1", "_ARGCOMPLETE_IFS": "\n"}
        asked |= {"COMP_LINE": line, "COMP_POINT": str(len(line))}
        done = subprocess.run(
            [sys.executable, "-m", "mauve_rt.cli"],
            env={**self.environment, **asked, "_ARGCOMPLETE_STDOUT_FILENAME": str(answer), **more},
            capture_output=True,
            text=True,
            check=False,
        )
        assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
        return [word.strip() for word in answer.read_text(encoding="utf-8").splitlines()]

    def wait_for_refresh(self) -> None:
        """Until a refresh has tried to load ROS."""
        deadline = time.monotonic() + PATIENCE_S
        while not (self.loaded / "rclpy").exists():
            assert time.monotonic() < deadline, "no refresh began"
            time.sleep(0.01)


@pytest.fixture
def shell(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Shell:
    stubs, loaded, runtime = (tmp_path / name for name in ("stubs", "loaded", "runtime"))
    for folder in (stubs, loaded, runtime):
        folder.mkdir(mode=0o700)
    for module in ("rclpy", "rich"):
        (stubs / f"{module}.py").write_text(NO_ROS, encoding="utf-8")
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(runtime))
    monkeypatch.setenv("ROS_DOMAIN_ID", "77")
    path = os.pathsep.join([str(stubs), os.environ.get("PYTHONPATH", "")])
    return Shell({**os.environ, "PYTHONPATH": path, "LOADED": str(loaded)}, loaded)


@pytest.fixture
def cache(shell: Shell) -> Cache:
    """The cache of domain 77, with what two executors answered just now."""
    found = Cache.of_environment()
    assert found is not None
    found.write(_graph())
    return found


def _graph(age_s: float = 0.0, **changes: Any) -> CachedGraph:
    then_s = time.time() - age_s
    first = CachedExecutor(
        name=NODE, seen_s=then_s, listed_s=then_s, components=COMPONENTS, resources=("goal", "map")
    )
    executors = {NODE: first, OTHER: CachedExecutor(name=OTHER, seen_s=then_s, listed_s=then_s)}
    executors = {name: replace(each, **changes) for name, each in executors.items()}
    return CachedGraph(found_s=then_s, executors=executors)


@pytest.mark.parametrize(
    "verb",
    [
        "list",
        "stop",
        "start",
        "replace-core",
        "reconfigure",
        "events",
        "record start",
        "record stop",
        "rules list",
        "rules load",
    ],
)
def test_executors_are_completed(shell: Shell, cache: Cache, verb: str) -> None:
    assert shell.complete(f"mauve {verb} ") == [NODE, OTHER]
    assert shell.complete(f"mauve {verb} /robot_2") == [OTHER]
    assert shell.complete(f"mauve {verb} robot_2") == [OTHER.lstrip("/")]
    assert shell.complete(f"mauve {verb} /arm") == []


@pytest.mark.parametrize("verb", ["stop", "start", "replace-core"])
def test_components_are_completed(shell: Shell, cache: Cache, verb: str) -> None:
    assert shell.complete(f"mauve {verb} {NODE} ") == ["counter", "guard"]
    assert shell.complete(f"mauve {verb} {NODE.lstrip('/')} g") == ["guard"]
    assert shell.complete(f"mauve {verb} {OTHER} ") == []
    assert _words(complete_components, executor=f"{NODE.lstrip('/')}/") == ["counter", "guard"]


def test_the_cores_that_may_replace_are_completed(shell: Shell, cache: Cache) -> None:
    assert shell.complete(f"mauve replace-core {NODE} counter ") == ["tests/Backwards", "tests/PyCounter"]
    assert shell.complete(f"mauve replace-core --force {NODE} counter tests/P") == ["tests/PyCounter"]
    assert shell.complete(f"mauve replace-core {NODE} guard ") == []


def test_options_are_completed_after_a_dash(shell: Shell, cache: Cache) -> None:
    assert shell.complete("mauve list --") == ["--help", "--json"]


def _words(completer: Callable[..., list[str]], prefix: str = "", **typed: str) -> list[str]:
    return completer(prefix, argparse.Namespace(**typed), parser=None, action=None)


@pytest.mark.parametrize("verb", ["echo", "mirror"])
def test_values_are_resources_and_ports(shell: Shell, cache: Cache, verb: str) -> None:
    words = ["counter.count", "counter.set", "goal", "guard.count", "map"]
    assert shell.complete(f"mauve {verb} {NODE} ") == words
    assert _words(complete_values, executor=NODE) == words
    assert _words(complete_values, "counter.", executor=NODE) == words[:2]


def test_properties_are_completed(shell: Shell, cache: Cache) -> None:
    assert shell.complete(f"mauve set {NODE} ") == ["counter.period_ms"]
    assert _words(complete_properties, executor=NODE) == ["counter.period_ms"]


def test_without_an_executor_on_the_line_there_are_no_parts(cache: Cache) -> None:
    for completer in (complete_components, complete_cores, complete_values, complete_properties):
        assert _words(completer) == []


def test_a_completion_loads_no_ros(shell: Shell, cache: Cache) -> None:
    assert shell.complete(f"mauve stop {NODE} ") == ["counter", "guard"]
    assert list(shell.loaded.iterdir()) == []


def test_names_that_a_shell_would_interpret_are_not_offered(cache: Cache) -> None:
    foreign = ("$(reboot)", "a b", "a;b", "`id`", "\x1b[2J", "a\n", "é", "")
    cache.write(_graph(resources=(*foreign, "good"), components=()))
    assert _words(complete_values, executor=NODE) == ["good"]


def test_nothing_is_known_and_ros_cannot_be_loaded(shell: Shell) -> None:
    assert shell.complete("mauve list ") == []
    assert shell.complete(f"mauve stop {NODE} ") == []
    shell.wait_for_refresh()


def test_an_old_answer_is_offered_and_refreshed(shell: Shell, cache: Cache) -> None:
    cache.write(_graph(30.0))
    assert shell.complete("mauve list ") == [NODE, OTHER]
    shell.wait_for_refresh()


def test_names_of_parts_are_refreshed_where_only_the_executor_is_known(shell: Shell, cache: Cache) -> None:
    cache.write(_graph(listed_s=0.0, components=()))
    assert shell.complete(f"mauve stop {NODE} ") == []
    shell.wait_for_refresh()


def test_a_current_answer_is_not_refreshed(cache: Cache, monkeypatch: pytest.MonkeyPatch) -> None:
    started: list[Cache] = []
    monkeypatch.setattr(completion, "start_refresh", lambda cache: started.append(cache) or (lambda: True))
    _words(complete_executors)
    _words(complete_components, executor=NODE)
    assert _words(complete_components, executor="/wrong/name") == []
    assert started == []
    cache.write(_graph(30.0))
    _words(complete_components, executor=NODE)
    assert started == [cache]


@pytest.mark.parametrize("age_s", [100.0, -1000.0])
def test_an_executor_that_has_not_answered_for_long_is_not_offered(
    shell: Shell, cache: Cache, age_s: float
) -> None:
    cache.write(_graph(age_s))
    assert shell.complete("mauve list ") == []
    assert shell.complete(f"mauve stop {NODE} ") == []
    shell.wait_for_refresh()


def test_an_executor_is_believed_while_the_processes_of_its_time_run() -> None:
    executor = CachedExecutor(name=NODE, seen_s=1000.0, sockets=("11", "12"))
    assert executor.is_believable(9000.0, frozenset({"11", "12", "13"}))
    assert not executor.is_believable(1010.0, frozenset({"11", "13"}))
    assert executor.is_believable(1001.0, frozenset())


def test_executors_that_are_not_found_any_more_are_forgotten(cache: Cache) -> None:
    cache.note_found([OTHER], ["1"])
    assert list(cache.read().executors) == [OTHER]
    assert cache.read().executors[OTHER].sockets == ("1",)


def test_a_search_keeps_the_parts_that_are_known(cache: Cache) -> None:
    cache.note_found([NODE, "/new"], [])
    known = cache.read().executors
    assert [known[NODE].components, known["/new"].components] == [COMPONENTS, ()]


def test_each_domain_has_names_of_its_own(shell: Shell, cache: Cache) -> None:
    assert shell.complete("mauve list ", ROS_DOMAIN_ID="78") == []
    assert shell.complete("mauve list ", ROS_AUTOMATIC_DISCOVERY_RANGE="SUBNET") == []
    assert shell.complete("mauve list ", ROS_AUTOMATIC_DISCOVERY_RANGE="") == [NODE, OTHER]


def test_a_domain_that_is_none_completes_nothing(shell: Shell, cache: Cache) -> None:
    assert shell.complete("mauve list ", ROS_DOMAIN_ID="robots") == []
    assert shell.complete("mauve list ", ROS_DOMAIN_ID="300") == []
    assert [path.name for path in cache.file.parent.iterdir()] == [cache.file.name], "and no refresh begins"


_ENTRY = {"name": NODE, "seen_s": 1e12, "listed_s": 1, "sockets": [], "components": [], "resources": []}


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"{",
        b"\xff\xfe\x00",
        b"[]",
        b"7",
        b"[" * 100_000,
        json.dumps({"format": 0, "found_s": 1, "executors": []}).encode(),
        json.dumps({"format": 1, "found_s": {}, "executors": []}).encode(),
        json.dumps({"format": 1, "found_s": 1, "executors": 7}).encode(),
        json.dumps({"format": 1, "found_s": 1, "executors": [{**_ENTRY, "name": 7}]}).encode(),
        json.dumps({"format": 1, "found_s": 1, "executors": [{**_ENTRY, "resources": [[]]}]}).encode(),
        json.dumps({"format": 1, "found_s": 1, "executors": [{**_ENTRY, "components": [{}]}]}).encode(),
    ],
)
def test_a_damaged_cache_is_as_none(shell: Shell, cache: Cache, content: bytes) -> None:
    cache.file.write_bytes(content)
    assert cache.read() == CachedGraph()
    assert shell.complete("mauve list ") == []


def test_the_cache_is_of_one_account_alone(cache: Cache) -> None:
    assert (cache.file.stat().st_mode & 0o777, cache.file.parent.stat().st_mode & 0o777) == (0o600, 0o700)
    assert list(cache.file.parent.iterdir()) == [cache.file]


def test_a_file_that_others_may_use_is_not_read(cache: Cache, monkeypatch: pytest.MonkeyPatch) -> None:
    cache.file.chmod(0o644)
    assert cache.read() == CachedGraph()
    cache.file.chmod(0o600)
    link = cache.file.with_name("link")
    link.symlink_to(cache.file)
    assert Cache(link, cache.domain).read() == CachedGraph()
    assert cache.read() != CachedGraph()
    monkeypatch.setattr(os, "geteuid", lambda: cache.file.stat().st_uid + 1)
    assert cache.read() == CachedGraph()


def test_a_folder_that_others_may_use_is_not_taken(
    cache: Cache, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    cache.file.parent.chmod(0o777)
    other = Cache.of_environment()
    assert other is not None
    assert other.file.parent == tmp_path / f"mauve_{os.geteuid()}"
    other.file.parent.rmdir()
    other.file.parent.symlink_to(cache.file.parent)
    monkeypatch.setattr(completion_cache, "_TEMPORARY", str(tmp_path / "none"))
    assert Cache.of_environment() is None


def test_in_the_runtime_folder_of_another_account_nothing_is_made(
    shell: Shell, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As of a program that sudo runs with the user's environment."""
    runtime, user = Path(os.environ["XDG_RUNTIME_DIR"]), os.geteuid()
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(completion_cache, "_TEMPORARY", str(tmp_path))
    monkeypatch.setattr(os, "geteuid", lambda: user + 1)
    assert Cache.of_environment() is None
    assert list(runtime.iterdir()) == []


def test_without_a_folder_to_write_in_nothing_is_completed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", "/proc")  # nobody makes a folder there
    monkeypatch.setenv("TMPDIR", str(tmp_path / "none"))
    monkeypatch.setattr(completion_cache, "_TEMPORARY", "/proc")
    assert Cache.of_environment() is None
    assert _words(complete_executors) == []
    assert capfd.readouterr() == ("", "")


def test_a_cache_that_cannot_be_written_stays_as_it_is(tmp_path: Path) -> None:
    cache = Cache(tmp_path / "cache.json", 0)
    cache.file.mkdir()
    cache.write(_graph())
    assert [path.name for path in tmp_path.iterdir()] == ["cache.json"]
    Cache(tmp_path / "none" / "cache.json", 0).write(_graph())


def test_an_error_in_a_completer_is_not_shown(
    cache: Cache, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    def fail(_cache: Cache) -> None:
        raise RuntimeError("unexpected")

    monkeypatch.setattr(Cache, "read", fail)
    assert _words(complete_executors) == []
    assert capfd.readouterr() == ("", "")


def test_one_refresh_runs_at_a_time(shell: Shell, cache: Cache, monkeypatch: pytest.MonkeyPatch) -> None:
    started: list[list[str]] = []
    inherited: list[int] = []

    class Process:
        def __init__(self, command: list[str], **options: Any) -> None:
            started.append(command)
            inherited.extend(os.dup(descriptor) for descriptor in options["pass_fds"])

        def poll(self) -> None:
            return None

    monkeypatch.setattr(subprocess, "Popen", Process)
    with cache.lock.open("w") as other:
        cache.lock.chmod(0o600)
        fcntl.flock(other, fcntl.LOCK_EX)
        completion.start_refresh(cache)
        assert started == []
    for _ in range(2):
        completion.start_refresh(cache)
    assert [command[-1] for command in started] == ["mauve_rt.cli.completion_refresh"]
    for descriptor in inherited:
        os.close(descriptor)
