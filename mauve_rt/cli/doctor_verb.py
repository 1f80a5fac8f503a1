"""`mauve doctor [NODE]`: does this computer, this shell and this installation suit an executor?"""

import argparse
import math
import sys
from collections.abc import Iterator
from dataclasses import asdict, replace
from typing import TYPE_CHECKING

from mauve_rt.cli.arguments import absolute_name
from mauve_rt.cli.completion import complete_executors, completed_by
from mauve_rt.cli.verb import BAD_USAGE, OK, REFUSED
from mauve_rt.errors import MauveError, exception_text, one_line

if TYPE_CHECKING:
    from mauve_rt.doctor.finding import Finding
    from mauve_rt.doctor.wakeup import Wakeup

_SECONDS, _MOST_SECONDS = 5.0, 86_400.0
_EXECUTORS, _WAKEUP = "executors", "wake-up test"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The executor, and how long to measure."""
    name = parser.add_argument(
        "executor",
        nargs="?",
        type=absolute_name,
        metavar="NODE",
        help="examine this executor too, as it runs, e.g. /robot_1/executor",
    )
    completed_by(name, complete_executors)
    parser.add_argument(
        "--seconds",
        type=float,
        default=_SECONDS,
        metavar="S",
        help=f"length of the wake-up test (default {_SECONDS:g}; 0: leave it out)",
    )
    parser.add_argument(
        "--json", action="store_true", help="print JSON, for programs and for `mauve analyze`"
    )


def main(args: argparse.Namespace) -> int:
    """Print a line for each finding; returns the exit status: 0 no error, 1 an error."""
    from mauve_rt.doctor.finding import Status  # noqa: PLC0415 - only this verb

    if not math.isfinite(args.seconds) or not 0 <= args.seconds <= _MOST_SECONDS:
        limits = f"0 to {_MOST_SECONDS:g}"
        print(f"mauve: --seconds: expected {limits}, found {args.seconds:g}", file=sys.stderr)
        return BAD_USAGE
    findings: list[Finding] = []
    for finding in _examined(args.executor):
        findings.append(finding)
        if not args.json:
            _print(finding)
    measured, told = _measured(args.seconds)
    findings += told
    if args.json:
        from mauve_rt.cli.views import print_json  # noqa: PLC0415

        wakeup = None if measured is None else asdict(measured)
        print_json({"findings": [asdict(each) for each in findings], "wakeup": wakeup})
    else:
        from mauve_rt.cli.doctor_view import print_summary, print_wakeup  # noqa: PLC0415

        for each in told:
            _print(each)
        if measured is not None:
            print_wakeup(measured)
        print_summary(findings)
    return REFUSED if any(each.status == Status.ERROR for each in findings) else OK


def _examined(node: str | None) -> "Iterator[Finding]":
    from mauve_rt.doctor.checks import CHECKS, examine  # noqa: PLC0415
    from mauve_rt.doctor.executors import describe_not_asked  # noqa: PLC0415
    from mauve_rt.doctor.finding import Computer, Status  # noqa: PLC0415
    from mauve_rt.doctor.network import check_discovery  # noqa: PLC0415

    is_reached = True
    for check in CHECKS:
        found = examine(check, Computer())
        if check.examine is check_discovery:
            is_reached = all(each.status == Status.OK for each in found)
        yield from found
    if not is_reached:  # the wrong middleware would end this process
        yield replace(describe_not_asked(node), name=node or _EXECUTORS)
        return
    try:
        yield from _of_executors(node)
    except Exception as problem:  # noqa: BLE001 - whatever ROS raises is a finding
        yield _unreached(node or _EXECUTORS, exception_text(problem))


def _of_executors(node: str | None) -> "Iterator[Finding]":
    """The executors that answer, and what the one of this name says of itself."""
    from mauve_msgs.srv import ListComponents  # noqa: PLC0415 - ROS takes its time to load
    from mauve_rt.cli.client import connected  # noqa: PLC0415
    from mauve_rt.doctor.executors import describe_executor, describe_found  # noqa: PLC0415
    from mauve_rt.doctor.rights import missing_rights  # noqa: PLC0415

    name = _EXECUTORS
    try:
        with connected(first=True) as client:
            for finding in describe_found(client.find_executors()):
                yield replace(finding, name=name)
            if node is not None:
                name = node
                reply = client.call(ListComponents, f"{node}/list_components", ListComponents.Request())
                for finding in describe_executor(reply, missing_rights()):
                    yield replace(finding, name=name)
    except MauveError as problem:
        yield _unreached(name, one_line(str(problem)))


def _unreached(name: str, problem: str) -> "Finding":
    from mauve_rt.doctor.executors import describe_unreached  # noqa: PLC0415

    return replace(describe_unreached(problem), name=name)


def _measured(seconds: float) -> "tuple[Wakeup | None, list[Finding]]":
    """The outcome of the wake-up test, if there is one, and its lines."""
    from mauve_rt.doctor.wakeup import describe, describe_missing, measure  # noqa: PLC0415

    if not seconds:
        return None, []
    try:
        measured = measure(seconds)
    except MauveError as problem:
        return None, [replace(describe_missing(one_line(str(problem))), name=_WAKEUP)]
    return measured, [replace(each, name=_WAKEUP) for each in describe(measured)]


def _print(finding: "Finding") -> None:
    from mauve_rt.cli.doctor_view import print_finding  # noqa: PLC0415 - rich takes its time to load

    print_finding(finding)
    sys.stdout.flush()
