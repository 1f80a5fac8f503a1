"""The program of a trial: opens libraries, imports modules, and reports what they register.

Its standard input is the request; it writes one JSON object a line to a pipe of its own: {"step": ...} before
each step, so that the other side knows where a crash was, and {"answer": ...} or {"error": [text, remedy]} at
the end.
"""

import contextlib
import ctypes
import json
import os
import resource
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from mauve_rt._kernel import PluginRegistry
from mauve_rt.errors import MauveError, PluginError, exception_text, one_line
from mauve_rt.model.base_classes import registered_classes
from mauve_rt.model.code_layouts import registered_layouts, shell_layout
from mauve_rt.model.library_copies import copy_libraries, loaded_dependencies
from mauve_rt.model.module_generations import load_module
from mauve_rt.model.plugins import KINDS

_PR_SET_PDEATHSIG = 1
_ENTRY = "mauve_register_plugins"  # what MAUVE_PLUGINS defines

Report = Callable[[str, object], None]


def main() -> None:
    """Carry out the request of standard input, then end without the code's destructors."""
    request = json.load(sys.stdin)
    _settle(request["parent"])
    sys.path[:] = request["path"]
    pipe = request["answer"]
    os.set_inheritable(pipe, False)

    def report(kind: str, value: object) -> None:
        data = memoryview(json.dumps({kind: value}).encode() + b"\n")
        while data:
            data = data[os.write(pipe, data) :]

    try:
        report("answer", _needed(request) if "needed" in request else _try(request, report))
    except MauveError as error:
        report("error", [one_line(str(error)), getattr(error, "remedy", "")])
    except BaseException as error:  # noqa: BLE001 - whatever the code of somebody else raises
        report("error", [exception_text(error), ""])
    with contextlib.suppress(OSError, ValueError):
        sys.stdout.flush()
    os._exit(0)


def _settle(parent: int) -> None:
    """End with the parent, dump no core, take nothing else over from the thread that started this process."""
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
    if os.getppid() != parent:
        os._exit(1)
    resource.setrlimit(resource.RLIMIT_CORE, (0, resource.getrlimit(resource.RLIMIT_CORE)[1]))
    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    signal.pthread_sigmask(signal.SIG_SETMASK, ())
    null = os.open(os.devnull, os.O_RDONLY)
    os.dup2(null, 0)
    os.close(null)


def _needed(request: dict[str, Any]) -> dict[str, Any]:
    return {
        library: [str(file) for file in loaded_dependencies(Path(library), opened=request["of"])]
        for library in request["needed"]
    }


def _copied(request: dict[str, Any], copies: dict[str, Any]) -> tuple[list[str], list[str]]:
    """The libraries, changed ones that they need, and those in between; and the copies to open."""
    changed = {Path(file) for file in copies["changed"]}
    of = copies["of"]
    wanted = {Path(library) for library in request["libraries"]}
    for library in list(wanted):
        needed = loaded_dependencies(library, opened=of)
        wanted |= {
            file
            for file in needed
            if file in changed or changed & {*loaded_dependencies(file, opened=of)} & {*needed}
        }
    made = copy_libraries(
        sorted(wanted), folder=Path(copies["folder"]), generation=request["generation"], opened=of
    )
    return [str(file) for file in sorted(wanted)], [str(file) for file in made]


def _try(request: dict[str, Any], report: Report) -> dict[str, Any]:
    registry = PluginRegistry()
    libraries: list[str] = request["libraries"]
    copied: list[str] = []
    if libraries and request["copies"] is not None:
        report("step", "copying the libraries")
        copied, libraries = _copied(request, request["copies"])
    for library in libraries:
        report("step", f"opening library {library}")
        _open(registry, library)
    for module, packages in request["modules"]:
        report("step", f"importing module {module}")
        load_module(module, generation=request["generation"], packages=packages)
    shells = {}
    for name in registry.names("shell"):
        report("step", f"making shell {name}")
        shells[name] = shell_layout(registry.describe_shell(name))
    return {
        "names": {kind: registry.names(kind) for kind in KINDS},
        "shells": shells,
        "classes": registered_classes(registry),
        "copied": copied,
        "opened": libraries,
        "types": registered_layouts(registry, list(shells)),
    }


def _open(registry: PluginRegistry, library: str) -> None:
    try:
        opened = ctypes.CDLL(library, mode=os.RTLD_NOW | os.RTLD_LOCAL)
    except OSError as error:
        if "static TLS" in str(error):
            registry.load_library(library)  # fails likewise, with the kernel's remedy
        raise PluginError(f"library {library} does not load: {error}") from None
    if _registers_plugins(opened, library):
        registry.load_library(library)


class _SymbolPlace(ctypes.Structure):
    """glibc's Dl_info."""

    _fields_ = (
        ("dli_fname", ctypes.c_char_p),
        ("dli_fbase", ctypes.c_void_p),
        ("dli_sname", ctypes.c_char_p),
        ("dli_saddr", ctypes.c_void_p),
    )


def _registers_plugins(opened: ctypes.CDLL, library: str) -> bool:
    """Whether the library itself has plug-ins: the loader also finds the entry in a library that it needs."""
    try:
        entry = ctypes.cast(opened[_ENTRY], ctypes.c_void_p)
    except AttributeError:
        return False
    place = _SymbolPlace()
    found = ctypes.CDLL(None).dladdr(entry, ctypes.byref(place))
    return bool(found and place.dli_fname) and Path(os.fsdecode(place.dli_fname)).samefile(library)


if __name__ == "__main__":
    main()
