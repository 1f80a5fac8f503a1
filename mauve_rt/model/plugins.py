"""Plug-ins: which shells, cores, fsms, resources and types are installed, and how to load them.

A package lists its classes in the ament index resource `mauve_rt_plugins/<package>`, one line each:

    # kind; name; shell; library or module:Class
    shell; mauve_examples/GuidanceShell; ; mauve_examples
    core; mauve_examples/Guidance; mauve_examples/GuidanceShell; mauve_examples
    core; my_package/PyGuidance; mauve_examples/GuidanceShell; my_package.cores:PyGuidance

Only what is listed is ever loaded, and only when an architecture file or a request names it: no request makes
a process import anything else.
"""

import importlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

from mauve_rt._kernel import PluginRegistry
from mauve_rt.errors import MauveError, PluginError, exception_text, one_line
from mauve_rt.model.loaded_code import REMEDY, LoadedCode, Stamp, module_files
from mauve_rt.model.words import did_you_mean, nearest
from mauve_rt.parts import ament_index

INDEX_RESOURCE = "mauve_rt_plugins"
KINDS: Mapping[str, str] = {
    "shell": "the ports and properties of a component",
    "core": "the data and algorithms of a component; in C++ or in Python",
    "fsm": "the states of a component",
    "resource": "a kind of resource",
    "type": "a type of values of resources, such as a ROS message",
    "call_type": "a type of calls, such as a ROS service",
}
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
        elif ":" in words[3] and words[0] != "core":
            complaints.append(f"{where}: only cores can be written in Python, found a {words[0]}")
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
    resources = ament_index.resources(INDEX_RESOURCE)
    return [(prefix, file, Stamp.of(file)) for _, prefix, file in resources]


class PluginLoader:
    """Loads plug-ins into a registry the first time somebody needs them. Not thread-safe: for setting up."""

    _loaded = LoadedCode()  # one for the process, as libraries and modules are

    def __init__(self, registry: PluginRegistry, index: PluginIndex) -> None:
        self.registry = registry
        self.index = index
        self._python_cores: set[str] = set()

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
        if plugin is not None and (change := self._loaded.change_of(plugin.source)):
            raise PluginError(f"{kind} '{name}': {change}", element=name, remedy=REMEDY)
        if name in self.registry.names(kind):
            return
        if plugin is None:
            remedy = f"{self._remedy_for(kind, name)} (`mauve plugins` lists what is installed)"
            raise PluginError(f"{kind} '{name}' is not installed", element=name, remedy=remedy)
        if plugin.is_python:
            self._add_python_core(plugin)
        else:
            self._load_library(plugin)
        if name not in self.registry.names(kind):
            remedy = "correct the package's list of plug-ins"
            raise PluginError(f"{plugin.library} has no {kind} '{name}'", element=name, remedy=remedy)

    def require_type(self, name: str, kind: str = "type") -> None:
        """As require(), but leaves a type (or call_type) that nothing lists to the registry's own words."""
        if self.index.find(kind, name) is not None:
            self.require(kind, name)

    def _remedy_for(self, kind: str, name: str) -> str:
        """The nearest name, else the names of its package, else where packages are looked for."""
        names = self.names(kind)
        package = name.partition("/")[0]
        its_own = [each for each in names if each.partition("/")[0] == package]
        if its_own or nearest(name, names):
            return did_you_mean(name, names if nearest(name, names) else its_own)
        found = f"no package '{package}' with a {kind} is found"
        return f"{found}: source its install/setup.bash, or add its prefix to AMENT_PREFIX_PATH"

    def _load_library(self, plugin: Plugin) -> None:
        if not plugin.library.is_file():
            remedy = "build and install its package again (of MAUVE RT: scripts/setup)"
            raise PluginError(f"{plugin.kind} '{plugin.name}': no library {plugin.library}", remedy=remedy)
        self._loaded.note(plugin.source, [plugin.library])
        try:
            self.registry.load_library(str(plugin.library))
        except MauveError as error:
            raise PluginError(f"{plugin.kind} '{plugin.name}': {error}", element=plugin.name) from None

    def _add_python_core(self, plugin: Plugin) -> None:
        self.require("shell", plugin.shell)
        factory = _factory(plugin)
        self._loaded.note(plugin.source, module_files(plugin.source))
        self.registry.add_python_core(plugin.name, plugin.shell, factory)


def _factory(plugin: Plugin) -> Callable[[Any], object]:
    from mauve_rt.parts.cores import core_factory  # noqa: PLC0415 - needs ROS, which the architecture file does not

    module_name, _, class_name = plugin.target.partition(":")
    try:
        importlib.invalidate_caches()  # it may have been installed a moment ago
        core_class = getattr(importlib.import_module(module_name), class_name)
    except BaseException as error:  # noqa: BLE001 - whatever a module of somebody else raises on import
        text = f"core '{plugin.name}': cannot load {plugin.target}: {exception_text(error)}"
        raise PluginError(text, element=plugin.name) from None
    return core_factory(core_class)
