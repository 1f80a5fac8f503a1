"""A request to an executor, as several verbs send it."""

import argparse
import time
from typing import Any

_LOOK_S = 0.02  # between two looks at what a change cost


def add_request_fields(parser: argparse.ArgumentParser) -> None:
    """Arguments that every request has."""
    parser.add_argument("--cause", default="", help="reason of the request, for the log and the bag")
    parser.add_argument(
        "--request-id",
        default="",
        help="id of the request: a second request with it returns the first outcome",
    )
    parser.add_argument(
        "--expected-revision",
        type=int,
        default=0,
        metavar="N",
        help="refuse unless the architecture has revision N (see mauve list)",
    )


def send_request(args: argparse.Namespace, service_type: Any, name: str, **fields: Any) -> int:
    """Send a request to a service of the executor, and print the reply; returns the exit status."""
    from mauve_rt.cli.client import connected  # noqa: PLC0415
    from mauve_rt.cli.views import is_incomplete, print_reply, report_lines  # noqa: PLC0415

    request = service_type.Request(
        request_id=args.request_id,
        expected_revision=max(args.expected_revision, 0),
        requested_by="mauve",
        cause=args.cause,
        **fields,
    )
    with connected(first=True) as client:
        reply = client.call(service_type, f"{args.executor}/{name}", request)
        # Who repeats a request gets its outcome, with the releases that came meanwhile.
        until_s = time.monotonic() + getattr(args, "phase_timeout", 0.0)
        while is_incomplete(reply) and time.monotonic() < until_s:
            time.sleep(_LOOK_S)
            reply = client.call(service_type, f"{args.executor}/{name}", request)
    lines = [*getattr(reply, "loaded", ()), *report_lines(reply.report)]
    return print_reply(reply, as_json=args.json, lines=lines)
