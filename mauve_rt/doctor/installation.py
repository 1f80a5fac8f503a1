"""Checks of what is installed: plug-ins and their libraries, and whether all programs are of one build."""

import os
import shutil
from collections.abc import Iterable, Iterator
from pathlib import Path

from mauve_rt.counts import counted
from mauve_rt.doctor.finding import Computer, Finding, error, ok, warning
from mauve_rt.errors import MauveError, one_line
from mauve_rt.native_program import native_prefix

_REBUILD = "build its package again against this MAUVE RT: mauve build, or scripts/setup for its own"
_TRIAL_S = 30.0  # also on a busy computer
_NAMED = 3
_KERNEL = "/mauve_rt/_kernel"
_EXECUTOR, _MODULE = "/lib/mauve_rt/executor", "mauve_rt.node.executor.main"


def check_plugin_index(_computer: Computer) -> Iterator[Finding]:
    """The lists of plug-ins of installed packages: their form, and whether each library is there."""
    from mauve_rt.model.plugins import PluginIndex  # noqa: PLC0415 - takes its time to load

    index = PluginIndex.installed()
    plugins = list(index)
    for complaint in index.complaints:
        yield warning(
            one_line(complaint),
            cost="the plug-in of this line is not offered",
            remedy="correct the line in the package's CMakeLists.txt or list, and build the package again",
        )
    missing: dict[Path, list[str]] = {}
    for plugin in plugins:
        if not plugin.is_python and not plugin.library.is_file():
            missing.setdefault(plugin.library, []).append(f"{plugin.kind} {plugin.name}")
    for library, names in missing.items():
        yield error(
            f"{library} is missing; the index lists {_some(names)} of it",
            cost="an executor whose architecture names one of them does not start",
            remedy=_REBUILD,
        )
    if not plugins:
        yield error(
            "no package lists plug-ins",
            cost="no architecture starts: its shells, cores and fsms are not found",
            remedy=f"source {native_prefix()}/setup.bash",
        )
    elif not index.complaints and not missing:
        packages = {plugin.name.partition("/")[0] for plugin in plugins}
        yield ok(f"{counted(len(plugins), 'plug-in')} of {counted(len(packages), 'package')}")


def check_plugin_libraries(_computer: Computer) -> Iterator[Finding]:
    """Whether the library of each C++ plug-in loads, in a process of its own."""
    from mauve_rt.model.plugin_trial import try_plugins  # noqa: PLC0415
    from mauve_rt.model.plugins import PluginIndex  # noqa: PLC0415

    libraries = sorted(
        {
            plugin.library
            for plugin in PluginIndex.installed()
            if not plugin.is_python and plugin.library.is_file()
        }
    )
    try:
        try_plugins(libraries, [], generation=1, timeout_s=_TRIAL_S)
    except MauveError:
        pass  # each by itself says which one it is
    else:
        yield ok(f"{counted(len(libraries), 'library', 'libraries')} of this version")
        return
    is_any = False
    for library in libraries:
        try:
            try_plugins([library], [], generation=1, timeout_s=_TRIAL_S)
        except MauveError as problem:
            is_any = True
            cost = "an executor whose architecture names one of its plug-ins does not start"
            yield error(one_line(str(problem)), cost=cost, remedy=_REBUILD)
    if not is_any:
        yield warning(
            "each library loads by itself, but not all of them together",
            cost="an executor that takes parts of several packages may not start",
            remedy=_REBUILD,
        )


def check_one_build(_computer: Computer) -> Iterator[Finding]:
    """Whether executor, mauve, Python sources and native modules are of one installation and version."""
    import mauve_rt  # noqa: PLC0415
    from mauve_rt import _kernel  # noqa: PLC0415
    from mauve_rt.parts import ament_index  # noqa: PLC0415

    prefix = native_prefix()
    share = ament_index.share_folder("mauve_rt")
    sources = Path(mauve_rt.__file__).parent
    yield from describe_build(
        prefix,
        versions=(mauve_rt.__version__, _kernel.__version__),
        places={
            "the Python sources": prefix if sources == Path(_kernel.__file__).parent else sources,
            "`ros2 run mauve_rt`": share.resolve().parents[1] if share else None,
            "the command `mauve`": Path(found).resolve().parents[1]
            if (found := shutil.which("mauve"))
            else None,
        },
    )


def describe_build(
    prefix: Path, *, versions: tuple[str, str], places: dict[str, Path | None]
) -> Iterator[Finding]:
    """`places`: the prefix that each part is installed in; None: there is no such part."""
    sources, native = versions
    is_one = True
    if not (prefix / _EXECUTOR.removeprefix("/")).is_file():
        is_one = False
        yield error(
            f"no executor in {prefix}{_EXECUTOR}", cost="mauve run starts nothing", remedy="scripts/setup"
        )
    if sources != native:
        is_one = False
        yield error(
            f"Python sources of version {sources}, native modules of version {native}",
            cost="an executor may not start, or may fail later",
            remedy="scripts/setup, and remove other installations from PYTHONPATH",
        )
    for name, place in places.items():
        if place is not None and place != prefix:
            is_one = False
            yield warning(
                f"{name}: of {place}, the native modules of {prefix}",
                cost="parts of two builds run together: what you change in one does not show in the other",
                remedy=f"open a new shell and: source {prefix}/setup.bash",
            )
    if is_one:
        yield ok(f"version {native} in {prefix}")


def check_executor_processes(computer: Computer) -> Iterator[Finding]:
    """Executors that run on this computer, their domains, and whether they run this build."""
    from mauve_rt import _kernel  # noqa: PLC0415

    own = str(Path(_kernel.__file__).resolve())
    shown = []
    for process in executor_processes(computer):
        domain = _domain(process)
        text = f"process {process.name}" + (f" in domain {domain}" if domain is not None else "")
        kernel = _kernel_of(process)
        if kernel and kernel != own:
            yield warning(
                f"{text} runs {kernel}, this shell {own}",
                cost="the executor runs another build than mauve, or one that was replaced on the disk",
                remedy="start the executor again from this shell",
            )
        else:
            shown.append(text)
    yield ok(", ".join(shown) or "none of this build runs")


def executor_processes(computer: Computer) -> list[Path]:
    """The /proc folders of executors."""
    folders = (each for each in computer.path("/proc").iterdir() if each.name.isdigit())
    return sorted((each for each in folders if _is_executor(each)), key=lambda each: int(each.name))


def _is_executor(process: Path) -> bool:
    return any(word.endswith((_EXECUTOR, _MODULE)) for word in _words(process / "cmdline")[:3])


def _domain(process: Path) -> str | None:
    words = _words(process / "environ")
    named = [word.partition("=")[2] for word in words if word.startswith("ROS_DOMAIN_ID=")]
    return (named or ["0"])[0] if words else None  # it may not be read


def _kernel_of(process: Path) -> str:
    """The native module that the process has loaded; "" where that may not be read."""
    try:
        lines = (process / "maps").read_text("utf-8", errors="replace").splitlines()
    except OSError:
        return ""
    paths: Iterable[str] = (line[line.index("/") :] for line in lines if "/" in line)
    return next((path for path in paths if _KERNEL in path and ".so" in path), "")


def _words(file: Path) -> list[str]:
    try:
        return [os.fsdecode(word) for word in file.read_bytes().split(b"\0") if word]
    except OSError:  # it has ended, or is another account's
        return []


def _some(names: list[str]) -> str:
    more = len(names) - _NAMED
    return ", ".join(names[:_NAMED]) + (f" and {more} more" if more > 0 else "")
