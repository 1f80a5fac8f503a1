"""`mauve new`: writes a package, or a part of one, that builds and passes its tests."""

import argparse
import shlex
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mauve_rt.cli.verb import OK
from mauve_rt.errors import ParameterError

if TYPE_CHECKING:
    from mauve_rt.modelling.package_model import PackageModel


@dataclass(frozen=True)
class _Kind:
    help: str
    has_language: bool = False
    """Whether it is a part that can be written in C++ or in Python."""


_PARTS: Mapping[str, _Kind] = {
    "component": _Kind("write a shell, a core and an fsm", has_language=True),
    "core": _Kind("write another core for a component of the package", has_language=True),
    "resource": _Kind("write a resource of your own", has_language=True),
    "message": _Kind("write a ROS message"),
    "rules": _Kind("write a rules file for the package's architecture"),
}
_BEGIN, _OTHER = "Drive", "Halt"  # the cores of a new package


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The kinds, each with a name."""
    kinds = parser.add_subparsers(title="kinds", metavar="KIND", required=True)
    package = kinds.add_parser("package", help="write a package that builds, passes its tests and runs")
    package.set_defaults(write=_write_package)
    package.add_argument("name", help="name of the package, and of its folder in the current one")
    _add_python(package)
    for kind, about in _PARTS.items():
        part = kinds.add_parser(kind, help=about.help)
        part.set_defaults(write=_write_part, kind=kind, python=False, base="")
        part.add_argument("name", help="name of it: LiftArm or lift_arm")
        part.add_argument(
            "--in",
            dest="folder",
            type=Path,
            default=Path(),
            metavar="PACKAGE",
            help="folder of the package (default: the package around the current folder)",
        )
        if about.has_language:
            _add_python(part)
        if kind == "core":
            part.add_argument(
                "--for",
                dest="base",
                default="",
                metavar="SHELL|CORE",
                help="shell, or another core, that it is for; also a core of the package's model, whose "
                "actions and guards it has (default: the only one of the package)",
            )


def main(args: argparse.Namespace) -> int:
    """Write new files."""
    for path in args.write(args):
        print(path)
    return OK


def _add_python(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--python", action="store_true", help="in Python (default: in C++)")


def _write_package(args: argparse.Namespace) -> Iterator[Path]:
    from mauve_rt.parts.ament_index import share_folder  # noqa: PLC0415 - other verbs need not load these
    from mauve_rt.scaffold.names import check_package, part_names  # noqa: PLC0415
    from mauve_rt.scaffold.rendering import render, write_package  # noqa: PLC0415
    from mauve_rt.scaffold.schemas import write_schemas  # noqa: PLC0415
    from mauve_rt.scaffold.sources import Port, cpp_base, python_base  # noqa: PLC0415

    check_package(args.name)
    if (there := share_folder(args.name)) is not None:
        print(
            f"mauve: a package {args.name} is installed in {there}: the one that is found first counts",
            file=sys.stderr,
        )
    begin, begin_file = part_names(_BEGIN)
    other, other_file = part_names(_OTHER)
    shell, ports = f"{begin}Shell", (Port("position", "write", "Float64"),)
    base = python_base(begin, shell, begin_file) if args.python else cpp_base(begin, shell, begin_file, ports)
    values: dict[str, Any] = {"package": args.name, "python": args.python, "base": base}
    language = "python" if args.python else "cpp"
    files = render("package", values)
    files |= render(f"component_{language}", values | {"name": begin, "file": begin_file})
    files |= render(f"core_{language}", values | {"name": other, "file": other_file})
    write_package(Path(args.name), files)
    write_schemas(Path(args.name))
    yield from (args.name / path for path in sorted(files))
    print(f"next: cd {shlex.quote(args.name)} && mauve build --test && mauve run", file=sys.stderr)


def _write_part(args: argparse.Namespace) -> Iterator[Path]:
    from mauve_rt.scaffold.names import part_names  # noqa: PLC0415
    from mauve_rt.scaffold.package import find_package  # noqa: PLC0415
    from mauve_rt.scaffold.rendering import render, write_parts  # noqa: PLC0415
    from mauve_rt.scaffold.schemas import write_schemas  # noqa: PLC0415
    from mauve_rt.scaffold.sources import base_of, modelled_core, target_of  # noqa: PLC0415

    name, file = part_names(args.name)
    package = find_package(args.folder)
    if args.kind == "core" and (found := modelled_core(package.folder, args.base)) is not None:
        yield from _write_modelled_core(package.folder, *found, name, in_python=args.python)
        write_schemas(package.folder)
        return
    values: dict[str, Any] = {"package": package.name, "name": name, "file": file}
    if args.kind == "core":
        values["base"] = base_of(package.folder, package.name, args.base, in_python=args.python)
    elif args.kind == "rules":
        values["target"] = target_of(package.folder)
    template = args.kind
    if _PARTS[args.kind].has_language:
        template += "_python" if args.python else "_cpp"
    yield from (package.folder / path for path in write_parts(package.folder, render(template, values)))
    write_schemas(package.folder)


def _write_modelled_core(
    folder: Path, model: "PackageModel", core: str, name: str, *, in_python: bool
) -> Iterator[Path]:
    """An implementation of a model's core. The model registers it."""
    from mauve_rt.modelling.generate import skeleton  # noqa: PLC0415
    from mauve_rt.scaffold.rendering import write_parts  # noqa: PLC0415

    files = skeleton(model, core, name, is_python=in_python)
    if not files:
        raise ParameterError(f"core: {model.path} says where {name} is written. Choose another name.")
    yield from (folder / path for path in write_parts(folder, {Path(each): files[each] for each in files}))
    if name not in model.content.cores[core].implementations:
        print(f"next: add `{name}: {{}}` to cores.{core}.implementations in {model.path}", file=sys.stderr)
    if not in_python:
        sources = [each for each in files if each.startswith("src/") and each.endswith(".cpp")]
        print(f"next: add {sources[0]} to add_library() in {folder / 'CMakeLists.txt'}", file=sys.stderr)
