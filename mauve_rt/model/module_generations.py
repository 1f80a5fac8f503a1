"""Python packages under the name of a generation: `my_robot@2.cores` is `my_robot.cores`, read anew.

The old modules stay in sys.modules, untouched at any moment: threads may run their code and import while new
code is loaded. In the new modules, `import my_robot` means `my_robot@2`, in functions that run later, too.
"""

import builtins
import importlib
import sys
from collections.abc import Collection, Mapping, Sequence
from importlib.abc import InspectLoader, MetaPathFinder
from importlib.machinery import EXTENSION_SUFFIXES, SOURCE_SUFFIXES, ModuleSpec, SourceFileLoader
from pathlib import Path
from threading import RLock
from traceback import walk_tb
from types import CodeType, ModuleType
from typing import Any

from mauve_rt.errors import PluginError, exception_text
from mauve_rt.model.workspace_files import may_be_rebuilt

MARK = "@"
_RESTART = "start the executor again"
_FIRST = 1


def load_module(module: str, *, generation: int, packages: Collection[str]) -> ModuleType:
    """Import a module from its present source, under the name of this generation.

    `packages`: top-level packages (or modules) that belong to the generation; to its other modules, too. The
    new code has all other modules as they are loaded. Generation 1 is the plain import.

    Raises:
        PluginError: it cannot be imported. Nothing of this call is left in sys.modules then.
    """
    importlib.invalidate_caches()  # a file may have been written a moment ago
    try:
        if generation == _FIRST:
            return importlib.import_module(module)
        return _FINDER.load(module, generation, {*packages, module.partition(".")[0]})
    except PluginError:
        raise
    except BaseException as error:
        what = f"cannot load module {module} (generation {generation})"
        raise PluginError(f"{what}: {_place(error)}{exception_text(error)}", element=module) from error


def generation_name(module: str, generation: int) -> str:
    """`my_robot@2.cores` of `my_robot.cores`; of generation 1, the name itself."""
    package, dot, rest = module.partition(".")
    return module if generation == _FIRST else f"{package}{MARK}{generation}{dot}{rest}"


def plain_name(module: str) -> str:
    """`my_robot.cores` of `my_robot@2.cores`, and of itself."""
    package, dot, rest = module.partition(".")
    return f"{package.partition(MARK)[0]}{dot}{rest}"


class _Finder(MetaPathFinder):
    """Finds the modules of all generations. Imports of several threads: the lock is for load() only."""

    def __init__(self) -> None:
        self._packages: dict[int, frozenset[str]] = {}
        self._builtins: dict[int, dict[str, Any]] = {}
        self._lock = RLock()

    def load(self, module: str, generation: int, packages: Collection[str]) -> ModuleType:
        """As load_module()."""
        with self._lock:
            if self not in sys.meta_path:
                sys.meta_path.insert(0, self)
            packages_before = self._packages.get(generation, frozenset())
            before = set(self._names(generation))
            self._packages[generation] = packages_before | set(packages)
            try:
                return importlib.import_module(generation_name(module, generation))
            except BaseException:
                self._packages[generation] = packages_before
                for name in self._names(generation):
                    if name not in before:
                        _forget(name)
                raise

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """The present file of a module of a generation."""
        package, mark, number = fullname.partition(".")[0].partition(MARK)
        if not mark or not number.isdecimal():
            return None
        generation = int(number)
        if package not in self._packages.get(generation, ()):
            return None
        found = self._present_spec(plain_name(fullname), path, target)
        return None if found is None else self._spec(fullname, found, generation)

    def is_of(self, generation: int, module: str) -> bool:
        """Whether a module, by its plain name, belongs to the generation."""
        return module.partition(".")[0] in self._packages.get(generation, ())

    def builtins_of(self, generation: int) -> dict[str, Any]:
        """What the modules of a generation have as `__builtins__`."""
        if generation not in self._builtins:
            self._builtins.setdefault(generation, _builtins_for(self, generation))
        return self._builtins[generation]

    def _present_spec(
        self, module: str, path: Sequence[str] | None, target: ModuleType | None
    ) -> ModuleSpec | None:
        for finder in sys.meta_path:
            find = getattr(finder, "find_spec", None)
            spec: ModuleSpec | None = None
            if finder is not self and find is not None:
                spec = find(module, path, target)
            if spec is not None:
                return spec
        return None

    def _spec(self, fullname: str, found: ModuleSpec, generation: int) -> ModuleSpec:
        folders = found.submodule_search_locations
        file = found.origin or ""
        loader: _SourceLoader | _LoadedModule | None
        if found.has_location and file.endswith(tuple(SOURCE_SUFFIXES)):
            loader = _SourceLoader(fullname, file, self.builtins_of(generation))
        elif found.has_location and file.endswith(tuple(EXTENSION_SUFFIXES)):
            loader = _LoadedModule(found.name, Path(file))
        elif folders is not None and not found.has_location:
            loader = None  # of a namespace package
        else:
            text = (
                f"module {found.name}: expected a source file or an extension module, found {file or 'none'}"
            )
            raise PluginError(text, element=found.name, remedy=_RESTART)
        spec = ModuleSpec(fullname, loader, origin=found.origin, is_package=folders is not None)
        spec.has_location = found.has_location
        if folders is not None:
            spec.submodule_search_locations = list(folders)
        return spec

    @staticmethod
    def _names(generation: int) -> list[str]:
        end = f"{MARK}{generation}"
        return [name for name in list(sys.modules) if name.partition(".")[0].endswith(end)]


class _SourceLoader(SourceFileLoader):
    """Compiles the source, always: a .pyc is valid by second and size, which a quick rebuild may keep."""

    def __init__(self, fullname: str, path: str, of_generation: dict[str, Any]) -> None:
        super().__init__(fullname, path)
        self._builtins = of_generation

    def get_code(self, fullname: str) -> CodeType:
        """The code of the present source; no .pyc is read or written."""
        path = self.get_filename(fullname)
        code: CodeType = self.source_to_code(self.get_data(path), path)
        return code

    def exec_module(self, module: ModuleType) -> None:
        """Run the module. Its functions take `__import__` from these builtins, whenever they run."""
        code = self.get_code(module.__name__)
        module.__dict__["__builtins__"] = self._builtins
        exec(code, module.__dict__)  # noqa: S102 - this is an import


class _LoadedModule(InspectLoader):
    """Stands for an extension module, which a process can load once only: the loaded one, if unchanged."""

    def __init__(self, module: str, file: Path) -> None:
        self._module, self._file = module, file

    def create_module(self, spec: ModuleSpec) -> None:
        """A plain module, which exec_module() replaces."""

    def exec_module(self, module: ModuleType) -> None:
        """Put the loaded module into its place."""
        if self._module in sys.modules and not _is_mapped(self._file):
            text = f"extension module {self._module}: {self._file} was changed since this process loaded it"
            raise PluginError(text, element=self._module, remedy=_RESTART)
        sys.modules[module.__name__] = importlib.import_module(self._module)

    def get_source(self, fullname: str) -> None:
        """It has none."""


def _builtins_for(finder: _Finder, generation: int) -> dict[str, Any]:
    """The builtins with an `__import__` that knows the generation's packages."""
    present = builtins.__dict__.copy()
    proxy = _importlib_for(finder, generation)

    def import_of_generation(
        name: str,
        globals: Mapping[str, object] | None = None,  # noqa: A002 - the names of __import__
        locals: Mapping[str, object] | None = None,  # noqa: A002
        fromlist: Sequence[str] | None = (),
        level: int = 0,
    ) -> ModuleType:
        if level == 0 and finder.is_of(generation, name):
            name = generation_name(name, generation)
        found = builtins.__import__(name, globals, locals, fromlist or (), level)
        return proxy if found is importlib else found

    present["__import__"] = import_of_generation
    return present


def _importlib_for(finder: _Finder, generation: int) -> ModuleType:
    """The module importlib with an import_module() that knows the generation's packages."""

    def import_module(name: str, package: str | None = None) -> ModuleType:
        of_it = finder.is_of(generation, name)  # a relative name begins with a dot
        return importlib.import_module(generation_name(name, generation) if of_it else name, package)

    proxy = ModuleType(importlib.__name__, importlib.__doc__)
    proxy.__dict__.update(importlib.__dict__)
    proxy.__dict__["import_module"] = import_module
    proxy.__dict__["__getattr__"] = lambda name: getattr(importlib, name)  # submodules that are loaded later
    return proxy


def _forget(name: str) -> None:
    module = sys.modules.pop(name, None)
    parent, _, child = name.rpartition(".")
    if module is not None and vars(sys.modules.get(parent, builtins)).get(child) is module:
        delattr(sys.modules[parent], child)


def _is_mapped(file: Path) -> bool:
    """Whether this process has loaded the present file: the path of a replaced one ends with `(deleted)`."""
    lines = Path("/proc/self/maps").read_text(errors="surrogateescape").splitlines()
    path = str(file.resolve())
    return any(line.endswith(path) and line.split(maxsplit=5)[-1] == path for line in lines)


def _place(error: BaseException) -> str:
    """`FILE:LINE: `, of the innermost line of the user's code; empty: no such line ran."""
    places = [(frame.f_code.co_filename, line) for frame, line in walk_tb(error.__traceback__)]
    users = [(file, line) for file, line in places if _is_of_user(Path(file))]
    return "{}:{}: ".format(*users[-1]) if users else ""


def _is_of_user(file: Path) -> bool:
    return file.is_file() and may_be_rebuilt(file) and not file.is_relative_to(Path(__file__).parents[1])


_FINDER = _Finder()
