"""`mauve shadow NODE [COMPONENT [CORE]]`: a candidate in parallel with the live core, and the difference."""

import argparse
import json
import sys
from typing import Any

from mauve_rt.cli.arguments import add_executor
from mauve_rt.cli.bumpless import add_bumpless, bumpless_text
from mauve_rt.cli.completion import complete_components, complete_cores, completed_by
from mauve_rt.cli.verb import BAD_USAGE, OK
from mauve_rt.trace.reading.shadows import verdict_word

_DEFAULT_BUDGET_US = 100.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Of `mauve shadow`."""
    add_executor(parser)
    component = parser.add_argument(
        "component", nargs="?", default="", help="component (default: show all shadows)"
    )
    completed_by(component, complete_components)
    core = parser.add_argument(
        "core", nargs="?", default="", help="candidate core to begin a shadow with, package/Class"
    )
    completed_by(core, complete_cores)
    parser.add_argument(
        "--budget-us",
        type=float,
        default=_DEFAULT_BUDGET_US,
        metavar="N",
        help=f"execution time of the candidate for one release, on average (default {_DEFAULT_BUDGET_US:g})",
    )
    action = parser.add_mutually_exclusive_group()
    action.add_argument("--promote", action="store_true", help="make the candidate the core")
    action.add_argument("--end", action="store_true", help="end the shadow of the component")
    parser.add_argument(
        "--fresh",
        action="store_true",
        help="the candidate begins, or becomes the core, without copies of the core's state fields",
    )
    add_bumpless(parser)
    parser.add_argument("--json", action="store_true", help="print JSON")


def main(args: argparse.Namespace) -> int:
    """Begin, show, promote or end a shadow."""
    if (args.promote or args.end) and (not args.component or args.core):
        print("mauve: --promote and --end need a component, and no core", file=sys.stderr)
        return BAD_USAGE
    if args.bumpless and not args.promote:
        print("mauve: --bumpless needs --promote", file=sys.stderr)
        return BAD_USAGE
    kind = "promote" if args.promote else "end_shadow" if args.end else "shadow" if args.core else ""
    return _change(args, kind) if kind else _show(args)


def _change(args: argparse.Namespace, kind: str) -> int:
    from mauve_msgs.msg import ReconfigurationStep  # noqa: PLC0415 - ROS takes its time to load
    from mauve_msgs.srv import Reconfigure  # noqa: PLC0415
    from mauve_rt.cli.client import connected  # noqa: PLC0415
    from mauve_rt.cli.views import print_reply  # noqa: PLC0415

    value = {"fresh": True} if args.fresh and kind != "end_shadow" else {}
    if kind == "shadow":
        value["budget_us"] = args.budget_us
    if args.bumpless:
        value["bumpless"] = json.loads(bumpless_text(args))
    text = json.dumps(value) if value else ""
    step = ReconfigurationStep(kind=kind, target=args.component, name=args.core, value=text)
    request = Reconfigure.Request(steps=[step], requested_by="mauve")
    with connected(first=True) as client:
        reply = client.call(Reconfigure, f"{args.executor}/reconfigure", request)
    return print_reply(reply, as_json=args.json)


def _show(args: argparse.Namespace) -> int:
    from mauve_msgs.srv import ListComponents  # noqa: PLC0415
    from mauve_rt.cli.client import connected  # noqa: PLC0415
    from mauve_rt.cli.views import print_json  # noqa: PLC0415

    with connected(first=True) as client:
        reply = client.call(ListComponents, f"{args.executor}/list_components", ListComponents.Request())
    shadows = [
        shadow
        for component in reply.components
        if args.component in ("", component.name)
        for shadow in component.shadows
    ]
    if args.json:
        print_json(shadows)
    elif not shadows:
        print("no component has a shadow", file=sys.stderr)
    else:
        for shadow in shadows:
            _print(shadow)
    return OK if shadows else BAD_USAGE


def _print(shadow: Any) -> None:
    from rich import box  # noqa: PLC0415 - takes its time to load
    from rich.table import Table  # noqa: PLC0415

    from mauve_rt.cli.views import console, output_step_words  # noqa: PLC0415
    from mauve_rt.counts import counted, duration  # noqa: PLC0415

    out = console()
    verdict = verdict_word(shadow.verdict)
    skipped = [
        text
        for count, text in (
            (shadow.skipped_late, f"{shadow.skipped_late} skipped (late)"),
            (shadow.skipped_budget, f"{shadow.skipped_budget} skipped (budget)"),
            (shadow.idle, f"{shadow.idle} without an execution"),
            (shadow.over_budget, f"{shadow.over_budget} over budget"),
        )
        if count
    ]
    facts = [f"{counted(shadow.releases, 'release')}, {shadow.compared} compared", *skipped]
    time = f"largest execution {duration(shadow.largest_execution_ns)} of {duration(shadow.budget_ns)}"
    reason = f": {shadow.reason}" if shadow.reason else ""
    out.print(
        f"{shadow.component}: {shadow.core} in parallel with {shadow.live_core}, {verdict}{reason}",
        soft_wrap=True,
    )
    out.print(f"  {', '.join([*facts, time])}", soft_wrap=True)
    for step in shadow.steps:
        out.print(f"  {output_step_words(step)}", soft_wrap=True)
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for column in ("output", "compared", "largest difference", "rms", "NaN", "lag"):
        table.add_column(column, no_wrap=True)
    for output in shadow.outputs:
        table.add_row(
            f"{output.port}.{output.field}",
            str(output.compared),
            f"{output.maximum:.4g}",
            f"{output.rms:.4g}",
            str(output.nan),
            str(output.lag) if output.has_lag else "-",
        )
    if table.row_count:
        out.print(table)
