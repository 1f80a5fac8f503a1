"""`mauve record`: start or stop a recording of an executor, or write a snapshot of its last seconds."""

import argparse

from mauve_rt.cli.arguments import add_executor_and_json
from mauve_rt.cli.completion import complete_values, completed_by
from mauve_rt.cli.request import add_request_fields, send_request
from mauve_rt.trace.bag.recorded import COMPRESSIONS


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Of `mauve record`."""
    actions = parser.add_subparsers(title="actions", metavar="start|snapshot|stop", required=True)
    start = actions.add_parser("start", help="start a recording into a new bag")
    snapshot = actions.add_parser("snapshot", help="write the last seconds of a recording as a bag")
    stop = actions.add_parser("stop", help="end the recording and complete the bag")
    for action, send in ((start, _start), (snapshot, _snapshot), (stop, _stop)):
        action.set_defaults(send=send)
        add_executor_and_json(action)
    start.add_argument(
        "bag",
        nargs="?",
        default="",
        help="folder of the bag, below the executor's parameter `bags` (default: named by the time)",
    )
    start.add_argument(
        "--topic",
        action="append",
        default=[],
        metavar="NAME[:TYPE[:QOS]]",
        help="record this topic too; '/camera/*' takes topics by a pattern, also those that appear later; "
        "may be repeated",
    )
    start.add_argument(
        "--topic-regex",
        action="append",
        default=[],
        metavar="REGEX",
        help="record each topic whose name contains a match, also those that appear later; may be repeated",
    )
    values = start.add_argument(
        "--value",
        action="append",
        default=[],
        metavar="NAME",
        help="record every write to this resource, or COMPONENT.PORT, too; may be repeated",
    )
    completed_by(values, complete_values)
    start.add_argument(
        "--split-s",
        type=float,
        default=0.0,
        metavar="S",
        help="seconds until the bag goes on in a new file (default 60)",
    )
    start.add_argument(
        "--split-mb",
        type=float,
        default=0.0,
        metavar="MB",
        help="size at which the bag goes on in a new file (default: no limit)",
    )
    start.add_argument(
        "--max-size-mb",
        type=float,
        default=0.0,
        metavar="MB",
        help="size of the whole bag: beyond it the oldest file is deleted (default: no limit)",
    )
    start.add_argument(
        "--compression",
        choices=COMPRESSIONS,
        default="none",
        help="compression of the chunks of the files (default: none)",
    )
    start.add_argument(
        "--snapshot",
        type=float,
        default=0.0,
        metavar="SECONDS",
        help="keep the last SECONDS in memory instead of writing a bag; `mauve record snapshot` writes them. "
        "BAG is then the folder in which snapshots are created",
    )
    start.add_argument(
        "--snapshot-mb",
        type=float,
        default=0.0,
        metavar="MB",
        help="largest memory of --snapshot; beyond it the oldest data is dropped sooner (default: 268)",
    )
    snapshot.add_argument(
        "--bag",
        default="",
        metavar="DIR",
        help="folder of the snapshot, below the executor's parameter `bags` (default: named by the time)",
    )
    for action in (start, snapshot, stop):
        add_request_fields(action)


def main(args: argparse.Namespace) -> int:
    """Send the request."""
    status: int = args.send(args)
    return status


def _start(args: argparse.Namespace) -> int:
    from mauve_msgs.srv import StartRecording  # noqa: PLC0415

    return send_request(
        args,
        StartRecording,
        "start_recording",
        bag=args.bag,
        topics=args.topic,
        topic_regexes=args.topic_regex,
        values=args.value,
        split_s=args.split_s,
        split_bytes=max(round(args.split_mb * 1e6), 0),
        compression=args.compression,
        max_size_bytes=max(round(args.max_size_mb * 1e6), 0),
        snapshot_s=args.snapshot,
        snapshot_bytes=max(round(args.snapshot_mb * 1e6), 0),
    )


def _snapshot(args: argparse.Namespace) -> int:
    from mauve_msgs.srv import WriteSnapshot  # noqa: PLC0415

    return send_request(args, WriteSnapshot, "write_snapshot", bag=args.bag)


def _stop(args: argparse.Namespace) -> int:
    from mauve_msgs.srv import StopRecording  # noqa: PLC0415

    return send_request(args, StopRecording, "stop_recording")
