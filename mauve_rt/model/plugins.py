"""Plug-ins: which shells, cores, fsms, resources and types are installed, and how to load them.

A package lists its classes in the ament index resource `mauve_rt_plugins/<package>`, one line each:

    # kind; name; shell; library or module:Class
    shell; mauve_examples/GuidanceShell; ; mauve_examples
    core; mauve_examples/Guidance; mauve_examples/GuidanceShell; mauve_examples
    core; my_package/PyGuidance; mauve_examples/GuidanceShell; my_package.cores:PyGuidance
    fsm; my_package/PyHoverFsm; my_package/PyHoverShell; my_package.hover:HoverFsm

Only what is listed is ever loaded, and only when an architecture file or a request names it: no request makes
a process import anything else.
"""

import importlib
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Self

from mauve_rt._kernel import PluginRegistry, given_resource_kinds
from mauve_rt.errors import MauveError, PluginError, exception_text, one_line
from mauve_rt.file_schema.words import did_you_mean, nearest, shown
from mauve_rt.model.generations import CodeGenerations, Generation, Name, Source
from mauve_rt.model.loaded_code import REMEDY, LoadedCode, Stamp
from mauve_rt.parts import ament_index

INDEX_RESOURCE = "mauve_rt_plugins"
KINDS: Mapping[str, str] = {
    "shell": "the ports and properties of a component",
    "core": "the data and algorithms of a component",
    "fsm": "the states of a component",
    "resource": "a kind of resource",
    "type": "a type of values of resources, such as a ROS message",
    "call_type": "a type of calls, such as a ROS service",
    "action_type": "a type of actions, such as a ROS action",
}
IN_PYTHON = ("shell", "core", "fsm", "resource")
"""Kinds that a Python class can be; types are written in C++, or are ROS messages, which nothing lists."""
_TYPES = tuple(kind for kind in KINDS if kind.endswith("type"))  # several packages may register the same one
SOURCE_IT = "source its install/setup.bash, or add its prefix to AMENT_PREFIX_PATH"
_FIELDS = 4


@dataclass(frozen=True, kw_only=True)
class Plugin:
    """One line of an index file."""

    kind: str
    name: str
    shell: str  # of cores and fsms: the shell they were written for
    target: str  # name of a library (PREFIX/lib/lib<target>.so), or module:Class
    prefix: Path

    @property
    def source(self) -> str:
        """What is loaded for it: a module, or a library's file."""
        return self.target.partition(":")[0] if self.is_python else str(self.library)

    @property
    def is_python(self) -> bool:
        """Whether it is a class of a Python module."""
        return ":" in self.target

    @property
    def library(self) -> Path:
        """The file of a C++ plug-in."""
        return self.prefix / "lib" / f"lib{self.target}.so"


def parse_index(text: str, *, prefix: Path, origin: str) -> tuple[list[Plugin], list[str]]:
    """The plug-ins of one index file, and one line about each line of it that is none."""
    plugins, complaints = [], []
    for number, line in enumerate(text.splitlines(), start=1):
        content = line.partition("#")[0].strip()
        if not content:
            continue
        words = [word.strip() for word in content.split(";")]
        where = f"{origin}:{number}:1"
        if len(words) != _FIELDS:
            complaints.append(
                f"{where}: expected 'kind; name; shell; library or module:Class', found '{content}'"
            )
        elif words[0] not in KINDS:
            complaints.append(f"{where}: unknown kind '{words[0]}'; {did_you_mean(words[0], KINDS)}")
        elif not words[1] or not words[3] or (words[0] in ("core", "fsm") and not words[2]):
            needs = "a name, a library or module:Class, and a core or fsm a shell too"
            complaints.append(f"{where}: a {words[0]} needs {needs}")
        elif ":" in words[3] and words[0] not in IN_PYTHON:
            what = f"a {words[0]} is written in C++: expected a library"
            complaints.append(f"{where}: {what}, found '{words[3]}'")
        else:
            kind, name, shell, target = words
            plugins.append(Plugin(kind=kind, name=name, shell=shell, target=target, prefix=prefix))
    return plugins, complaints


_Files = list[tuple[Path, Path, Stamp | None]]  # prefix, file, and what tells whether it was written since


class PluginIndex:
    """Everything that is installed, by kind and name; nothing of it is loaded."""

    def __init__(self, plugins: Iterable[Plugin] = (), complaints: Iterable[str] = ()) -> None:
        self._plugins: dict[tuple[str, str], Plugin] = {}
        for plugin in plugins:
            self._plugins.setdefault((plugin.kind, plugin.name), plugin)
        self.complaints = list(complaints)
        self._read: _Files | None = None

    @classmethod
    def installed(cls) -> Self:
        """What the ament index lists now."""
        plugins: list[Plugin] = []
        complaints: list[str] = []
        read = _index_files()  # first: what is installed while it is read is found the next time
        for prefix, file, _ in read:
            try:
                text = file.read_text(encoding="utf-8")
            except (OSError, UnicodeDecodeError) as error:
                complaints.append(one_line(f"{file}:1:1: cannot be read: {error}"))
                continue
            found, wrong = parse_index(text, prefix=prefix, origin=str(file))
            plugins += found
            complaints += wrong
        index = cls(plugins, complaints)
        index._read = read
        return index

    def without(self, package: str) -> Self:
        """The same but for what has names of a package, and for all else that is loaded with that."""
        gone = {each.source for each in self if each.name.partition("/")[0] == package}
        others = (each for each in self if each.source not in gone)
        return type(self)(others, self.complaints)

    @property
    def is_stale(self) -> bool:
        """Whether the ament index lists something else by now; never, of one that was not read from there."""
        return self._read is not None and self._read != _index_files()

    def find(self, kind: str, name: str) -> Plugin | None:
        """The plug-in of that kind and name."""
        return self._plugins.get((kind, name))

    def names(self, kind: str) -> list[str]:
        """Names of one kind, sorted."""
        return sorted(name for of_kind, name in self._plugins if of_kind == kind)

    def __iter__(self) -> Iterator[Plugin]:
        return iter(self._plugins.values())


def _index_files() -> _Files:
    """MAUVE RT's own first: common types are loaded from there, not from a package that has them as well."""
    resources = sorted(ament_index.resources(INDEX_RESOURCE), key=lambda each: each[0] != "mauve_rt")
    return [(prefix, file, Stamp.of(file)) for _, prefix, file in resources]


class PluginLoader:
    """Loads plug-ins into a registry the first time somebody needs them. Not thread-safe: for setting up."""

    # One for the process, as libraries and modules are.
    _loaded = LoadedCode()
    _sources: ClassVar[dict[Name, str]] = {}  # of what was loaded; the index may list it no longer
    generations = CodeGenerations(_loaded)

    def __init__(self, registry: PluginRegistry, index: PluginIndex) -> None:
        self.registry = registry
        self.index = index

    def names(self, kind: str) -> list[str]:
        """What is installed or built in."""
        return sorted({*self.index.names(kind), *self.registry.names(kind)})

    def has(self, kind: str, name: str) -> bool:
        """Whether something of that kind and name is installed or built in."""
        return self.index.find(kind, name) is not None or name in self.registry.names(kind)

    def part_kinds(self, name: str) -> list[str]:
        """Which parts of a component have that name: of "core", "fsm" and "shell", none or more."""
        return [kind for kind in ("core", "fsm", "shell") if self.has(kind, name)]

    def shell_of(self, core: str) -> str:
        """The shell that a core was written for; nothing is loaded."""
        plugin = self.index.find("core", core)
        return plugin.shell if plugin is not None else self.registry.core_shell(core)

    def require(self, kind: str, name: str) -> None:
        """Make sure that the registry knows a plug-in, loading its library or module if it does not.

        Raises:
            PluginError: not installed, cannot be loaded, the library does not have it, or it was loaded and
                is another one on the disk by now.
        """
        plugin = self.index.find(kind, name)
        source = self._sources.get((kind, name), "")
        if (
            plugin is not None and kind not in _TYPES
        ):  # a type may be of another library than the index's first
            source = plugin.source
        if change := self._loaded.change_of(source):
            raise PluginError(f"{kind} '{name}': {change}", element=name, remedy=REMEDY)
        if name in self.registry.names(kind):
            return
        if text := self.generations.outdated.get((kind, name)):
            raise PluginError(f"{kind} '{name}': {text}", element=name, remedy="build its package, reload it")
        if plugin is None:
            raise self._not_installed(kind, name)
        before = self._registered()
        if plugin.is_python:
            self._add_python_part(plugin)
        else:
            self._load_library(plugin)
        self._note_sources(before, plugin.source)
        if name not in self.registry.names(kind):
            remedy = "correct the package's list of plug-ins"
            raise PluginError(f"{plugin.library} has no {kind} '{name}'", element=name, remedy=remedy)

    def python_class(self, kind: str, name: str) -> Any:
        """The class of a plug-in in Python; None of one that is not installed so.

        Raises:
            PluginError: it cannot be loaded.
        """
        plugin = self.index.find(kind, name)
        return _python_class(plugin, self.generations) if plugin is not None and plugin.is_python else None

    def loaded_sources(self) -> list[Source]:
        """The libraries and modules that plug-ins were loaded from, with what they register."""
        names: dict[str, set[Name]] = {}
        for name, source in self._sources.items():
            names.setdefault(source, set()).add(name)
        return [
            Source(target=target, names=frozenset(found), is_python=not target.endswith(".so"))
            for target, found in names.items()
        ]

    def source_of(self, kind: str, name: str) -> str:
        """The library or module that a plug-in was loaded from; empty: it was not."""
        return self._sources.get((kind, name), "")

    @classmethod
    def built_ns(cls, source: str) -> int:
        """When the newest loaded file of a library or module was written, ns since 1970; 0: not known."""
        return cls._loaded.built_ns(source)

    def reload(
        self, sources: Collection[Source], *, in_use: Collection[Name], dry_run: bool = False
    ) -> Generation | None:
        """Try and load the code of these sources anew; it is in force for the registry then.

        `in_use`: parts that components have now. Returns None after a dry run.

        Raises:
            PluginError: nothing has changed then.
        """
        before = self._registered()
        generation = self.generations.load(
            tuple(sources),
            self.registry,
            in_use=in_use,
            in_python={(plugin.kind, plugin.name) for plugin in self.index if plugin.is_python},
            source_of=self.source_of,
            add_python_parts=self._add_parts_of,
            dry_run=dry_run,
        )
        if generation is not None:
            for source in sources:
                self._note_sources(before, source.target)
        return generation

    def _note_sources(self, before: set[Name], source: str) -> None:
        self._sources.update(
            (name, source) for name in self._registered() - before if name not in self._sources
        )

    def _add_parts_of(self, module: str, loaded: Any) -> None:
        """Register the parts of a module that was loaded anew, as far as they were loaded before."""
        for plugin in self.index:
            if plugin.source == module and (plugin.kind, plugin.name) in self._sources:
                self._register_python(plugin, _class_of(plugin, loaded))

    def _registered(self) -> set[Name]:
        """What libraries and modules have registered. The given kinds of resources come with a first type."""
        given = {("resource", kind.name) for kind in given_resource_kinds()}
        return {(kind, name) for kind in KINDS for name in self.registry.names(kind)} - given

    def _not_installed(self, kind: str, name: str) -> PluginError:
        if package := self.missing_package(name):
            return PluginError(f"{kind} '{name}': {package}", element=name, remedy=SOURCE_IT)
        names = self.names(kind)
        its_own = [each for each in names if each.partition("/")[0] == name.partition("/")[0]]
        known = did_you_mean(name, names if nearest(name, names) or not its_own else its_own)
        remedy = f"{known} (`mauve plugins` lists what is installed)"
        return PluginError(f"{kind} '{name}' is not installed", element=name, remedy=remedy)

    def missing_package(self, name: str) -> str:
        """`package 'my_arm' is not found`, of `my_arm/Arm`; empty: there is one of that or a similar name."""
        package, separator, _ = name.partition("/")
        packages = {found for found, _, _ in ament_index.resources("packages")}
        known = (
            [plugin.name for plugin in self.index]
            + self.registry.names("core")
            + self.registry.names("shell")
        )
        packages |= {each.partition("/")[0] for each in known}
        if not separator or nearest(package, packages, likeness=0.8):
            return ""
        return f"package {shown(package)} is not found"

    def require_type(self, name: str, kind: str = "type") -> None:
        """As require(), but leaves a type of data, calls or actions that nothing lists to the registry."""
        if self.index.find(kind, name) is not None:
            self.require(kind, name)

    def _load_library(self, plugin: Plugin) -> None:
        if not plugin.library.is_file():
            remedy = "build and install its package again (of MAUVE RT: scripts/setup)"
            raise PluginError(f"{plugin.kind} '{plugin.name}': no library {plugin.library}", remedy=remedy)
        self._loaded.note(plugin.source, [plugin.library])
        try:
            self.registry.load_library(str(plugin.library))
        except MauveError as error:
            raise PluginError(f"{plugin.kind} '{plugin.name}': {error}", element=plugin.name) from None

    def _add_python_part(self, plugin: Plugin) -> None:
        if plugin.shell:
            self.require("shell", plugin.shell)
        part = _python_class(plugin, self.generations)
        self._loaded.note(plugin.source, self.generations.module_files(plugin.source))
        self._register_python(plugin, part)

    def _register_python(self, plugin: Plugin, part: Any) -> None:
        if plugin.kind == "core":
            from mauve_rt.parts.cores import core_factory  # noqa: PLC0415

            wcet_ns = dict(getattr(part, "wcet_ns", {}))
            self.registry.add_python_core(plugin.name, plugin.shell, core_factory(part), wcet_ns)
        elif plugin.kind == "fsm":
            self.registry.fsm(plugin.name, part, plugin.shell)
        elif plugin.kind == "shell":
            self.registry.shell(plugin.name, part)
        else:
            self.registry.resource(plugin.name, part)


def _python_class(plugin: Plugin, generations: CodeGenerations) -> Any:
    try:
        importlib.invalidate_caches()  # it may have been installed a moment ago
        module = generations.module_of(plugin.source) or importlib.import_module(plugin.source)
    except BaseException as error:  # noqa: BLE001 - whatever a module of somebody else raises on import
        text = f"{plugin.kind} '{plugin.name}': cannot load {plugin.target}: {exception_text(error)}"
        raise PluginError(text, element=plugin.name) from None
    return _class_of(plugin, module)


def _class_of(plugin: Plugin, module: Any) -> Any:
    """The class of a plug-in in its module.

    Raises:
        PluginError: there is none, or one of another base.
    """
    try:
        found = getattr(module, plugin.target.partition(":")[2])
    except BaseException as error:  # noqa: BLE001 - whatever a module of somebody else raises on import
        text = f"{plugin.kind} '{plugin.name}': cannot load {plugin.target}: {exception_text(error)}"
        raise PluginError(text, element=plugin.name) from None
    base = _base_of(plugin.kind)
    if base is not None and not (isinstance(found, type) and issubclass(found, base)):
        bases = found.__mro__[1].__name__ if isinstance(found, type) else type(found).__name__
        text = f"{plugin.kind} '{plugin.name}': {plugin.target}: expected a class derived from"
        raise PluginError(f"{text} mauve_rt.api.{base.__name__}, found one derived from {bases}")
    return found


def _base_of(kind: str) -> type | None:
    """What a class in Python is derived from; a core may also only look like one."""
    from mauve_rt.parts.fsms import Fsm  # noqa: PLC0415 - these need ROS, unlike the architecture file
    from mauve_rt.parts.resources import Resource  # noqa: PLC0415
    from mauve_rt.parts.shells import Shell  # noqa: PLC0415

    bases: Mapping[str, type] = {"shell": Shell, "fsm": Fsm, "resource": Resource}
    return bases.get(kind)
