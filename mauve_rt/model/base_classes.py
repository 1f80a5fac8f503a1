"""Base classes of C++ parts that another library defines: a library has a copy of each, compiled in.

The kernel refuses to combine parts of two builds of a class that it has loaded. Only the files show that new
code was compiled for the newest build of a base class, which is not loaded yet.
"""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from pathlib import Path

from mauve_rt._kernel import PluginRegistry
from mauve_rt.errors import PluginError

Classes = Mapping[str, Mapping[str, Sequence[str]]]
"""By kind and name of a part: its class, then its base classes; of an fsm those of the core that it runs."""

_OF_CORES = ("core", "fsm")


def registered_classes(registry: PluginRegistry) -> dict[str, dict[str, list[str]]]:
    """The classes of all cores and fsms of a registry."""
    return {
        kind: {name: registry.classes_of(kind, name) for name in registry.names(kind)} for kind in _OF_CORES
    }


def check_base_classes(
    new: Classes,
    registry: PluginRegistry,
    names: Collection[tuple[str, str]],
    changed_files: Callable[[tuple[str, str]], Sequence[Path]],
) -> None:
    """Whether the new code was compiled for base classes of other libraries as they are loaded.

    `names`: what the request loads. `changed_files`: of the library of a part, those that the disk has anew.

    Raises:
        PluginError: a library with a base class was built again, too, and is not loaded by the same request.
    """
    defined = _definitions(registry)
    for kind, name, classes in _rows(new):
        bases = (defined[each] for each in classes if each in defined)
        for base in bases:
            if base in names or not (files := changed_files(base)):
                continue
            verb = "derives from" if kind == "core" else "runs"
            text = (
                f"{kind} '{name}' {verb} the class of {base[0]} '{base[1]}', whose library was rebuilt, too"
            )
            remedy = "reload both in one request: `mauve reload` without a package"
            raise PluginError(f"{text}: {files[0]} is not reloaded", element=name, remedy=remedy)


def derived_shells(registry: PluginRegistry, changed: Collection[str]) -> Iterator[str]:
    """The shells whose classes derive from those of these shells."""
    bases = {classes[0] for name in changed if (classes := registry.classes_of("shell", name))}
    for name in registry.names("shell"):
        if bases & {*registry.classes_of("shell", name)[1:]}:
            yield name


def _definitions(registry: PluginRegistry) -> dict[str, tuple[str, str]]:
    """The part that was registered for exactly a class; a core before an fsm."""
    defined: dict[str, tuple[str, str]] = {}
    for kind, name, classes in _rows(registered_classes(registry)):
        if classes:
            defined.setdefault(classes[0], (kind, name))
    return defined


def _rows(classes: Classes) -> Iterator[tuple[str, str, Sequence[str]]]:
    for kind, of_kind in classes.items():
        for name, found in of_kind.items():
            yield kind, name, found
