"""Generations of code: rebuilt code is tried, compared, and loaded in addition to the old code.

Nothing that is loaded is ever closed, so a way back costs no build. A generation is all that one reload has
loaded. Its parts are in force for the registry: whatever is made from then on is of the newest generation.
"""

import os
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

from mauve_rt._kernel import PluginGeneration, PluginRegistry
from mauve_rt.errors import PluginError
from mauve_rt.model.base_classes import check_base_classes, derived_shells
from mauve_rt.model.code_layouts import check_types, is_same_shell
from mauve_rt.model.loaded_code import LoadedCode, Stamps
from mauve_rt.scratch import code_folder

MARK = "@"  # in the names of copies and modules of a generation
PART_KINDS = ("shell", "core", "fsm", "resource")
_FIRST = 1

Name = tuple[str, str]
"""Kind and name of a plug-in."""


@dataclass(frozen=True, kw_only=True)
class Source:
    """A library or a module that was loaded, with what it registers."""

    target: str
    names: frozenset[Name]
    is_python: bool


def names_of(sources: Iterable[Source]) -> frozenset[Name]:
    """All that these sources register."""
    return frozenset(name for source in sources for name in source.names)


@dataclass(frozen=True, kw_only=True)
class Generation:
    """What one reload has loaded. `kept`: the entries of the registry that are not in force."""

    number: int
    sources: tuple[str, ...]
    names: frozenset[Name]
    loaded: tuple[str, ...]  # libraries and modules
    outdated: tuple[Name, ...]  # of other libraries, compiled for a shell as it was
    kept: PluginGeneration
    stamps: Stamps
    packages_before: Mapping[str, tuple[int, tuple[str, ...]]]


@dataclass(frozen=True, kw_only=True)
class _Candidate:
    copy_number: int
    sources: tuple[Source, ...]
    libraries: tuple[Path, ...]  # copies and what they need, in the order to open
    copied: frozenset[Path]  # the libraries themselves
    plugins: frozenset[str]  # file names of the copies that register plug-ins
    modules: Mapping[str, tuple[str, ...]]  # module: packages of the generation
    stamps: Stamps
    outdated: tuple[Name, ...]  # of other libraries, written for a shell as it was


class CodeGenerations:
    """The generations of one process. Not thread-safe: for who holds the registry."""

    _copies = _FIRST  # of the process: in the names of what was loaded last, be it in force or not

    def __init__(self, loaded: LoadedCode) -> None:
        self._loaded = loaded
        self._history: list[Generation] = []
        self._gone_back: set[str] = set()  # sources whose newest build is loaded, and not in force
        self._copied: set[Path] = set()  # libraries of which the first one is no longer in force
        self._packages: dict[str, tuple[int, tuple[str, ...]]] = {}  # by top-level package
        self.outdated: dict[Name, str] = {}
        self._newest = _FIRST  # number of the last generation that was in force

    def rebuilt(self, sources: Collection[Source]) -> dict[str, list[Path]]:
        """The files that were changed since they were loaded, by source; none of a source that was not.

        Raises:
            PluginError: a file is no complete library.
        """
        needed = self._needed_libraries(sources)
        found = {}
        for source in sources:
            others = self.module_files(source.target) if source.is_python else needed.get(source.target, ())
            files = self._loaded.changed_files(source.target, others)
            if files or source.target in self._gone_back:
                found[source.target] = files
        return found

    def load(
        self,
        sources: Sequence[Source],
        registry: PluginRegistry,
        *,
        in_use: Collection[Name],
        in_python: Collection[Name],
        source_of: Callable[[str, str], str],
        add_python_parts: Any,
        dry_run: bool = False,
    ) -> Generation | None:
        """Try rebuilt code in a process of its own, then load it and put it in force in the registry.

        `in_use`: parts that components have now, which the new code has to have, too.
        `in_python`: parts that are no C++ classes. `source_of(kind, name)`: from where a part was loaded.
        `add_python_parts(module, loaded_module)` registers the parts of a Python module.

        Returns None after a dry run.

        Raises:
            PluginError: nothing has changed for this process then, but for code that is never called.
        """
        with ExitStack() as stack:
            folder = None
            if not all(source.is_python for source in sources):
                folder = stack.enter_context(_folder_of_copies())
            candidate = self._try(
                sources,
                registry,
                in_use=in_use,
                in_python=in_python,
                source_of=source_of,
                folder=folder,
            )
            if dry_run:
                return None
            kept = PluginGeneration()
            number = self._newest + 1
            registry.begin_generation(number, kept)
            before = dict(self._packages)
            try:
                self._open(candidate, number, registry, add_python_parts)
            except BaseException:
                registry.end_generation()
                registry.exchange(kept)
                self._packages = before
                raise
            registry.end_generation()
        return self._keep(candidate, number, kept, before)

    def undo(self, generation: Generation, registry: PluginRegistry) -> None:
        """Put the code of before in force again: a generation that was loaded last is forgotten."""
        registry.exchange(generation.kept)
        self._packages = dict(generation.packages_before)
        self._history.remove(generation)

    def commit(self, generation: Generation) -> None:
        """The generation's parts run: its files are the loaded ones now, and its number is used up."""
        self._newest = generation.number
        self._loaded.renew(generation.stamps)
        self._gone_back -= {*generation.sources}
        for name in generation.names:
            self.outdated.pop(name, None)
        text = "it was compiled for a shell that has other members by now"
        self.outdated.update(dict.fromkeys(generation.outdated, text))

    def last(self, sources: Collection[str]) -> Generation | None:
        """The newest generation in force that has loaded one of these sources."""
        return next((each for each in reversed(self._history) if {*each.sources} & {*sources}), None)

    def go_back(self, generation: Generation, registry: PluginRegistry) -> None:
        """Put the entries that a generation took the place of in force again."""
        registry.exchange(generation.kept)

    def went_back(self, generation: Generation) -> None:
        """The parts of before run again; a reload loads what the disk has."""
        self._packages = dict(generation.packages_before)
        self._history.remove(generation)
        for name in generation.outdated:
            self.outdated.pop(name, None)
        self._gone_back |= {*generation.sources}

    def module_of(self, module: str) -> ModuleType | None:
        """A module of a package that was loaded anew, in its newest generation; None: of no such package."""
        from mauve_rt.model.module_generations import load_module  # noqa: PLC0415

        number, packages = self._packages.get(module.partition(".")[0], (_FIRST, ()))
        return load_module(module, generation=number, packages=packages) if number != _FIRST else None

    def module_files(self, module: str) -> list[Path]:
        """The files of a loaded module, of its package, and of the other packages that it uses."""
        return [file for files in self._dependencies(module).values() for file in files]

    def _needed_libraries(self, sources: Collection[Source]) -> dict[str, list[Path]]:
        """What the libraries were loaded with, where some of that has changed; else nothing is looked up."""
        own = {Path(source.target) for source in sources}
        if not {*self._changed_libraries()} - own:
            return {}
        from mauve_rt.model.plugin_trial import needed_libraries  # noqa: PLC0415

        libraries = [Path(source.target) for source in sources if not source.is_python]
        answer = needed_libraries([library for library in libraries if library.is_file()])
        return {target: [Path(file) for file in files] for target, files in answer.items()}

    def _changed_libraries(self) -> list[Path]:
        """Libraries that the loader opened for others, and that are others by now."""
        from mauve_rt.model.opened_libraries import opened_libraries  # noqa: PLC0415
        from mauve_rt.model.workspace_files import may_be_rebuilt  # noqa: PLC0415

        opened = (Path(path) for name, path in opened_libraries().items() if MARK not in name)
        return [path for path in opened if may_be_rebuilt(path) and self._loaded.is_changed(path)]

    def _dependencies(self, module: str) -> dict[str, list[Path]]:
        from mauve_rt.model.module_dependencies import module_dependencies  # noqa: PLC0415
        from mauve_rt.model.module_generations import generation_name, plain_name  # noqa: PLC0415

        number, _ = self._packages.get(module.partition(".")[0], (_FIRST, ()))
        found: dict[str, list[Path]] = {}
        for package, files in module_dependencies(generation_name(module, number)).items():
            found.setdefault(plain_name(package), []).extend(files)
        return found

    def _try(
        self,
        sources: Sequence[Source],
        registry: PluginRegistry,
        *,
        in_use: Collection[Name],
        in_python: Collection[Name],
        source_of: Callable[[str, str], str],
        folder: Path | None,
    ) -> _Candidate:
        from mauve_rt.model.plugin_trial import Copies, try_plugins  # noqa: PLC0415

        number = self._copies + 1
        libraries = [source for source in sources if not source.is_python]
        changed = {*self._changed_libraries(), *self._copied} if libraries else set()
        files = [file for source in sources if source.is_python for file in self.module_files(source.target)]
        stamps = Stamps([*files, *changed, *(Path(source.target) for source in libraries)])
        modules = {source.target: self._to_load(source) for source in sources if source.is_python}
        answer = try_plugins(
            [Path(source.target) for source in libraries],
            list(modules.items()),
            generation=number,
            copies=None if folder is None else Copies(folder, changed),
        )
        opened = tuple(Path(library) for library in answer["opened"])
        stale = [file for file, was in stamps.files.items() if Stamps([file]).files[file] != was]
        if stale:
            remedy = "wait for the end of the build, then reload again"
            raise PluginError(f"{stale[0]} was written while it was tried", remedy=remedy)
        names = names_of(sources)
        _check_kept(answer, names_of(libraries), in_use)
        check_types(answer["types"], registry, names)
        check_base_classes(
            answer["classes"], registry, names, lambda base: self._loaded.changed_files(source_of(*base))
        )
        outdated = [name for name in _outdated(answer, names, registry) if name not in in_python]
        _check_not_in_use(outdated, in_use)
        return _Candidate(
            copy_number=number,
            sources=tuple(sources),
            libraries=opened,
            copied=frozenset(Path(library) for library in answer["copied"]),
            plugins=frozenset(_copied_name(Path(source.target), number) for source in libraries),
            modules=modules,
            stamps=stamps,
            outdated=tuple(outdated),
        )

    def _to_load(self, source: Source) -> tuple[str, ...]:
        """The packages that are loaded anew for a module: its own, and those on the way to a changed file."""
        own = source.target.partition(".")[0]
        found = self._dependencies(source.target)
        changed = {
            package for package, files in found.items() if self._loaded.changed_files(source.target, files)
        }
        changed |= {package for package in found if self._packages.get(package, (_FIRST, ()))[0] != _FIRST}
        leading = {package for package in found if changed & {*self._dependencies(package)}}
        return tuple(sorted({own, *changed, *leading}))

    def _open(
        self, candidate: _Candidate, number: int, registry: PluginRegistry, add_python_parts: Any
    ) -> None:
        import ctypes  # noqa: PLC0415

        from mauve_rt.model.module_generations import load_module  # noqa: PLC0415

        CodeGenerations._copies = candidate.copy_number
        for library in candidate.libraries:
            if library.name in candidate.plugins:
                registry.load_library(str(library))
            else:
                ctypes.CDLL(str(library), mode=os.RTLD_NOW | os.RTLD_LOCAL)
        for module, packages in candidate.modules.items():
            for package in packages:
                self._packages[package] = (candidate.copy_number, packages)
            loaded = load_module(module, generation=candidate.copy_number, packages=packages)
            add_python_parts(module, loaded)
        for kind, name in names_of(candidate.sources):
            if kind in PART_KINDS and registry.generation_of(kind, name) != number:
                registry.drop(kind, name)
        for kind, name in candidate.outdated:
            registry.drop(kind, name)

    def _keep(
        self,
        candidate: _Candidate,
        number: int,
        kept: PluginGeneration,
        packages_before: Mapping[str, tuple[int, tuple[str, ...]]],
    ) -> Generation:
        for source in candidate.sources:
            if source.is_python:
                for file, stamp in Stamps(self.module_files(source.target)).files.items():
                    candidate.stamps.files.setdefault(file, stamp)
        self._copied |= candidate.copied
        generation = Generation(
            number=number,
            sources=tuple(source.target for source in candidate.sources),
            names=names_of(candidate.sources),
            loaded=(*map(str, sorted(candidate.copied)), *candidate.modules),
            outdated=candidate.outdated,
            kept=kept,
            stamps=candidate.stamps,
            packages_before=packages_before,
        )
        self._history.append(generation)
        return generation


@contextmanager
def _folder_of_copies() -> Iterator[Path]:
    """A new folder from which libraries can be loaded, until the end of a reload.

    Raises:
        PluginError: there is none.
    """
    import tempfile  # noqa: PLC0415 - needed by a reload only

    parent, reasons = code_folder()
    if parent is None:
        text = f"copies of libraries: expected a folder to write and to load them, found none ({reasons})"
        raise PluginError(
            text, remedy="set TMPDIR of the executor to a folder that is writable, without noexec"
        )
    with tempfile.TemporaryDirectory(prefix=".mauve_rt_", dir=parent, ignore_cleanup_errors=True) as folder:
        yield Path(folder)


def _copied_name(library: Path, number: int) -> str:
    stem, dot, rest = library.name.partition(".")
    return f"{stem}@{number}{dot}{rest}"


def _check_kept(answer: Mapping[str, Any], names: Collection[Name], in_use: Collection[Name]) -> None:
    for kind, name in sorted({*names} & {*in_use}):
        if kind in PART_KINDS and name not in answer["names"].get(kind, ()):
            raise PluginError(
                f"{kind} '{name}' is gone from the new code, and a component has it",
                element=name,
                remedy="replace it first, or bring it back",
            )


def _check_not_in_use(outdated: Collection[Name], in_use: Collection[Name]) -> None:
    for kind, name in sorted({*outdated} & {*in_use}):
        text = f"{kind} '{name}' was compiled for the shell as it was, and a component has it"
        raise PluginError(text, element=name, remedy="build its package, too, then reload both")


def _outdated(answer: Mapping[str, Any], names: Collection[Name], registry: PluginRegistry) -> list[Name]:
    """Parts of other libraries, compiled for a shell that has other members now."""
    changed = {
        name
        for name, shell in answer["shells"].items()
        if name in registry.names("shell") and not is_same_shell(shell, registry.describe_shell(name))
    }
    derived = {name for name in derived_shells(registry, changed) if ("shell", name) not in names}
    changed |= derived
    users = [
        (kind, name)
        for kind, shell_of in (("core", registry.core_shell), ("fsm", registry.fsm_shell))
        for name in registry.names(kind)
        if (kind, name) not in names and shell_of(name) in changed
    ]
    return users + [("shell", name) for name in sorted(derived)]
