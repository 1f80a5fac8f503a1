"""A package of plug-ins that tests build again while a process has it loaded: plugins/reload_tests.cpp."""

import os
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

from mauve_rt import _kernel

PLUGINS = Path(__file__).parent / "plugins"
INSTALLED = Path(_kernel.__file__).resolve().parents[4]
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
    headers: Path  # the precompiled ones: they make a build of 10 s one of 2 s

    @property
    def library(self) -> Path:
        return self.prefix / "lib" / "libreload_tests.so"

    @property
    def index(self) -> Path:
        return self.prefix / "share" / "ament_index" / "resource_index" / "mauve_rt_plugins" / "reload_tests"

    def build(self, *macros: str) -> None:
        """The library as a build with these macros leaves it: a new file under its name."""
        built = self.headers / f"{'_'.join(macros).replace('/', '_')}.so"  # for all tests of the session
        if not built.exists():
            flags = [flag for macro in macros for flag in ("-D", macro)]
            compile_plugin(self.headers, PLUGINS / "reload_tests.cpp", built, *flags)
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


def compile_plugin(headers: Path, source: Path, library: Path, *flags: str) -> None:
    """One library, with the precompiled header."""
    command = [
        *("g++", "-std=c++20", "-O1", "-shared", "-fPIC", *flags, "-isystem", headers, source, "-o", library),
        *(f"-I{INSTALLED}/include", f"-L{INSTALLED}/lib", "-lmauve_rt", f"-Wl,-rpath,{INSTALLED}/lib"),
        "-Wl,-soname,libreload_tests.so",
    ]
    subprocess.run(command, check=True)


def precompile(folder: Path) -> Path:
    """Precompile the headers of the installed kernel; where compile_plugin() finds them."""
    (folder / "mauve_rt").mkdir(parents=True)
    header = f"{INSTALLED}/include/mauve_rt/mauve_rt.hpp"
    output = folder / "mauve_rt" / "mauve_rt.hpp.gch"
    command = [
        "g++",
        "-std=c++20",
        "-O1",
        "-fPIC",
        f"-I{INSTALLED}/include",
        "-w",
        "-x",
        "c++-header",
        header,
    ]
    subprocess.run([*command, "-o", output], check=True)
    return folder


def install_package(folder: Path, headers: Path, first_build: Path) -> RebuiltPackage:
    """The package as first built, in a prefix below the folder."""
    package = RebuiltPackage(folder / "prefix", folder / "modules", headers)
    (package.prefix / "lib").mkdir(parents=True)
    package.modules.mkdir()
    package.index.parent.mkdir(parents=True)
    packages = package.index.parent.parent / "packages"
    packages.mkdir()
    (packages / "reload_tests").touch()
    shutil.copy(PLUGINS / "reload_tests.txt", package.index)
    shutil.copy(first_build, package.library)
    package.write_core(1.0)
    return package


def search_first(package: RebuiltPackage) -> dict[str, str]:
    """The environment in which the package is found."""
    variables = {"AMENT_PREFIX_PATH": package.prefix, "PYTHONPATH": package.modules}
    return {
        name: os.pathsep.join([str(first), os.environ.get(name, "")]) for name, first in variables.items()
    }
