"""The `pip install .` door: CMake builds and installs the project into a folder, which becomes the wheel.

So the environment gets what any other prefix gets, at the same places: lib/mauve_rt/executor, libraries in
lib/, headers in include/, the ament index, CMake and architecture files in share/. ROS 2 Jazzy comes as
wheels, to build as well as to run.

    pip install .
    MAUVE_CMAKE_ARGS="-DMAUVE_BUILD_EXAMPLES=OFF" pip install .     # more CMake options, as for scripts/setup
"""

import os
import shlex
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

ROOT = Path(__file__).resolve().parent
sys.path.insert(0, str(ROOT / "scripts"))
from patch_wheels import private_prefix  # noqa: E402

PYTHON_PACKAGES = ("mauve_rt", "mauve_examples", "mauve_msgs", "tf2_msgs")
# What serves the set-up files of workspaces only; some of it names the folder it was built in.
LEFT_OUT = (
    "bin/mauve",  # an entry point instead, which knows its interpreter
    "share/*/environment/*",
    "share/*/local_setup.*",
    "share/*/package.dsv",
    "share/ament_index/resource_index/parent_prefix_path/*",
)
CONSOLE_SCRIPTS = "\n[console_scripts]\nmauve = mauve_rt.cli.main:main\n"
SHEBANG = b"#!/usr/bin/env python3\n"
# For the shell: start the interpreter of this program's own prefix. For Python: a string.
OWN_PYTHON = b"""\
#!/bin/sh
'''exec' "$(dirname "$(readlink -f "$0")")/../../bin/python3" "$0" "$@"
'''
"""


class BuildByCMake(build_ext):
    """Builds the CMake project; its Python packages are the wheel's, all else its data files."""

    def run(self) -> None:
        """Build from nothing: what an earlier build left may be another environment's."""
        if self.inplace or self.editable_mode:
            sys.exit(
                "setup.py: editable installs are not supported; use scripts/setup and install/setup.bash"
            )
        temporary = Path(self.build_temp).absolute()
        for folder in (temporary, Path(self.build_lib)):
            shutil.rmtree(folder, ignore_errors=True)
        private_prefix(_wheels_prefix(), temporary / "ros")
        stage = temporary / "stage"
        _cmake(temporary / "cmake", ros=temporary / "ros", stage=stage)
        [site_packages] = stage.glob("lib/python3*/site-packages")
        for package in PYTHON_PACKAGES:
            if (site_packages / package).is_dir():
                _copy_package(site_packages / package, Path(self.build_lib) / package)
        for program in (*stage.glob("lib/mauve_rt/*"), *stage.glob("lib/mauve_examples/*")):
            content = program.read_bytes()
            if content.startswith(SHEBANG):
                program.write_bytes(content.replace(SHEBANG, OWN_PYTHON, 1))
        self.distribution.data_files = list(_data_files(stage, besides=site_packages))


def _wheels_prefix() -> Path:
    spec = find_spec("ament_package")
    if spec is None or spec.origin is None:
        sys.exit(
            "setup.py: the ROS wheels are not installed where this builds; leave out --no-build-isolation, "
            "or install build, ros-wheels, ros-wheels-build and constraints of requirements/ before"
        )
    return Path(spec.origin).parents[4]  # PREFIX/lib/pythonX.Y/site-packages/ament_package/__init__.py


def _cmake(build: Path, *, ros: Path, stage: Path) -> None:
    """Configure, build and install, with the wheels in `ros` and nothing of any sourced ROS."""
    [site_packages] = (ros / "lib").glob("python3*/site-packages")
    libraries = [ros / "lib", *sorted(site_packages.glob("ros_*.libs"))]
    environment = os.environ | {
        "AMENT_PREFIX_PATH": str(ros),
        "CMAKE_PREFIX_PATH": str(ros),
        "PYTHONPATH": str(site_packages),
        "LD_LIBRARY_PATH": os.pathsep.join(map(str, libraries)),  # the linker's: the wheels' RPATHs are wrong
        "_ROS_WHEELS_BOOTSTRAP_COMPLETE": "1",  # the interpreter need not restart itself to set it
    }
    options = [
        f"-DCMAKE_INSTALL_PREFIX={stage}",
        f"-DPython3_EXECUTABLE={sys.executable}",
        "-DCMAKE_PLATFORM_NO_VERSIONED_SONAME=ON",  # a wheel has no links: each would be a copy
        "-DMAUVE_BUILD_TESTS=OFF",
        "-DMAUVE_BUILD_BENCHMARKS=OFF",
        *shlex.split(os.environ.get("MAUVE_CMAKE_ARGS", "")),
    ]
    for arguments in (
        ["-G", "Ninja", "-S", ROOT, "-B", build, *options],
        ["--build", build],
        ["--install", build, "--strip"],
    ):
        subprocess.run(["cmake", *arguments], env=environment, check=True)


def _copy_package(package: Path, to: Path) -> None:
    shutil.copytree(package, to, ignore=shutil.ignore_patterns("__pycache__"))


def _data_files(stage: Path, *, besides: Path) -> Iterator[tuple[str, list[str]]]:
    """(folder below the prefix, [file]) of what is installed, as setuptools wants it."""
    for file in sorted(stage.rglob("*")):
        relative = file.relative_to(stage)
        left_out = file.is_relative_to(besides) or any(relative.match(pattern) for pattern in LEFT_OUT)
        if file.is_file() and not left_out:
            yield str(relative.parent), [os.path.relpath(file, ROOT)]


def _requirements(*names: str) -> list[str]:
    """The packages that files of requirements/ name."""
    files = [ROOT / "requirements" / f"{name}.txt" for name in names]
    lines = [line for file in files for line in file.read_text(encoding="utf-8").splitlines()]
    found = [line.partition("#")[0].strip() for line in lines]
    return [requirement for requirement in found if requirement and not requirement.startswith("-")]


def _run_requirements() -> list[str]:
    """ROS in exactly the version that the messages are generated for; of all else at least what was tried."""
    return [
        requirement if requirement.startswith("ros-") else requirement.replace("==", ">=")
        for requirement in _requirements("run", "ros-wheels")
    ]


def _build_requirements() -> list[str]:
    """What the wheels need to build messages, all in the versions tried; cmake and ninja where missing."""
    tools = [tool for tool in ("cmake<4", "ninja") if shutil.which(tool.partition("<")[0]) is None]
    return [*_requirements("build", "ros-wheels", "ros-wheels-build", "constraints"), *tools]


def _element(name: str) -> str:
    """Of package.xml, which says for every door what this is."""
    return ET.parse(ROOT / "package.xml").findtext(name, "").strip()  # noqa: S314 - our own file


setup(
    name=_element("name"),
    version=_element("version"),
    description=_element("description"),
    long_description=(ROOT / "README.md").read_text("utf-8"),
    long_description_content_type="text/markdown",
    license=_element("license"),
    license_files=["LICENSE"],
    python_requires=">=3.11",
    packages=[],
    ext_modules=[Extension("mauve_rt._kernel", sources=[])],  # a wheel for this platform and Python
    cmdclass={"build_ext": BuildByCMake},
    entry_points=(ROOT / "mauve_rt/cli/entry_points.txt").read_text("utf-8") + CONSOLE_SCRIPTS,
    setup_requires=_build_requirements(),
    install_requires=_run_requirements(),
)
