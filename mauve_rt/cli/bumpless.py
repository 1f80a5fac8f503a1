"""Arguments of a bumpless change, as `replace-core` and `shadow --promote` take them."""

import argparse
import json
import math

_DEFAULT_WITHIN_S = 2.0


def add_bumpless(parser: argparse.ArgumentParser) -> None:
    """Outputs with their greatest steps, and how long the change waits."""
    parser.add_argument(
        "--bumpless",
        action="append",
        type=_output,
        default=[],
        metavar="PORT.FIELD=STEP",
        help="put the new core in only where this output differs by at most STEP from that of the core in "
        "force; may be repeated",
    )
    parser.add_argument(
        "--within",
        type=float,
        default=_DEFAULT_WITHIN_S,
        metavar="S",
        help=f"with --bumpless: seconds to wait for such an instant (default {_DEFAULT_WITHIN_S:g})",
    )
    parser.add_argument(
        "--blend",
        type=float,
        default=0.0,
        metavar="S",
        help="with --bumpless: for so many seconds both cores execute, and the outputs go over linearly from "
        "those of the old core to those of the new one (at most 60; default 0: at once)",
    )


def bumpless_text(args: argparse.Namespace) -> str:
    """As YAML; empty: the change is made at once."""
    if not args.bumpless:
        return ""
    blend = {"blend_s": args.blend} if args.blend else {}
    return json.dumps({"outputs": dict(args.bumpless), "within_s": args.within, **blend})


def _output(text: str) -> tuple[str, float]:
    output, equals, step = text.partition("=")
    try:
        number = float(step)
    except ValueError:
        number = math.nan
    if output and equals and number >= 0.0 and math.isfinite(number):
        return output, number
    raise argparse.ArgumentTypeError(f"expected PORT.FIELD=STEP such as command.torque=0.5, found {text}")
