"""`mauve rules list` and `load`: the rules that an executor runs, while it does."""

import argparse
import sys
from pathlib import Path
from typing import Any

from mauve_rt.cli.arguments import add_executor_and_json
from mauve_rt.cli.verb import BAD_USAGE, OK
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
        help="rules file, on the executor's computer, below its parameter rules_folder "
        "(default: read the present file again)",
    )
    parser.add_argument(
        "--release",
        action="append",
        default=[],
        metavar="RULE",
        help="let go of this active safety rule where the file lacks it; may be repeated",
    )


def list_rules(args: argparse.Namespace) -> int:
    """How each rule fares."""
    from mauve_msgs.srv import ListRules  # noqa: PLC0415 - ROS takes its time to load
    from mauve_rt.cli.client import connected  # noqa: PLC0415
    from mauve_rt.cli.list_view import print_held  # noqa: PLC0415
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
    print_held(reply, out)
    return OK


def load_rules(args: argparse.Namespace) -> int:
    """Let the executor run a file's rules, all or none."""
    from mauve_msgs.srv import LoadRules  # noqa: PLC0415

    path = str(Path(args.file).absolute()) if args.file else ""
    return _ask(args, LoadRules, "load_rules", path=path, release=args.release)


def add_reset(parser: argparse.ArgumentParser) -> None:
    """Whose, and what."""
    add_executor_and_json(parser)
    parser.add_argument("rule", nargs="?", default="", metavar="RULE", help="name of the latched rule")
    parser.add_argument(
        "--value",
        default="",
        metavar="COMPONENT",
        help="let the values of this component be put in again that a probation or a fault has rejected",
    )


def reset(args: argparse.Namespace) -> int:
    """End a latched rule, or a quarantine."""
    from mauve_msgs.srv import ResetRule  # noqa: PLC0415

    if bool(args.rule) == bool(args.value):
        print("mauve rules reset: name either a rule or --value COMPONENT", file=sys.stderr)
        return BAD_USAGE
    return _ask(args, ResetRule, "reset_rule", rule=args.rule, component=args.value)


def add_release(parser: argparse.ArgumentParser) -> None:
    """Whose, and over which."""
    add_executor_and_json(parser)
    parser.add_argument(
        "rule", nargs="?", default="", metavar="RULE", help="only what is over this rule (default: all of it)"
    )


def release(args: argparse.Namespace) -> int:
    """End what was put over rules."""
    from mauve_msgs.srv import ReleaseRules  # noqa: PLC0415

    return _ask(args, ReleaseRules, "release_rules", rule=args.rule)


def _ask(args: argparse.Namespace, service_type: Any, name: str, **fields: Any) -> int:
    """Ask the executor, and print what it answers."""
    from mauve_rt.cli.client import connected  # noqa: PLC0415
    from mauve_rt.cli.views import print_reply  # noqa: PLC0415

    with connected(first=True) as client:
        reply = client.call(service_type, f"{args.executor}/{name}", service_type.Request(**fields))
    return print_reply(reply, as_json=args.json)


def _row(rule: Any) -> tuple[str, str, str, str, str]:
    """Armed, the condition, what it has done, what comes next, what is ready for it."""
    if not rule.armed:
        return "no", "-", "what it is about does not run", "-", _prepared(rule)
    holds = f"{truth_word(rule)} for {rule.since_s:.1f} s"
    stands = "in effect" if rule.in_effect else "watching"
    if rule.active and not rule.in_effect:
        stands = "active, not done yet"
    coming = f"{rule.next} in {rule.next_in_s:.1f} s" if rule.next else "-"
    return "yes", holds, stands, coming, _prepared(rule)


def _prepared(rule: Any) -> str:
    if not rule.ready:
        return "no"
    return f"{rule.memory_bytes / 1024:.0f} KiB" if rule.memory_bytes else "yes"
