"""`mauve mirror NODE RESOURCE|COMPONENT.PORT`: a value of an executor on a ROS topic, while it runs."""

import argparse
import sys

from mauve_rt.cli.arguments import add_executor, add_value, positive_rate
from mauve_rt.cli.verb import BAD_USAGE, OK, REFUSED

_MOST_HZ = 1000.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Of `mauve mirror`."""
    add_executor(parser)
    what = "a resource, or COMPONENT.PORT of a read or write port; not needed with --stop"
    add_value(parser, what, nargs="?")
    parser.add_argument("--field", metavar="F", default="", help="one number of it, such as position.x")
    parser.add_argument(
        "--topic",
        metavar="NAME",
        default="",
        help="topic to publish on (default: mirror/VALUE below the executor's name)",
    )
    parser.add_argument(
        "--rate",
        type=positive_rate(_MOST_HZ),
        default=0.0,
        metavar="HZ",
        help=f"most messages a second (default 50, at most {_MOST_HZ:g})",
    )
    parser.add_argument(
        "--stop", action="store_true", help="end the mirrors of the value, or of the topic, or all"
    )
    parser.add_argument("--json", action="store_true", help="print the reply as JSON")


def main(args: argparse.Namespace) -> int:
    """Start or stop a mirror."""
    if not args.value and not args.stop:
        print("mauve: name a resource, or COMPONENT.PORT (see mauve list)", file=sys.stderr)
        return BAD_USAGE
    from mauve_msgs.srv import Mirror  # noqa: PLC0415 - ROS takes its time to load
    from mauve_rt.cli.client import connected  # noqa: PLC0415
    from mauve_rt.cli.views import print_json  # noqa: PLC0415

    request = Mirror.Request(
        stop=args.stop, name=args.value, field=args.field, topic=args.topic, rate_hz=args.rate
    )
    with connected(first=True) as client:
        reply = client.call(Mirror, f"{args.executor}/mirror", request)
    if args.json:
        print_json(reply)
    elif reply.success:
        print(reply.message)
    else:
        print(f"refused: {reply.message}", file=sys.stderr)
    return OK if reply.success else REFUSED
