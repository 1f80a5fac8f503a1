"""`mauve build`: builds and installs a package, by colcon in a workspace and by CMake elsewhere."""

import argparse
import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from mauve_rt.cli.verb import BAD_USAGE, OK

if TYPE_CHECKING:  # loaded by this verb only: others need not wait for it
    from mauve_rt.scaffold.package import Package

_Command = list[str | Path]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The package, and how it is built."""
    parser.add_argument(
        "package",
        nargs="?",
        type=Path,
        default=Path(),
        metavar="FOLDER",
        help="folder of the package (default: the package around the current folder)",
    )
    parser.add_argument("--test", action="store_true", help="run the tests of the package, too")
    parser.add_argument("--debug", action="store_true", help="build for a debugger (default: optimized)")


def main(args: argparse.Namespace) -> int:
    """Run the tools; returns the exit status of the first one that fails."""
    from mauve_rt.scaffold.environment import to_build  # noqa: PLC0415
    from mauve_rt.scaffold.package import find_package  # noqa: PLC0415
    from mauve_rt.scaffold.schemas import write_schemas  # noqa: PLC0415

    package = find_package(args.package)
    build_type = "Debug" if args.debug else "Release"
    commands = _cmake if package.workspace is None else _colcon
    environment = to_build()
    try:
        write_schemas(package.folder)
    except OSError as error:  # the sources may be read-only
        print(f"mauve: no schemas for editors: {error}", file=sys.stderr)
    for command in commands(package, build_type, test=args.test):
        words = [str(word) for word in command]
        print(f"mauve: {shlex.join(words)}", file=sys.stderr, flush=True)
        try:
            done = subprocess.run(words, env=environment, cwd=package.workspace, check=False)
        except FileNotFoundError:
            print(f"mauve: {words[0]} is not installed; install it (apt install {words[0]})", file=sys.stderr)
            return BAD_USAGE
        if done.returncode:
            return (
                done.returncode if done.returncode > 0 else 128 - done.returncode
            )  # a signal, as shells say it
    setup = package.prefixes[-1] / "setup.bash" if package.workspace else package.share / "local_setup.bash"
    print(
        f"mauve: mauve run starts it. For all other commands: source {shlex.quote(str(setup))}",
        file=sys.stderr,
    )
    return OK


def _cmake(package: "Package", build_type: str, *, test: bool) -> Iterator[_Command]:
    generator: _Command = []
    if "CMAKE_GENERATOR" not in os.environ and shutil.which("ninja"):
        generator = [] if (package.build / "CMakeCache.txt").exists() else ["-G", "Ninja"]
    yield [
        *("cmake", *generator, "-S", package.folder, "-B", package.build),
        f"-DCMAKE_BUILD_TYPE={build_type}",
        f"-DCMAKE_INSTALL_PREFIX={package.prefixes[0]}",
        f"-DPython3_EXECUTABLE={sys.executable}",
        "-DCMAKE_INSTALL_MESSAGE=LAZY",
    ]
    yield ["cmake", "--build", package.build, "--parallel", str(os.cpu_count() or 1)]
    yield ["cmake", "--install", package.build]
    if test:
        yield ["ctest", "--test-dir", package.build, "--output-on-failure"]


def _colcon(package: "Package", build_type: str, *, test: bool) -> Iterator[_Command]:
    links = ["--symlink-install"] if package.is_linked else []
    # The type of the build is for this package only.
    yield ["colcon", "build", *links, "--packages-up-to", package.name, "--packages-skip", package.name]
    only: _Command = ["--packages-select", package.name]
    yield ["colcon", "build", *links, *only, "--cmake-args", f"-DCMAKE_BUILD_TYPE={build_type}"]
    if test:
        yield [
            "colcon",
            "test",
            *only,
            "--event-handlers",
            "console_direct+",
            "--return-code-on-test-failure",
        ]
