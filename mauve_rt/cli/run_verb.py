"""`mauve run`: becomes the executor of a package's architecture, in an environment that has the package."""

import argparse
import os
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from mauve_rt.errors import ParameterError

if TYPE_CHECKING:  # loaded by this verb only: others need not wait for it
    from mauve_rt.scaffold.package import Package

_SOURCED = 'source "$0" && exec "$@"'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The architecture, and what the executor is given."""
    parser.add_argument(
        "architecture",
        nargs="?",
        default="",
        metavar="ARCH",
        help="architecture file, or the name of one of the package's (default: the only one)",
    )
    parser.add_argument("--rules", default="", metavar="FILE", help="rules file of the executor")
    parser.add_argument("--bag", default="", metavar="FOLDER", help="record into a new bag")
    parser.add_argument(
        "--ros-args",
        nargs=argparse.REMAINDER,
        default=[],
        metavar="ARG",
        help="all that follows is passed to the executor, such as -p drive.speed:=0.5",
    )


def main(args: argparse.Namespace) -> NoReturn:
    """Become the executor.

    Raises:
        ParameterError: there is no such architecture, or the package is not installed.
    """
    from mauve_rt.native_program import native_prefix  # noqa: PLC0415
    from mauve_rt.scaffold.environment import to_run  # noqa: PLC0415
    from mauve_rt.scaffold.sources import replaceable  # noqa: PLC0415

    package = _package(args.architecture)
    architecture = _architecture(args.architecture, package)
    parameters = {"architecture": architecture, "rules": args.rules, "bag": args.bag}
    given = [word for name, value in parameters.items() if value for word in ("-p", f"{name}:={value}")]
    executor = str(native_prefix() / "lib" / "mauve_rt" / "executor")
    command = [sys.executable, executor, "--ros-args", *given, *args.ros_args]
    environment: Mapping[str, str] = os.environ
    if package is not None:
        environment = to_run(package.prefix)
        setup = package.workspace / "install" / "setup.bash" if package.workspace else None
        if setup is not None and setup.exists():  # also what the package depends on in the workspace
            command = ["bash", "-c", _SOURCED, str(setup), *command]
    for each in replaceable(architecture):
        print(f"another terminal: mauve replace-core /executor {each.component} {each.core}", flush=True)
        break
    os.execvpe(command[0], command, environment)  # noqa: S606 - signals reach the executor


def _package(architecture: str) -> "Package | None":
    """Around the architecture file or the current folder; None: a file that is in no package."""
    from mauve_rt.scaffold.package import find_package  # noqa: PLC0415

    is_file = Path(architecture).is_file()
    for folder in (Path(architecture).parent, Path()) if is_file else (Path(),):
        try:
            return find_package(folder)
        except ParameterError:
            if not is_file:
                raise
    return None


def _architecture(given: str, package: "Package | None") -> Path:
    from mauve_rt.scaffold.sources import architectures  # noqa: PLC0415

    if Path(given).is_file() or package is None:
        return Path(given)
    there = architectures(package.folder)
    found = [path for path in there if not given or given in (path.name, path.stem)]
    if len(found) == 1:
        return found[0]
    names = ", ".join(path.stem for path in there) or "none"
    wanted = f"file {given}" if given else "one architecture file"
    raise ParameterError(
        f"expected {wanted} in {package.folder / 'architecture'}, found {names}. Call mauve run NAME."
    )
