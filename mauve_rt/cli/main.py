"""`mauve VERB ...`, for machines without the ros2 command line; with it, also `ros2 mauve VERB ...`.

    mauve list /robot_1/executor
    mauve replace-core /robot_1/executor exploration mauve_examples/LocalExploration
    mauve reconfigure /robot_1/executor steps.yaml --dry-run

Exit status: 0 done, 1 refused by the executor (code and message on stderr), 2 bad usage, bad file or no such
executor, 3 `analyze` proves neither the one nor the other, 4 its verdict is a forecast, 5 a recording
refutes it, 141 the reader of the output is gone.
"""

import argparse
import gc
import os
import sys
from collections.abc import Sequence
from typing import NoReturn

import mauve_rt
from mauve_rt.cli.pipe import piped
from mauve_rt.cli.verb import BAD_USAGE, OK, run
from mauve_rt.cli.verbs import VERBS
from mauve_rt.node.shared.first_steps import take_first_steps
from mauve_rt.node.shared.lean_start import leave_out_unused
from mauve_rt.node.shared.shared_memory import refuse_ros_without_room


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one verb; returns the exit status."""
    if arguments is None:  # a process of its own
        take_first_steps("mauve")
        refuse_ros_without_room()
    gc.disable()  # short-lived: looking for garbage in what is loaded is a tenth of the work
    leave_out_unused()
    parser = build_parser()
    if "_ARGCOMPLETE" in os.environ:  # the shell asks for a completion
        return _complete(parser)
    return piped(lambda: _parse_and_run(parser, arguments))


def _complete(parser: argparse.ArgumentParser) -> int:
    """Print what may stand at the cursor; options only after a dash, so that a single name is inserted."""
    try:
        import argcomplete  # noqa: PLC0415
    except ImportError:
        return BAD_USAGE  # without a word: the user is typing
    argcomplete.autocomplete(parser, always_complete_options=False)
    return OK


def _parse_and_run(parser: argparse.ArgumentParser, arguments: Sequence[str] | None) -> int:
    args = parser.parse_args(arguments)
    return run(args.verb, args)


class _Version(argparse.Action):
    """As argparse's own, but that the version is looked up only when it is asked for."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> NoReturn:
        """Print it and leave."""
        print(mauve_rt.__version__)
        parser.exit()


def build_parser() -> argparse.ArgumentParser:
    """The command's arguments."""
    description = "Show, check and change MAUVE RT executors while they run."
    parser = argparse.ArgumentParser(prog="mauve", description=description)
    parser.add_argument("--version", action=_Version, nargs=0, help="show program's version number and exit")
    verbs = parser.add_subparsers(title="verbs", metavar="VERB", required=True)
    for verb in VERBS:
        subparser = verbs.add_parser(verb.name, help=verb.help, description=verb.help)
        verb.add_arguments(subparser)
        subparser.set_defaults(verb=verb)
    return parser


if __name__ == "__main__":
    sys.exit(main())
