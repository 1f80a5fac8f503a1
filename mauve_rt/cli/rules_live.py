"""`mauve rules list` and `load`: the rules that an executor runs, while it does."""

import argparse
import sys
from pathlib import Path
from typing import Any

from mauve_rt.cli.arguments import add_executor_and_json
from mauve_rt.cli.verb import OK
from mauve_rt.supervision.truth import truth_word


def add_list(parser: argparse.ArgumentParser) -> None:
    """Whose."""
    add_executor_and_json(parser)


def add_load(parser: argparse.ArgumentParser) -> None:
    """Whose, and from where."""
    add_executor_and_json(parser)
    parser.add_argument(
        "file",
        nargs="?",
        default="",
        metavar="FILE",
        help="rules file, on the executor's computer (default: read the present file again)",
    )


def list_rules(args: argparse.Namespace) -> int:
    """How each rule fares."""
    from mauve_msgs.srv import ListRules  # noqa: PLC0415 - ROS takes its time to load
    from mauve_rt.cli.client import connected  # noqa: PLC0415
    from mauve_rt.cli.views import console, print_json  # noqa: PLC0415

    with connected(first=True) as client:
        reply = client.call(ListRules, f"{args.executor}/list_rules", ListRules.Request())
    if args.json:
        print_json(reply)
        return OK
    if not reply.rules:
        print(f"{args.executor} runs no rule", file=sys.stderr)
        return OK
    from rich import box  # noqa: PLC0415
    from rich.markup import escape  # noqa: PLC0415
    from rich.table import Table  # noqa: PLC0415

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for column in ("rule", "armed", "condition", "stands", "next", "prepared"):
        table.add_column(column, no_wrap=column != "stands")
    for rule in reply.rules:
        table.add_row(rule.name, *(escape(text) for text in _row(rule)))
    out = console()
    out.print(table)
    for rule in reply.rules:
        if rule.problem:
            out.print(f"[bold red]{rule.name}[/] cannot act: {escape(rule.problem)}", soft_wrap=True)
    return OK


def load_rules(args: argparse.Namespace) -> int:
    """Let the executor run a file's rules, all or none."""
    from mauve_msgs.srv import LoadRules  # noqa: PLC0415
    from mauve_rt.cli.client import connected  # noqa: PLC0415
    from mauve_rt.cli.views import print_reply  # noqa: PLC0415

    path = str(Path(args.file).absolute()) if args.file else ""
    with connected(first=True) as client:
        reply = client.call(LoadRules, f"{args.executor}/load_rules", LoadRules.Request(path=path))
    return print_reply(reply, as_json=args.json)


def _row(rule: Any) -> tuple[str, str, str, str, str]:
    """Armed, the condition, what it has done, what comes next, what is ready for it."""
    if not rule.armed:
        return "no", "-", "what it is about does not run", "-", _prepared(rule)
    holds = f"{truth_word(rule)} for {rule.since_s:.1f} s"
    stands = "in effect" if rule.in_effect else "watching"
    if rule.changed_by_another:
        stands = "waits: another requester changed what it did"
    coming = f"{rule.next} in {rule.next_in_s:.1f} s" if rule.next else "-"
    return "yes", holds, stands, coming, _prepared(rule)


def _prepared(rule: Any) -> str:
    if not rule.ready:
        return "no"
    return f"{rule.memory_bytes / 1024:.0f} KiB" if rule.memory_bytes else "yes"
