"""The verbs of `mauve` as `ros2 mauve VERB ...`, by the extension points of the ros2 command line.

Found by the package's entry points (`entry_points.txt` beside this module). Nothing else imports this module:
it needs ros2cli, which `mauve` does not.
"""

import argparse
from types import SimpleNamespace
from typing import Any

from ros2cli.command import CommandExtension, add_subparsers_on_demand
from ros2cli.plugin_system import PLUGIN_SYSTEM_VERSION, satisfies_version

from mauve_rt.cli.pipe import piped
from mauve_rt.cli.verb import OK, Verb, run
from mauve_rt.cli.verbs import VERBS


class MauveCommand(CommandExtension):
    """Look at MAUVE executors and reconfigure them while they run."""

    def add_arguments(self, parser: argparse.ArgumentParser, cli_name: str) -> None:
        """Let ros2cli add the verbs; none given is no error, as with its own commands."""
        self._parser = parser
        add_subparsers_on_demand(parser, cli_name, "_verb", "mauve_rt.verb", required=False)

    def main(self, *, parser: argparse.ArgumentParser, args: argparse.Namespace) -> int:  # noqa: ARG002
        """Run the verb; returns the exit status."""
        if not hasattr(args, "_verb"):
            return piped(self._print_help)
        return int(args._verb.main(args=args))  # noqa: SLF001 - the name that ros2cli's commands use

    def _print_help(self) -> int:
        self._parser.print_help()
        return OK


class VerbExtension:
    """The extension point `mauve_rt.verb`: a verb of `ros2 mauve`."""

    NAME: Any = None  # set by ros2cli
    EXTENSION_POINT_VERSION = "0.1"
    verb: Verb

    def __init__(self) -> None:
        satisfies_version(PLUGIN_SYSTEM_VERSION, "^0.1")

    def add_arguments(self, parser: argparse.ArgumentParser, cli_name: str) -> None:  # noqa: ARG002
        """As of `mauve VERB`."""
        self.verb.add_arguments(parser)

    def main(self, *, args: argparse.Namespace) -> int:
        """As `mauve VERB`."""
        return run(self.verb, args)


def _extension(verb: Verb) -> type[VerbExtension]:
    return type(verb.name, (VerbExtension,), {"__doc__": verb.help, "verb": verb})


# ros2cli wants a class for each: verbs.replace_core is that of `replace-core`.
verbs = SimpleNamespace(**{verb.name.replace("-", "_"): _extension(verb) for verb in VERBS})
