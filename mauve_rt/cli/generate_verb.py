"""`mauve generate [MODEL [OTHER...]]`: the code of a package's model, and skeletons of its algorithms."""

import argparse
import sys
from pathlib import Path

from mauve_rt.cli.verb import BAD_USAGE, OK
from mauve_rt.counts import counted
from mauve_rt.errors import ArchitectureFileError, MauveError


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The model, and where the files go."""
    parser.add_argument(
        "model", nargs="?", type=Path, default=Path("model.yaml"), help="the model (default: model.yaml)"
    )
    parser.add_argument(
        "used",
        nargs="*",
        type=Path,
        metavar="OTHER",
        help="models of other packages whose parts it uses, where they are not installed",
    )
    language = parser.add_mutually_exclusive_group()
    language.add_argument("--cpp", action="store_true", help="in C++ (default)")
    language.add_argument("--python", action="store_true", help="in Python")
    parser.add_argument(
        "--output",
        type=Path,
        metavar="DIR",
        help="for what is generated each time (default: build/generated beside the model); "
        "mauve_rt_generate_model() of CMake writes the same files in its own folder",
    )


def main(args: argparse.Namespace) -> int:
    """Write the files; returns the exit status."""
    from mauve_rt.modelling.generate import (  # noqa: PLC0415 - only this verb
        generated,
        skeletons,
        write_generated,
        write_skeletons,
    )
    from mauve_rt.modelling.loading import ModelLoader  # noqa: PLC0415

    try:
        model = ModelLoader(args.used).load(args.model)
        folder = model.path.parent
        output = args.output or folder / "build" / "generated"
        files = generated(model, is_python=args.python)
        write_generated(output, files)
        written = write_skeletons(folder, skeletons(model, is_python=args.python))
    except ArchitectureFileError as error:
        print("\n".join(error.lines()), file=sys.stderr)
        return BAD_USAGE
    except MauveError as error:
        print(f"mauve: {error}", file=sys.stderr)
        return BAD_USAGE
    for warning in model.warnings:
        print(f"{model.path}:{warning.line}:{warning.column}: warning: {warning.text()}", file=sys.stderr)
    print(f"{output}: {counted(len(files), 'file')} generated")
    for name in written:
        print(f"{folder / name}: written, yours from now on")
    return OK
