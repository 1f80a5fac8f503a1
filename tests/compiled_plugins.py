"""Compiles plug-ins of the tests against the installed kernel: by ccache where there is one."""

import fcntl
import os
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path

from mauve_rt import _kernel

ROOT = Path(__file__).resolve().parents[1]
PLUGINS = Path(__file__).parent / "plugins"
INSTALLED = (
    Path(_kernel.__file__).resolve().parents[4]
)  # PREFIX/lib/pythonX.Y/site-packages/mauve_rt/_kernel...so
BUILD = ROOT / "build" / "test-plugins"  # in the clone: so clones share what ccache keeps
FLAGS = ("-std=c++20", "-O1", "-fPIC", f"-I{INSTALLED}/include")


def _compile(*words: str | Path, hashed: Sequence[Path] = ()) -> None:
    """By ccache, which takes a change of the files `hashed` for one of the source."""
    launcher = [ccache] if (ccache := shutil.which("ccache")) else []
    settings = {
        "CCACHE_BASEDIR": str(ROOT),
        "CCACHE_EXTRAFILES": os.pathsep.join(map(str, hashed)),
        "CCACHE_NOHASHDIR": "1",
        "CCACHE_SLOPPINESS": "pch_defines,time_macros",
    }
    subprocess.run([*launcher, "g++", *FLAGS, *words], check=True, cwd=BUILD, env=os.environ | settings)


@contextmanager
def _alone() -> Iterator[None]:
    """One process of tests at a time: the next one finds in ccache what this one compiles."""
    BUILD.mkdir(parents=True, exist_ok=True)
    with (BUILD / ".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


@cache
def _precompiled() -> Path:
    """The kernel's headers, precompiled where that is older than one of them: to be included by this name."""
    header = BUILD / "mauve_rt.hpp"
    output = BUILD / "mauve_rt.hpp.gch"
    with _alone():
        headers = sorted((INSTALLED / "include" / "mauve_rt").rglob("*.hpp"))
        newest = max(file.stat().st_mtime for file in headers)
        if not output.exists() or output.stat().st_mtime <= newest:
            header.write_text("#include <mauve_rt/mauve_rt.hpp>\n", encoding="utf-8")
            new = BUILD / "new.gch"
            # Of a precompiled header, ccache (pch_defines) does not see that only a macro has changed.
            _compile("-w", "-x", "c++-header", header, "-o", new, hashed=headers)
            new.replace(output)
    return header


def compile_source(source: Path, output: Path, *flags: str) -> None:
    """Compile one source into an object."""
    with_kernel = (
        ["-fpch-preprocess", "-include", _precompiled()] if "mauve" in source.read_text("utf-8") else []
    )
    with _alone():
        _compile(*with_kernel, *flags, "-c", source, "-o", output)


def link(objects: Sequence[Path], library: Path, *flags: str) -> None:
    """Link objects to a plug-in library."""
    words = [f"-L{INSTALLED}/lib", "-lmauve_rt", f"-Wl,-rpath,{INSTALLED}/lib", *flags]
    subprocess.run(["g++", "-shared", *objects, "-o", library, *words], check=True)


def compile_plugin(source: Path, library: Path) -> None:
    """One library of one source."""
    compiled = library.with_suffix(".o")
    compile_source(source, compiled)
    link([compiled], library)


def install_plugins(prefix: Path, package: str) -> None:
    """Compile `plugins/PACKAGE.cpp` and list what PACKAGE.txt says, in an ament prefix."""
    list_plugins(prefix, package)
    (prefix / "lib").mkdir(exist_ok=True)
    compile_plugin(PLUGINS / f"{package}.cpp", prefix / "lib" / f"lib{package}.so")


def list_plugins(prefix: Path, package: str) -> None:
    """List what `plugins/PACKAGE.txt` says, in an ament prefix."""
    index = prefix / "share" / "ament_index" / "resource_index"
    (prefix / "share" / package).mkdir(parents=True)
    for kind in ("packages", "mauve_rt_plugins"):
        (index / kind).mkdir(parents=True, exist_ok=True)
    (index / "packages" / package).touch()
    shutil.copy(PLUGINS / f"{package}.txt", index / "mauve_rt_plugins" / package)
