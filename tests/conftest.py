"""What stages share: a small package of plug-ins, compiled once a session."""

import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from mauve_rt import _kernel

PLUGINS = Path(__file__).parent / "plugins"
INSTALLED = (
    Path(_kernel.__file__).resolve().parents[4]
)  # PREFIX/lib/pythonX.Y/site-packages/mauve_rt/_kernel...so


def _install_plugins(prefix: Path, package: str) -> None:
    """Compile `plugins/PACKAGE.cpp` and list what PACKAGE.txt says, in an ament prefix."""
    index = prefix / "share" / "ament_index" / "resource_index"
    (prefix / "lib").mkdir(exist_ok=True)
    (prefix / "share" / package).mkdir(parents=True)
    for kind in ("packages", "mauve_rt_plugins"):
        (index / kind).mkdir(parents=True, exist_ok=True)
    (index / "packages" / package).touch()
    shutil.copy(PLUGINS / f"{package}.txt", index / "mauve_rt_plugins" / package)
    library = prefix / "lib" / f"lib{package}.so"
    subprocess.run(
        [
            *("g++", "-std=c++20", "-O1", "-shared", "-fPIC", PLUGINS / f"{package}.cpp", "-o", library),
            *(f"-I{INSTALLED}/include", f"-L{INSTALLED}/lib", "-lmauve_rt", f"-Wl,-rpath,{INSTALLED}/lib"),
        ],
        check=True,
    )


@pytest.fixture(scope="session")
def misfits_prefix(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An ament prefix with the package misfits, which is searched only where a test says so."""
    prefix = tmp_path_factory.mktemp("misfits")
    _install_plugins(prefix, "misfits")
    return prefix


@pytest.fixture(scope="session")
def plugin_prefix(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """An ament prefix with the package executor_tests, put in front of those searched."""
    prefix = tmp_path_factory.mktemp("executor_tests")
    _install_plugins(prefix, "executor_tests")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(
            "AMENT_PREFIX_PATH", os.pathsep.join([str(prefix), os.environ.get("AMENT_PREFIX_PATH", "")])
        )
        patch.setenv("PYTHONPATH", os.pathsep.join([str(PLUGINS), os.environ.get("PYTHONPATH", "")]))
        patch.syspath_prepend(str(PLUGINS))
        yield prefix
