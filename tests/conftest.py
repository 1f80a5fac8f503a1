"""What stages share: a small package of plug-ins, compiled once a session."""

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from rebuilt_package import RebuiltPackage, compile_plugin, install_package, precompile, search_first

from mauve_rt import _kernel
from mauve_rt.control.runtime import Runtime
from mauve_rt.model.generations import CodeGenerations
from mauve_rt.model.loaded_code import LoadedCode
from mauve_rt.model.plugins import PluginLoader

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
def rebuilt_headers(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The precompiled headers of packages that tests build again."""
    return precompile(tmp_path_factory.mktemp("headers"))


@pytest.fixture(scope="session")
def first_build(tmp_path_factory: pytest.TempPathFactory, rebuilt_headers: Path) -> Path:
    """The library of reload_tests as it is loaded first."""
    library = tmp_path_factory.mktemp("reload_tests") / "libreload_tests.so"
    compile_plugin(rebuilt_headers, PLUGINS / "reload_tests.cpp", library)
    return library


@pytest.fixture
def rebuilt(
    tmp_path: Path, rebuilt_headers: Path, first_build: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[RebuiltPackage]:
    """The package reload_tests, which a test builds again; searched first."""
    package = install_package(tmp_path, rebuilt_headers, first_build)
    package.build_other()
    for name, value in search_first(package).items():
        monkeypatch.setenv(name, value)
    monkeypatch.syspath_prepend(str(package.modules))
    loaded = LoadedCode()  # another test's package of the same name has nothing to do with this one
    for owner, name, value in (
        (Runtime, "registry", _kernel.PluginRegistry()),
        (PluginLoader, "_loaded", loaded),
        (PluginLoader, "_sources", {}),
        (PluginLoader, "generations", CodeGenerations(loaded)),
    ):
        monkeypatch.setattr(owner, name, value)
    yield package
    for name in [name for name in sys.modules if name.startswith("reload_tests_")]:
        del sys.modules[name]


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
