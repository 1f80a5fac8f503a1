"""The `pip install` door: sdist, the wheel made from it, a fresh environment, a shell with nothing set."""

import os
import shutil
import subprocess
import sys
import tarfile
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

import pytest
from doors import LEAN_BUILD, ROOT, ROS_VARIABLES, build, installed_executor, run, source_files

pytestmark = pytest.mark.timeout(1800)  # it compiles
UV = shutil.which("uv") or ""
ARCHITECTURE = """\
mauve: 1
components:
  relay: {shell: mauve_rt/PointRelayShell, core: mauve_rt/PointRelay, fsm: mauve_rt/PointRelayFsm}
resources:
  given: {kind: shared_data, type: geometry_msgs/msg/Point, topic: {name: given, direction: subscribe}}
  passed: {kind: shared_data, type: geometry_msgs/msg/Point}
connections:
  - [relay.input, given.read]
  - [relay.output, passed.write]
"""


@dataclass(frozen=True)
class Installation:
    """What was made on the way, and the shell it all works in."""

    sdist: Path
    prefix: Path
    shell: dict[str, str]


@pytest.fixture(scope="module")
def installation(tmp_path_factory: pytest.TempPathFactory) -> Installation:
    """Sdist, wheel, environment: each made from the one before."""
    if not UV:
        pytest.skip("uv is not installed: pip takes a minute for the environment, uv seconds")
    folder = tmp_path_factory.mktemp("pip")
    prefix = folder / "environment"
    shell = {name: value for name, value in os.environ.items() if not name.startswith(ROS_VARIABLES)}
    shell["PATH"] = os.defpath
    # An sdist needs nothing but setuptools: no environment of its own.
    run(UV, "build", "--sdist", "--no-build-isolation", "--python", sys.executable, "-o", folder, ROOT,
        environment=os.environ)  # fmt: skip
    [sdist] = folder.glob("*.tar.gz")
    lean = shell | {"MAUVE_CMAKE_ARGS": " ".join(LEAN_BUILD)}
    # By pip itself: it builds in folders laid out unlike those of any environment.
    build(sys.executable, "-m", "pip", "wheel", "--no-deps", "-w", folder, sdist, environment=lean)
    [wheel] = folder.glob("*.whl")
    run(UV, "venv", "--python", sys.executable, prefix, environment=shell)
    constraints = [f"-c{ROOT}/requirements/{name}.txt" for name in ("run", "ros-wheels", "constraints")]
    # The system's certificates, as pip and scripts/setup use: a company's own may be among them.
    install = (UV, "pip", "install", "--system-certs", "--python", prefix)
    run(*install, *constraints, wheel, environment=shell)
    return Installation(sdist=sdist, prefix=prefix, shell=shell)


def test_sdist_has_every_source(installation: Installation) -> None:
    with tarfile.open(installation.sdist) as archive:
        names = {member.name.partition("/")[2] for member in archive.getmembers() if member.isfile()}
    made = {"PKG-INFO", "setup.cfg", *(name for name in names if name.startswith("mauve_rt.egg-info/"))}
    assert names - made == source_files()


def test_programs_run_in_a_shell_with_nothing_set(installation: Installation) -> None:
    prefix, shell = installation.prefix, installation.shell
    version = ET.parse(ROOT / "package.xml").findtext("version")  # noqa: S314 - our own file
    assert run(prefix / "bin" / "mauve", "--version", environment=shell) == f"{version}\n"
    plugins = run(prefix / "bin" / "mauve", "plugins", environment=shell)
    assert "mauve_rt/PointRelay" in plugins
    words = "import mauve_msgs.srv, mauve_msgs.msg as m; print(m.ComponentInfo(name='a').name)"
    assert run(prefix / "bin" / "python", "-c", words, environment=shell) == "a\n"
    supervisor = subprocess.run(
        [prefix / "lib" / "mauve_rt" / "supervisor"], env=shell, capture_output=True, text=True, check=False
    )
    assert supervisor.returncode == 2
    assert supervisor.stderr.startswith("supervisor: parameter 'rules' is missing")


def test_environment_is_an_ament_prefix(installation: Installation) -> None:
    share = installation.prefix / "share"
    for package in ("mauve_rt", "mauve_msgs"):
        assert (share / "ament_index" / "resource_index" / "packages" / package).is_file()
        assert (share / package / "package.xml").is_file()
        assert (share / package / "cmake" / f"{package}Config.cmake").is_file()
    assert (installation.prefix / "include" / "mauve_rt" / "mauve_rt.hpp").is_file()
    assert (installation.prefix / "include/mauve_msgs/mauve_msgs/msg/bid.hpp").is_file()


def test_no_path_of_the_build_is_left(installation: Installation) -> None:
    [record] = installation.prefix.glob("lib/python3*/site-packages/mauve_rt-*.dist-info/RECORD")
    files = [
        record.parents[1] / line.rpartition(",")[0].rpartition(",")[0]
        for line in record.read_text().splitlines()
    ]
    assert len(files) > 100
    places = (b"/build/temp.", bytes(ROOT))  # of pip; of the set-up, whose objects ccache gives to pip
    assert [file for file in files if any(place in file.read_bytes() for place in places)] == []


@pytest.mark.parametrize("start", ["program", "module"])
def test_executor(start: str, installation: Installation, tmp_path: Path) -> None:
    prefix = installation.prefix
    architecture = tmp_path / "relay.yaml"
    architecture.write_text(ARCHITECTURE, encoding="utf-8")
    command = {
        "program": [prefix / "lib" / "mauve_rt" / "executor"],
        "module": [prefix / "bin" / "python", "-m", "mauve_rt.node.executor.main"],
    }[start]
    with installed_executor(
        command, architecture, mauve=prefix / "bin" / "mauve", environment=installation.shell
    ) as executor:
        assert executor.component()["core"] == "mauve_rt/PointRelay"
        executor.mauve("record", "start", "/executor", "bag")
        executor.wait_for_releases()
        executor.mauve("record", "stop", "/executor")
        assert all(library.is_relative_to(prefix) for library in executor.libraries())
        assert executor.interrupt() == 0, executor.output
    for words in (["trace", "check"], ["trace", "stats"], ["report"], ["trace", "export"]):
        run(prefix / "bin" / "mauve", *words, tmp_path / "bag", environment=installation.shell, cwd=tmp_path)
    assert "<canvas" in (tmp_path / "bag" / "report.html").read_text(encoding="utf-8")
