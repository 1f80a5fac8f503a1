"""The door of a colcon user: Python packages in the versions that apt of Ubuntu 24.04 has, none besides."""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from doors import ROOT, ROS_VARIABLES, InstalledExecutor, installed_executor, run

import mauve_rt
from mauve_rt import _kernel

pytestmark = pytest.mark.timeout(600)  # it downloads
UV = shutil.which("uv") or ""
INSTALLED = Path(_kernel.__file__).resolve().parents[4]
SOURCES = Path(mauve_rt.__file__).parents[1]
LIBRARIES = {"mcap", "rosbags"}  # no package of apt: recording needs neither, what reads bags says so
OPTIONAL = LIBRARIES | {"perfetto"}  # likewise; `mauve trace export` says so


def _pinned(name: str) -> dict[str, str]:
    """Packages of a file of requirements/ and their versions, ROS's own aside."""
    text = (ROOT / "requirements" / f"{name}.txt").read_text("utf-8")
    found = dict(re.findall(r"^([\w.-]+)==(\S+)", text, re.MULTILINE))
    return {package: version for package, version in found.items() if not package.startswith("ros-")}


def _ros() -> list[str]:
    """What ROS 2 is run from, with its numpy left to apt's version."""
    lines = (ROOT / "requirements" / "ros-wheels.txt").read_text("utf-8").splitlines()
    return [line.partition("#")[0].strip() for line in lines if line.startswith("ros-")]


@pytest.fixture(scope="module")
def shell(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The environment of a shell that has sourced this build, over other Python packages."""
    if not UV:
        pytest.skip("uv is not installed: pip takes a minute for the environment, uv seconds")
    prefix = tmp_path_factory.mktemp("apt") / "environment"
    clean = {name: value for name, value in os.environ.items() if not name.startswith(ROS_VARIABLES)}
    run(UV, "venv", "--python", sys.executable, prefix, environment=clean)
    constraints = [f"-c{ROOT}/requirements/{name}.txt" for name in ("apt-noble", "constraints")]
    packages = [*(_pinned("run").keys() - OPTIONAL), *_ros()]
    install = (UV, "pip", "install", "--system-certs", "--python", prefix)
    run(*install, *constraints, *packages, environment=clean)
    [site_packages] = prefix.glob("lib/python3*/site-packages")
    libraries = [INSTALLED / "lib", prefix / "lib", *sorted(site_packages.glob("ros_*.libs"))]
    [own_packages] = INSTALLED.glob("lib/python3*/site-packages")
    return clean | {
        "AMENT_PREFIX_PATH": f"{INSTALLED}:{prefix}",
        "LD_LIBRARY_PATH": ":".join(map(str, libraries)),
        "PATH": f"{INSTALLED}/bin:{prefix}/bin:{os.defpath}",
        "PYTHONPATH": f"{SOURCES}:{own_packages}",
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "_ROS_WHEELS_BOOTSTRAP_COMPLETE": "1",  # the interpreter need not restart itself for the libraries
    }


@pytest.fixture
def executor(shell: dict[str, str], tmp_path: Path) -> Iterator[InstalledExecutor]:
    """Of the example that its README begins with."""
    architecture = tmp_path / "metronome.yaml"
    shutil.copy(ROOT / "mauve_examples" / "architecture" / "metronome.yaml", architecture)
    command = ["python3", INSTALLED / "lib" / "mauve_rt" / "executor"]
    mauve = INSTALLED / "bin" / "mauve"
    with installed_executor(command, architecture, mauve=mauve, environment=shell) as executor:
        yield executor


def test_apt_has_what_runs() -> None:
    assert _pinned("apt-noble").keys() - {"numpy"} == _pinned("run").keys() - OPTIONAL, (
        "see `apt-cache policy` on Ubuntu 24.04; what apt does not have may not be needed"
    )


def test_versions_are_those_of_apt_and_nothing_else_is_there(shell: dict[str, str]) -> None:
    words = "from importlib.metadata import version; import sys; print(*map(version, sys.argv[1:]))"
    packages = _pinned("apt-noble")
    printed = run("python3", "-c", words, *packages, environment=shell)
    assert printed.split() == list(packages.values())
    words = "from importlib.util import find_spec as f; import sys; print(*filter(f, sys.argv[1:]))"
    assert run("python3", "-c", words, "pydantic", "ruamel", environment=shell).split() == []


def test_a_run_is_started_changed_recorded_checked_and_reported(
    executor: InstalledExecutor, shell: dict[str, str], tmp_path: Path
) -> None:
    architecture, bag = tmp_path / "metronome.yaml", tmp_path / "bag"
    assert executor.component()["core"] == "mauve_examples/Metronome"
    executor.mauve("record", "start", "/executor", str(bag))
    executor.wait_for_releases()
    replaced = executor.mauve("replace-core", "/executor", "metronome", "mauve_examples/PythonMetronome")
    assert "runs mauve_examples/PythonMetronome" in replaced
    executor.wait_for_releases()
    executor.mauve("record", "stop", "/executor")
    assert executor.interrupt() == 0, executor.output
    assert "Traceback" not in executor.output
    mauve = INSTALLED / "bin" / "mauve"
    run(mauve, "check", architecture, environment=shell)
    refused = subprocess.run([mauve, "report", bag], env=shell, capture_output=True, text=True, check=False)
    assert refused.returncode == 2
    assert refused.stderr.count("\n") == 1
    assert "pip install mcap rosbags" in refused.stderr
    libraries = [f"{name}=={version}" for name, version in _pinned("run").items() if name in LIBRARIES]
    python = shutil.which("python3", path=shell["PATH"])
    run(UV, "pip", "install", "--system-certs", "--python", python, *libraries, environment=shell)
    for words in (("trace", "check", bag), ("report", bag)):
        run(mauve, *words, environment=shell)
    assert (bag / "report.html").stat().st_size > 0
