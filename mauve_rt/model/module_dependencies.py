"""Which packages of a workspace a loaded module uses, and the files that they were loaded from."""

import ast
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

from mauve_rt.model.module_generations import MARK
from mauve_rt.model.workspace_files import may_be_rebuilt

_NOT_FOLLOWED = frozenset({*sys.stdlib_module_names, *sys.builtin_module_names, "mauve_rt", "mauve_msgs"})


def module_dependencies(module: str) -> dict[str, list[Path]]:
    """The top-level packages that a loaded module uses, directly or not, each with its loaded files.

    Its own package comes first, wherever it stands. Modules of the standard library, of this Python's
    site-packages and of MAUVE RT are left out. A module uses what its global objects come from, and what its
    source imports: a constant does not tell where it comes from. Of a module of a generation
    (`my_robot@2.cores`), the packages have the names of that generation, as far as they belong to it.
    """
    own = module.partition(".")[0]
    generation = "".join(own.partition(MARK)[1:])
    reached = {own: _loaded(own)}
    waiting = list(reached[own].values())
    while waiting:
        for name in _used(waiting.pop()):
            package = name.partition(".")[0]
            if package + generation in sys.modules:  # sources have the plain name
                package += generation
            if package in reached or package in _NOT_FOLLOWED:
                continue
            loaded = _loaded(package)
            if any(may_be_rebuilt(file) for each in loaded.values() for file in _files(each)):
                reached[package] = loaded
                waiting += loaded.values()
    return {
        package: sorted({file for each in loaded.values() for file in _files(each)})
        for package, loaded in reached.items()
    }


def _loaded(package: str) -> dict[str, ModuleType]:
    below = f"{package}."
    modules = list(sys.modules.items())  # other threads may import
    return {name: each for name, each in modules if name == package or name.startswith(below)}


def _files(module: ModuleType) -> Iterator[Path]:
    file = getattr(module, "__file__", None)
    if isinstance(file, str):
        yield Path(file)


def _used(module: ModuleType) -> Iterator[str]:
    """Names of modules, some of them more than once, in the order of use."""
    for value in list(vars(module).values()):
        name = value.__name__ if isinstance(value, ModuleType) else _module_of(value)
        if isinstance(name, str):
            yield name
    for file in _files(module):
        if file.suffix == ".py":
            yield from _imported(file)


def _module_of(value: object) -> object:
    try:
        return getattr(value, "__module__", None)
    except Exception:  # noqa: BLE001 - of an object that somebody else wrote
        return None


def _imported(file: Path) -> Iterator[str]:
    """What a source imports by absolute names, in its functions, too."""
    try:
        tree = ast.parse(file.read_bytes())
    except (OSError, SyntaxError, ValueError):
        return
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield node.module
