"""`mauve model PACKAGE`: the model of the parts that a package has registered, to begin a model file from."""

import argparse
import sys

from mauve_rt.cli.verb import BAD_USAGE, OK
from mauve_rt.errors import MauveError


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The package."""
    parser.add_argument("package", help="an installed package, such as my_robot")


def main(args: argparse.Namespace) -> int:
    """Print the model; what nothing registered says goes to stderr. Returns the exit status."""
    from mauve_rt._kernel import PluginRegistry  # noqa: PLC0415 - only this verb
    from mauve_rt.model import PluginIndex, PluginLoader  # noqa: PLC0415
    from mauve_rt.model.registered_model import registered_model  # noqa: PLC0415
    from mauve_rt.yaml.writer import write_yaml  # noqa: PLC0415

    try:
        found = registered_model(args.package, PluginLoader(PluginRegistry(), PluginIndex.installed()))
    except MauveError as error:
        print(f"mauve: {error}", file=sys.stderr)
        return BAD_USAGE
    print(write_yaml(found.content), end="")
    for guess in found.guesses:
        print(f"{args.package}: {guess}", file=sys.stderr)
    return OK
