"""Private copies of rebuilt C++ libraries, to be opened in parallel with the old ones.

A library is never closed. The loader takes a library, or an object that exists once in the process
(STB_GNU_UNIQUE: inline variables, static locals of inline functions, static members of templates), for one
that it has already where the name is the same. So the copies of one generation have names of their own:

- their SONAMEs, and where they need each other: a copy binds to the copy of its dependency;
- their unique objects, wherever they name them. All copies of a generation share such an object, as the first
  libraries share theirs. (As plain weak symbols a plug-in and its helper would each have one: helpers are
  opened first, by a call of their own.) Objects that a library outside of the copies defines, too, keep
  their names: those of MAUVE RT, of libstdc++, of unchanged helpers stay one for all.

A library that was changed since its first loading belongs into the copies of each later generation that needs
it: one that is not copied is the first one.
"""

import ctypes
import os
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

from mauve_rt.errors import PluginError
from mauve_rt.model.elf_library import ElfLibrary, shown_name
from mauve_rt.model.generation_names import library_name, symbol_name
from mauve_rt.model.workspace_files import may_be_rebuilt
from mauve_rt.unfinished import discard

_OWN_MODULES = ("mauve_rt._kernel", "mauve_rt._bridge")
_RTLD_DI_LINKMAP = 2

_Find = Callable[[bytes], Path | None]
"""The file of an open library, by the name that others need it by."""


def loaded_dependencies(library: Path, *, opened: Mapping[str, str] | None = None) -> list[Path]:
    """The loaded libraries that this one needs, directly or not, and that a user may rebuild.

    They have the paths that the loader opened. Libraries of the system and of this Python, and those that
    MAUVE RT's own modules need, are not among them. `opened`: the libraries of the process in question, by
    name; None: this process.

    Raises:
        PluginError: the file is no complete library, or pyelftools is missing.
    """
    modules = [getattr(sys.modules.get(name), "__file__", None) for name in _OWN_MODULES]
    find = _finder(opened)
    own = {file.resolve() for module in modules if module for file in _loaded_below(Path(module), find)}
    return [file for file in _loaded_below(library, find) if file.resolve() not in own]


def copy_libraries(
    libraries: Sequence[Path], *, folder: Path, generation: int, opened: Mapping[str, str] | None = None
) -> list[Path]:
    """Copy libraries for one generation; what to open, by full path, in this order.

    Give every changed library, and every library between a changed one and a plug-in. The answer begins with
    libraries that the copies need and that are no copies: the copies' RUNPATH no longer finds those.
    `opened`: as of loaded_dependencies().

    Raises:
        PluginError: a library cannot be copied. Nothing is left in the folder then.
    """
    copied = _in_order([ElfLibrary(path) for path in dict.fromkeys(libraries)])
    names = _library_names(copied, generation)
    outside = _outside(copied, _finder(opened))
    symbols = _symbol_names(copied, outside, generation)
    for library in copied:
        library.rename(libraries=names, symbols=symbols)
    needed = [library.path for library in outside if may_be_rebuilt(library.path)]
    return [*needed, *_write(copied, folder, generation)]


def _loaded_below(library: Path, find: _Find) -> list[Path]:
    found: dict[Path, None] = {}
    waiting = [library]
    while waiting:
        for name in ElfLibrary(waiting.pop()).needed:
            file = find(name)
            if file is not None and file not in found and may_be_rebuilt(file):
                found[file] = None
                waiting.append(file)
    return list(found)


def _library_names(libraries: Iterable[ElfLibrary], generation: int) -> dict[bytes, bytes]:
    """The new name of each SONAME."""
    names: dict[bytes, bytes] = {}
    libraries = list(libraries)
    for library in libraries:
        if not library.soname:
            _check_not_needed(library, libraries)
            continue
        if library.soname in names:
            found = f"'{shown_name(library.soname)}' twice"
            raise library.refused("a SONAME of its own", found, remedy="rename one library")
        names[library.soname] = library_name(library.soname, generation)
    return names


def _check_not_needed(nameless: ElfLibrary, libraries: Iterable[ElfLibrary]) -> None:
    """The loader knows a library that is opened already by its SONAME only."""
    file = os.fsencode(nameless.path.name)
    if any(os.path.basename(name) == file for library in libraries for name in library.needed):  # noqa: PTH119
        remedy = "link it with -Wl,-soname (CMake's add_library(NAME SHARED) does)"
        raise nameless.refused("a SONAME, as another library needs it", "none", remedy=remedy)


def _in_order(libraries: Sequence[ElfLibrary]) -> list[ElfLibrary]:
    """Dependencies first."""
    named = {library.soname: library for library in libraries if library.soname}
    order: dict[Path, ElfLibrary] = {}
    seen: set[Path] = set()

    def visit(library: ElfLibrary) -> None:
        if library.path in seen:
            return
        seen.add(library.path)
        for name in library.needed:
            if name in named:
                visit(named[name])
        order[library.path] = library

    for library in libraries:
        visit(library)
    return list(order.values())


def _outside(copied: Sequence[ElfLibrary], find: _Find) -> list[ElfLibrary]:
    """All that the copied libraries need and that is not copied; dependencies first."""
    inside = {library.soname for library in copied}
    seen: set[bytes] = set()
    found: list[ElfLibrary] = []

    def visit(library: ElfLibrary) -> None:
        for name in library.needed:
            if name in inside or name in seen:
                continue
            seen.add(name)
            file = find(name) or _file_to_load(name, library)
            if file is not None:
                dependency = ElfLibrary(file)
                visit(dependency)
                found.append(dependency)

    for library in copied:
        visit(library)
    return found


def _symbol_names(
    copied: Sequence[ElfLibrary], outside: Iterable[ElfLibrary], generation: int
) -> dict[bytes, bytes]:
    """The new name of each unique object that only copied libraries define."""
    found = {symbol.name for library in copied for symbol in library.symbols if symbol.is_unique}
    for library in outside:
        found -= {symbol.name for symbol in library.symbols if symbol.is_defined} if found else set()
    names = {name: symbol_name(name, generation) for name in found}
    for library in copied:
        if not library.has_gnu_hash and any(symbol.name in names for symbol in library.symbols):
            remedy = "link it with -Wl,--hash-style=gnu"
            raise library.refused("a hash table of style gnu", "none", remedy=remedy)
    return names


def _write(libraries: Iterable[ElfLibrary], folder: Path, generation: int) -> list[Path]:
    """The files of the copies. An existing file is never written: it may be in use."""
    images = [(library.path.name.partition("."), library.image()) for library in libraries]
    written: list[Path] = []
    try:
        for (stem, dot, rest), image in images:
            copy = folder.resolve() / f"{stem}@{generation}{dot}{rest}"
            with copy.open("xb") as file:
                written.append(copy)
                file.write(image)
    except OSError as error:
        for file_written in written:
            discard(file_written)
        where = error.filename or folder
        text = f"copies of libraries: {where} cannot be written: {error.strerror}"
        raise PluginError(text, remedy="set TMPDIR of the executor to a folder with room") from None
    return written


def _file_to_load(name: bytes, needed_by: ElfLibrary) -> Path | None:
    """Which file the loader will find; None: only the loader itself knows."""
    variables = os.environ.get("LD_LIBRARY_PATH", "").split(":")
    folders = [*needed_by.search_folders(), *(Path(folder) for folder in variables if folder)]
    if b"/" in name:
        folders = [Path()]
    files = (folder / os.fsdecode(name) for folder in folders)
    return next((file for file in files if file.is_file()), None)


def _finder(opened: Mapping[str, str] | None) -> _Find:
    if opened is None:
        return _loaded_file
    return lambda name: Path(opened[key]) if (key := os.path.basename(os.fsdecode(name))) in opened else None  # noqa: PTH119


class _LinkMap(ctypes.Structure):
    """The begin of glibc's struct link_map."""

    _fields_ = (("l_addr", ctypes.c_size_t), ("l_name", ctypes.c_char_p))


def _loaded_file(name: bytes) -> Path | None:
    """The path that the loader opened the library of this name by; None: it is not loaded."""
    try:
        library = ctypes.CDLL(os.fsdecode(name), mode=os.RTLD_NOLOAD | os.RTLD_NOW)
    except OSError:
        return None
    where = ctypes.POINTER(_LinkMap)()
    handle = ctypes.c_void_p(library._handle)  # noqa: SLF001 - ctypes has no other name for it
    if ctypes.CDLL(None).dlinfo(handle, _RTLD_DI_LINKMAP, ctypes.byref(where)) != 0:
        return None
    path = where.contents.l_name
    return Path(os.fsdecode(path)).absolute() if path else None
