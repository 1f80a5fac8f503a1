"""`mauve changes NODE`: the changes of an executor that are not complete, and the way out of one."""

import argparse
from collections.abc import Iterator
from typing import Any

from mauve_rt.cli.arguments import add_executor_and_json
from mauve_rt.cli.completion import complete_components, completed_by
from mauve_rt.cli.verb import OK


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Of `mauve changes`."""
    add_executor_and_json(parser)
    component = parser.add_argument(
        "--abandon",
        metavar="COMPONENT",
        default="",
        help="call off the change that waits for this component, or for a hook of a part that it adds; if "
        "the change is decided, or a state of the component hangs, give the component up: it becomes "
        "FAULTED, with safe outputs",
    )
    completed_by(component, complete_components)


def main(args: argparse.Namespace) -> int:
    """List the open changes, or end one."""
    from mauve_msgs.srv import AbandonChange, ListChanges  # noqa: PLC0415 - ROS takes its time to load
    from mauve_rt.cli.client import connected  # noqa: PLC0415
    from mauve_rt.cli.views import print_json, print_reply  # noqa: PLC0415

    with connected(first=True) as client:
        if args.abandon:
            request = AbandonChange.Request(component=args.abandon)
            reply = client.call(AbandonChange, f"{args.executor}/abandon_change", request)
            return print_reply(reply, as_json=args.json)
        reply = client.call(ListChanges, f"{args.executor}/list_changes", ListChanges.Request())
    if args.json:
        print_json(reply)
    else:
        print("\n".join(change_lines(reply, args.executor)))
    return OK


def change_lines(reply: Any, executor: str) -> Iterator[str]:
    """What a ListChanges reply says, in words."""
    from mauve_rt.control.open_changes import done_with, in_hook, in_state  # noqa: PLC0415 - it loads messages
    from mauve_rt.counts import duration  # noqa: PLC0415
    from mauve_rt.interfaces.changes import PHASES  # noqa: PLC0415

    for change in reply.changes:
        phase = PHASES.get(change.phase, str(change.phase))
        by = f" by {change.author}" if change.author else ""
        yield f"{phase}, begun {duration(change.age_ns)} ago{by}: {'; '.join(change.steps)}{in_hook(change)}"
        for late in change.late:
            yield f"  late: {late.name} has not {done_with(phase)} the change, {in_state(late)}"
    if reply.cleanup:
        yield f"{reply.cleanup}, for {duration(reply.cleanup_age_ns)}"
    ending = {late.name: True for change in reply.changes for late in change.late if not late.left_behind}
    yield from (f"to end it: mauve changes {executor} --abandon {name}" for name in ending)
    if not reply.changes:
        yield "no open change"
