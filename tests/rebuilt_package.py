"""A package of plug-ins that tests build again while a process has it loaded: plugins/reload_tests*.cpp."""

import os
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from compiled_plugins import PLUGINS, compile_source, link

# By source, the macros that it looks at: a variant compiles anew what these change.
MACROS = {
    "reload_tests_values": ("STEP", "GAIN", "CRASH", "HANG", "MISSING"),
    "reload_tests_types": ("OTHER_LAYOUT",),
    "reload_tests": ("OTHER_", "WITHOUT_", "THROWS", "ADOPTS", "NEW_CORE", "MAUVE_RT_VERSION"),
}
# An architecture of the package, for an executor in its namespace.
ROBOT = """\
mauve: 1
executor: {namespace: /robot_1}
components:
  loop: {shell: reload_tests/LoopShell, core: reload_tests/Loop, fsm: reload_tests/LoopFsm,
         alternatives: installed}
resources:
  sum: {kind: shared_data, type: std_msgs/msg/Float64, topic: {name: sum, direction: publish}}
connections:
  - [loop.sum, sum.write]
"""
PYTHON_CORE = """\
from std_msgs.msg import Float64

from mauve_rt.api import Core
from {helper} import STEP

class PyLoop(Core):
    state_fields = {{"sum": "float64", "rounds": "int64"}}

    def configure(self) -> None:
        self.sum, self.rounds = 0.0, 0

    def act(self) -> None:
        self.sum += STEP
        self.rounds += 1
        self.shell.sum.write(Float64(data=self.sum))
        {then}
"""


@dataclass(frozen=True)
class RebuiltPackage:
    """An ament prefix of the test's own, and a folder of Python modules."""

    prefix: Path
    modules: Path
    builds: Path  # for all tests of the session: objects and libraries by their macros

    @property
    def library(self) -> Path:
        return self.prefix / "lib" / "libreload_tests.so"

    @property
    def index(self) -> Path:
        return self.prefix / "share" / "ament_index" / "resource_index" / "mauve_rt_plugins" / "reload_tests"

    def build(self, *macros: str) -> None:
        """The library as a build with these macros leaves it: a new file under its name."""
        built = build_variant(self.builds, *macros)
        new = self.library.with_suffix(".new")
        shutil.copyfile(built, new)
        new.replace(self.library)

    def build_other(self, *macros: str) -> None:
        """The library of reload_tests/Other, which is a build of its own."""
        library = self.library.with_name("libreload_other.so")
        kept = self.library.read_bytes()
        self.build("OTHER_LIBRARY", *macros)
        self.library.replace(library)
        self.library.write_bytes(kept)

    def write_core(self, step: float, then: str = "pass") -> None:
        """The core in Python, whose step comes from another module."""
        self.write("reload_tests_cores", PYTHON_CORE.format(helper="reload_tests_step", then=then))
        self.write("reload_tests_step", f"STEP = {step}\n")

    def write(self, module: str, text: str) -> None:
        new = self.modules / "new"
        new.write_text(text, encoding="utf-8")
        new.replace(self.modules / f"{module}.py")


def build_variant(builds: Path, *macros: str) -> Path:
    """The library with these macros; compiled where no test of the session has done so."""
    library = builds / f"{_file_name('reload_tests', macros)}.so"
    if library.exists():
        return library
    objects = []
    for source, known in MACROS.items():
        if source == "reload_tests_types" and "OTHER_LIBRARY" in macros:
            continue
        given = [macro for macro in macros if macro.startswith(known)]
        objects.append(builds / f"{_file_name(source, given)}.o")
        if not objects[-1].exists():
            compile_source(PLUGINS / f"{source}.cpp", objects[-1], *(f"-D{macro}" for macro in given))
    name = "libreload_other.so" if "OTHER_LIBRARY" in macros else "libreload_tests.so"
    link(objects, library, f"-Wl,-soname,{name}")
    return library


def _file_name(source: str, macros: Sequence[str]) -> str:
    return "_".join([source, *macros]).replace("/", "_")


def install_package(folder: Path, builds: Path) -> RebuiltPackage:
    """The package as first built, in a prefix below the folder."""
    package = RebuiltPackage(folder / "prefix", folder / "modules", builds)
    (package.prefix / "lib").mkdir(parents=True)
    package.modules.mkdir()
    package.index.parent.mkdir(parents=True)
    packages = package.index.parent.parent / "packages"
    packages.mkdir()
    (packages / "reload_tests").touch()
    shutil.copy(PLUGINS / "reload_tests.txt", package.index)
    package.build()
    package.write_core(1.0)
    return package


def search_first(package: RebuiltPackage) -> dict[str, str]:
    """The environment in which the package is found."""
    variables = {"AMENT_PREFIX_PATH": package.prefix, "PYTHONPATH": package.modules}
    return {
        name: os.pathsep.join([str(first), os.environ.get(name, "")]) for name, first in variables.items()
    }
