"""Modules read anew under the name of a generation, while the old ones stay as they are."""

import itertools
import os
import shutil
import subprocess
import sys
import sysconfig
import threading
from collections.abc import Callable, Iterator
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path
from types import ModuleType

import pytest

from mauve_rt.errors import PluginError
from mauve_rt.model.module_dependencies import module_dependencies
from mauve_rt.model.module_generations import generation_name, load_module, plain_name

PACKAGES = ("my_robot", "my_helpers", "my_core", "my_space")
_NUMBERS = itertools.count(100)


@pytest.fixture
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.syspath_prepend(tmp_path)
    yield tmp_path
    for name in list(sys.modules):
        if plain_name(name).partition(".")[0] in PACKAGES:
            del sys.modules[name]


@pytest.fixture
def number() -> int:
    """A generation that no other test has used."""
    return next(_NUMBERS)


def _write(folder: Path, **sources: str) -> None:
    """Write `my_robot/cores.py` for the argument my_robot__cores, `__init__.py` for init."""
    for name, text in sources.items():
        *folders, module = name.split("__")
        file = folder.joinpath(*folders, "__init__.py" if module == "init" else f"{module}.py")
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")


def _plain_modules() -> dict[str, ModuleType]:
    return {name: sys.modules[name] for name in sys.modules if name.partition(".")[0] in PACKAGES}


def _of_generation(number: int) -> list[str]:
    return [name for name in sys.modules if f"@{number}" in name]


def test_names() -> None:
    assert generation_name("my_robot.cores.fast", 2) == "my_robot@2.cores.fast"
    assert generation_name("my_robot.cores", 1) == "my_robot.cores"
    assert plain_name("my_robot@2.cores.fast") == "my_robot.cores.fast"
    assert plain_name("my_robot") == "my_robot"


def test_first_generation_is_the_plain_import(workspace: Path) -> None:
    _write(workspace, my_core="GAIN = 1")
    assert load_module("my_core", generation=1, packages=[]) is sys.modules["my_core"]


def test_same_size_within_the_same_second(workspace: Path, number: int) -> None:
    """A .pyc would count as valid."""
    _write(workspace, my_robot__init="", my_robot__cores="GAIN = 1\n")
    file = workspace / "my_robot" / "cores.py"
    stat = file.stat()
    old = load_module("my_robot.cores", generation=1, packages=[])
    file.write_text("GAIN = 2\n", encoding="utf-8")
    os.utime(file, ns=(stat.st_atime_ns, stat.st_mtime_ns))
    before = set(workspace.rglob("*.pyc"))
    new = load_module("my_robot.cores", generation=number, packages=["my_robot"])
    assert (old.GAIN, new.GAIN) == (1, 2)
    assert new.__name__ == f"my_robot@{number}.cores"
    assert sys.modules["my_robot.cores"] is old
    assert set(workspace.rglob("*.pyc")) == before


def test_helpers_of_the_package_and_another_package(workspace: Path, number: int) -> None:
    cores = "from .gains import GAIN\nfrom my_robot.gains import GAIN as ABSOLUTE\nimport my_helpers.limits\n"
    cores += (
        "import my_helpers.limits as limits\nLIMIT = my_helpers.limits.LIMIT\nfrom my_robot import gains\n"
    )
    _write(workspace, my_robot__init="from . import gains", my_robot__gains="GAIN = 1", my_robot__cores=cores)
    _write(workspace, my_helpers__init="", my_helpers__limits="LIMIT = 10")
    old = load_module("my_robot.cores", generation=1, packages=[])
    modules = _plain_modules()
    _write(workspace, my_robot__gains="GAIN = 2", my_helpers__limits="LIMIT = 20")
    new = load_module("my_robot.cores", generation=number, packages=["my_robot", "my_helpers"])
    assert [old.GAIN, old.ABSOLUTE, old.LIMIT, old.limits.LIMIT, old.gains.GAIN] == [1, 1, 10, 10, 1]
    assert [new.GAIN, new.ABSOLUTE, new.LIMIT, new.limits.LIMIT, new.gains.GAIN] == [2, 2, 20, 20, 2]
    assert _plain_modules() == modules


def test_packages_outside_of_the_generation_are_shared(workspace: Path, number: int) -> None:
    _write(workspace, my_robot__init="", my_robot__cores="import my_helpers, json, os.path")
    _write(workspace, my_helpers__init="")
    old = load_module("my_robot.cores", generation=1, packages=[])
    new = load_module("my_robot.cores", generation=number, packages=["my_robot"])
    assert new.my_helpers is old.my_helpers
    assert (new.json, new.os) == (sys.modules["json"], os)


@pytest.mark.parametrize(
    "import_it",
    [
        "from my_robot.lazy import VALUE",
        "from .lazy import VALUE",
        "from . import lazy; VALUE = lazy.VALUE",
        "import my_robot.lazy; VALUE = my_robot.lazy.VALUE",
        "import my_robot.lazy as lazy; VALUE = lazy.VALUE",
        "import importlib; VALUE = importlib.import_module('my_robot.lazy').VALUE",
        "from importlib import import_module; VALUE = import_module('.lazy', __package__).VALUE",
        "import importlib.util; VALUE = importlib.import_module('my_robot.lazy').VALUE",
        "VALUE = __import__('my_robot.lazy').lazy.VALUE",
        "exec('from my_robot.lazy import VALUE', globals()); VALUE = globals()['VALUE']",
    ],
)
def test_lazy_imports_after_the_reload(workspace: Path, number: int, import_it: str) -> None:
    function = f"def value():\n    {import_it}\n    return VALUE\n"
    _write(workspace, my_robot__init="", my_robot__cores=function, my_robot__lazy="VALUE = 1")
    old = load_module("my_robot.cores", generation=1, packages=[])
    assert old.value() == 1
    _write(workspace, my_robot__lazy="VALUE = 2")
    new = load_module("my_robot.cores", generation=number, packages=["my_robot"])
    found: list[int] = []
    thread = threading.Thread(target=lambda: found.append(new.value()))
    thread.start()
    thread.join()
    assert (found, new.value(), old.value()) == ([2], 2, 1)


def test_two_generations_at_once(workspace: Path) -> None:
    _write(workspace, my_robot__init="", my_robot__gains="GAIN = 1")
    _write(workspace, my_robot__cores="def gain():\n    from my_robot.gains import GAIN\n    return GAIN\n")
    modules = [load_module("my_robot.cores", generation=1, packages=[])]
    assert modules[0].gain() == 1
    for gain in (2, 3):
        _write(workspace, my_robot__gains=f"GAIN = {gain}")
        number = next(_NUMBERS)
        modules.append(load_module("my_robot.cores", generation=number, packages=["my_robot"]))
        assert modules[-1].gain() == gain
    assert [module.gain() for module in modules] == [1, 2, 3]


def test_more_modules_of_one_generation(workspace: Path, number: int) -> None:
    _write(workspace, my_robot__init="", my_robot__cores="from my_robot import fsms", my_robot__fsms="")
    cores = load_module("my_robot.cores", generation=number, packages=["my_robot"])
    assert load_module("my_robot.fsms", generation=number, packages=["my_robot"]) is cores.fsms
    assert load_module("my_robot.cores", generation=number, packages=["my_robot"]) is cores


def test_plain_module(workspace: Path, number: int) -> None:
    _write(workspace, my_core="GAIN = 1")
    load_module("my_core", generation=1, packages=[])
    _write(workspace, my_core="GAIN = 2")
    assert load_module("my_core", generation=number, packages=["my_core"]).GAIN == 2
    assert sys.modules["my_core"].GAIN == 1


def test_namespace_package(workspace: Path, number: int) -> None:
    _write(
        workspace, my_space__cores="from my_space.more.gains import GAIN", my_space__more__gains="GAIN = 1"
    )
    old = load_module("my_space.cores", generation=1, packages=[])
    _write(workspace, my_space__more__gains="GAIN = 2")
    new = load_module("my_space.cores", generation=number, packages=["my_space"])
    assert (old.GAIN, new.GAIN) == (1, 2)


def test_package_that_another_finder_finds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, workspace: Path, number: int
) -> None:
    """As an editable install is found."""
    elsewhere = tmp_path / "elsewhere"
    _write(elsewhere, my_robot__init="", my_robot__cores="from my_robot.gains import GAIN")
    _write(elsewhere, my_robot__gains="GAIN = 1")

    class Finder:
        @staticmethod
        def find_spec(name: str, *_: object) -> ModuleSpec | None:
            return PathFinder.find_spec(name, [str(elsewhere)]) if name == "my_robot" else None

    monkeypatch.setattr(sys, "meta_path", [*sys.meta_path, Finder])
    old = load_module("my_robot.cores", generation=1, packages=[])
    _write(elsewhere, my_robot__gains="GAIN = 2")
    new = load_module("my_robot.cores", generation=number, packages=["my_robot"])
    assert (old.GAIN, new.GAIN) == (1, 2)


def test_dataclass_and_enum(workspace: Path, number: int) -> None:
    text = """
import enum, pickle, typing
from dataclasses import dataclass, field
class Mode(enum.Enum):
    IDLE = 1
@dataclass(slots=True)
class State:
    mode: "Mode" = Mode.IDLE
    seen: list[int] = field(default_factory=list)
HINTS = typing.get_type_hints(State)
COPY = pickle.loads(pickle.dumps(State(Mode.IDLE, [1])))
"""
    _write(workspace, my_robot__init="", my_robot__parts=text)
    old = load_module("my_robot.parts", generation=1, packages=[])
    new = load_module("my_robot.parts", generation=number, packages=["my_robot"])
    assert new.State is not old.State
    assert new.HINTS["mode"] is new.Mode
    assert new.State(new.Mode.IDLE, [1]) == new.COPY
    assert new.Mode.__module__ == f"my_robot@{number}.parts"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("def broken(:\n", "SyntaxError"),
        ("x = 1\nraise ValueError('no map')", "cores.py:3: ValueError: no map"),
        ("import my_robot.nothing", "ModuleNotFoundError"),
        ("raise SystemExit(1)", "cores.py:2: SystemExit: 1"),
    ],
)
def test_failing_import_leaves_nothing(workspace: Path, number: int, text: str, message: str) -> None:
    _write(workspace, my_robot__init="", my_robot__gains="", my_robot__cores="GAIN = 1")
    old = load_module("my_robot.cores", generation=1, packages=[])
    modules = _plain_modules()
    _write(workspace, my_robot__cores=f"import my_robot.gains\n{text}")
    with pytest.raises(PluginError, match=r"cannot load module my_robot.cores \(generation") as caught:
        load_module("my_robot.cores", generation=number, packages=["my_robot"])
    assert message in str(caught.value)
    assert _of_generation(number) == []
    assert _plain_modules() == modules
    assert old.GAIN == 1
    _write(workspace, my_robot__cores="GAIN = 2")
    assert load_module("my_robot.cores", generation=number, packages=["my_robot"]).GAIN == 2


def test_failing_import_keeps_what_the_generation_has(workspace: Path, number: int) -> None:
    _write(workspace, my_robot__init="", my_robot__cores="", my_robot__gains="")
    _write(workspace, my_robot__fsms="import my_robot.gains\nraise ValueError")
    cores = load_module("my_robot.cores", generation=number, packages=["my_robot"])
    names = _of_generation(number)
    with pytest.raises(PluginError):
        load_module("my_robot.fsms", generation=number, packages=["my_robot"])
    assert _of_generation(number) == names
    assert not hasattr(sys.modules[f"my_robot@{number}"], "gains")
    assert load_module("my_robot.cores", generation=number, packages=["my_robot"]) is cores


@pytest.fixture
def build_extension(workspace: Path) -> Callable[[int], None]:
    """Build the extension module my_robot._native, a new file each time."""
    compiler = shutil.which("gcc")
    include = sysconfig.get_path("include")
    if compiler is None or not (Path(include) / "Python.h").is_file():
        pytest.skip("needs gcc and Python.h")

    def build(value: int) -> None:
        _write(workspace, my_robot__init="", my_robot__cores="from my_robot import _native")
        source = workspace / "native.c"
        source.write_text(
            "#include <Python.h>\n"
            'static struct PyModuleDef def = {PyModuleDef_HEAD_INIT, "_native", 0, -1, 0};\n'
            "PyMODINIT_FUNC PyInit__native(void) { PyObject *module = PyModule_Create(&def);\n"
            f'  PyModule_AddIntConstant(module, "VALUE", {value}); return module; }}\n',
            encoding="utf-8",
        )
        built = workspace / "built.so"
        subprocess.run([compiler, "-shared", "-fPIC", f"-I{include}", source, "-o", built], check=True)
        built.replace(workspace / "my_robot" / f"_native{sysconfig.get_config_var('EXT_SUFFIX')}")

    return build


def test_extension_module(workspace: Path, build_extension: Callable[[int], None]) -> None:
    build_extension(1)
    old = load_module("my_robot.cores", generation=1, packages=[])
    spec = old._native.__spec__
    new = load_module("my_robot.cores", generation=next(_NUMBERS), packages=["my_robot"])
    assert new._native is old._native
    assert (new._native.VALUE, new._native.__spec__) == (1, spec)
    build_extension(2)
    number = next(_NUMBERS)
    with pytest.raises(
        PluginError, match="was changed since this process loaded it; start the executor again"
    ):
        load_module("my_robot.cores", generation=number, packages=["my_robot"])
    assert (_of_generation(number), old._native.VALUE) == ([], 1)


def test_old_code_imports_lazily_during_many_loads(workspace: Path) -> None:
    function = "def gain():\n    import my_robot.gains\n    from my_robot.gains import GAIN\n"
    function += "    from . import gains\n    return GAIN + my_robot.gains.GAIN + gains.GAIN\n"
    _write(
        workspace, my_robot__init="from . import cores", my_robot__gains="GAIN = 1", my_robot__cores=function
    )
    old = load_module("my_robot.cores", generation=1, packages=[])
    assert old.gain() == 3
    ends, found, errors = threading.Event(), set(), []

    def run() -> None:
        try:
            while not ends.is_set():
                found.add(old.gain())
        except BaseException as error:  # noqa: BLE001 - a test's thread
            errors.append(error)

    thread = threading.Thread(target=run)
    thread.start()
    try:
        for gain in range(2, 102):
            _write(workspace, my_robot__gains=f"GAIN = {gain}")
            new = load_module("my_robot.cores", generation=next(_NUMBERS), packages=["my_robot"])
            assert new.gain() == 3 * gain
    finally:
        ends.set()
        thread.join()
    assert (found, errors) == ({3}, [])


def test_dependencies(workspace: Path) -> None:
    cores = (
        "import json\nimport pytest\nfrom mauve_rt.errors import PluginError\nfrom my_helpers import Limits\n"
    )
    _write(workspace, my_robot__init="", my_robot__cores=cores, my_robot__unused="")
    _write(workspace, my_helpers__init="class Limits: ...\nfrom my_core import GAIN\n", my_core="GAIN = 1")
    load_module("my_robot.cores", generation=1, packages=[])
    found = module_dependencies("my_robot.cores")
    names = {
        package: [str(file.relative_to(workspace)) for file in files] for package, files in found.items()
    }
    assert names == {
        "my_robot": ["my_robot/__init__.py", "my_robot/cores.py"],
        "my_helpers": ["my_helpers/__init__.py"],
        "my_core": ["my_core.py"],
    }


def test_dependencies_of_objects_and_within_functions(workspace: Path) -> None:
    _write(workspace, my_helpers__init="from my_core import Limits\nLIMITS = Limits()\n")
    _write(workspace, my_core="class Limits: ...\n", my_space__gains="GAIN = 1")
    text = "import sys\nLIMITS = sys.modules['my_helpers'].LIMITS\ndef gain():\n    import my_space.gains\n"
    _write(workspace, my_robot__init=text)
    load_module("my_helpers", generation=1, packages=[])
    robot = load_module("my_robot", generation=1, packages=[])
    assert list(module_dependencies("my_robot")) == ["my_robot", "my_core"]
    robot.gain()
    assert list(module_dependencies("my_robot")) == ["my_robot", "my_core", "my_space"]


def test_dependencies_of_a_generation(workspace: Path, number: int) -> None:
    _write(workspace, my_robot__init="from my_helpers import GAIN\nimport my_core", my_core="")
    _write(workspace, my_helpers__init="GAIN = 1")
    load_module("my_robot", generation=1, packages=[])
    load_module("my_robot", generation=number, packages=["my_robot", "my_helpers"])
    found = module_dependencies(f"my_robot@{number}")
    assert sorted(found) == ["my_core", f"my_helpers@{number}", f"my_robot@{number}"]
