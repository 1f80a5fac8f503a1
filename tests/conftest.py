"""What stages share: a small package of plug-ins, compiled once a session."""

import os
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from compiled_plugins import PLUGINS, install_plugins, list_plugins
from rebuilt_package import RebuiltPackage, install_package, search_first

from mauve_rt import _kernel
from mauve_rt.control.runtime import Runtime
from mauve_rt.model.generations import CodeGenerations
from mauve_rt.model.loaded_code import LoadedCode
from mauve_rt.model.plugins import PluginLoader


@pytest.fixture(scope="session")
def builds(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What tests have compiled of the package that they build again."""
    return tmp_path_factory.mktemp("builds")


@pytest.fixture
def rebuilt(tmp_path: Path, builds: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[RebuiltPackage]:
    """The package reload_tests, which a test builds again; searched first."""
    package = install_package(tmp_path, builds)
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
    install_plugins(prefix, "misfits")
    return prefix


@pytest.fixture(scope="session")
def action_prefix(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An ament prefix with the package action_tests, all in Python; searched only where a test says so."""
    prefix = tmp_path_factory.mktemp("action_tests")
    list_plugins(prefix, "action_tests")
    return prefix


@pytest.fixture(scope="session")
def plugin_prefix(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """An ament prefix with the package executor_tests, put in front of those searched."""
    prefix = tmp_path_factory.mktemp("executor_tests")
    install_plugins(prefix, "executor_tests")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(
            "AMENT_PREFIX_PATH", os.pathsep.join([str(prefix), os.environ.get("AMENT_PREFIX_PATH", "")])
        )
        patch.setenv("PYTHONPATH", os.pathsep.join([str(PLUGINS), os.environ.get("PYTHONPATH", "")]))
        patch.syspath_prepend(str(PLUGINS))
        yield prefix
