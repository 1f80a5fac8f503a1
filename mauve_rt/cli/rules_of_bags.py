"""`mauve rules explain` and `mauve rules replay`: rules and what a bag tells of them."""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from mauve_rt.cli.bag_arguments import one_bag
from mauve_rt.cli.verb import BAD_USAGE, OK, REFUSED

if TYPE_CHECKING:  # loaded by those who use it only
    from mauve_rt.supervision.rules import RulesFile
    from mauve_rt.trace.reading.trace import Trace


def add_explain(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `explain`."""
    _add_bag(parser)
    parser.add_argument(
        "--at",
        type=float,
        metavar="T",
        help="show the state of each rule T seconds after the start of the bag",
    )


def explain(args: argparse.Namespace) -> int:
    """Tell what was decided, or how each rule stood at an instant; refuses a bag without decisions."""
    from mauve_rt.supervision.explanation import (  # noqa: PLC0415
        standing_lines,
        standings,
        story,
        story_lines,
    )

    trace = _opened(args.bag)
    begin_ns, end_ns = trace.span_ns
    lasts_s = (end_ns - begin_ns) / 1e9
    if args.at is not None and not 0 <= args.at <= lasts_s:
        print(f"--at {args.at:g}: expected s from the bag's begin, 0 to {lasts_s:.3f}", file=sys.stderr)
        return BAD_USAGE
    entries = story(trace)
    if not entries:
        print(f"{args.bag}: no rule decided anything: no decision is in the bag", file=sys.stderr)
        return REFUSED
    if args.at is None:
        lines = story_lines(entries, begin_ns)
    else:
        lines = standing_lines(standings(entries, begin_ns + round(args.at * 1e9)), begin_ns)
    print(*lines, sep="\n")
    return OK


def add_replay(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `replay`."""
    parser.add_argument("file", type=Path, metavar="FILE", help="rules file")
    _add_bag(parser)


def replay(args: argparse.Namespace) -> int:
    """Compare what rules would have done with what was done; refuses where they differ."""
    from mauve_rt.supervision.explanation import story  # noqa: PLC0415
    from mauve_rt.supervision.replay import (  # noqa: PLC0415
        acted_then,
        compared,
        comparison_lines,
        replayed,
    )
    from mauve_rt.supervision.rules import RulesFile  # noqa: PLC0415

    file = RulesFile(args.file)
    trace = _opened(args.bag)
    left_out = _not_in_bag(file, trace)
    rules = [rule for rule in file.rules.rules if rule.name not in left_out]
    if not rules:
        print(f"{args.bag}: no rule of {file.path} can be replayed", file=sys.stderr)
        return REFUSED
    told = story(trace)
    found = compared(rules, acted_then(rules, told), replayed(file, trace, told, left_out=left_out))
    if found:
        print(*comparison_lines(found, trace.span_ns[0]), sep="\n")
    differing = sum(not one.matches for one in found)
    print(f"rules: {len(rules)}, actions: {len(found)}, differing: {differing}")
    return REFUSED if differing else OK


def _not_in_bag(file: "RulesFile", trace: "Trace") -> set[str]:
    """The rules that the bag has not enough for; tells what it lacks."""
    from mauve_rt.supervision.recorded_signals import RecordedSignals  # noqa: PLC0415

    signals = RecordedSignals(trace)
    found = set()
    for rule in file.rules.rules:
        if missing := signals.missing(rule):
            print(f"not in the bag: {', '.join(missing)}: rule {rule.name} is left out", file=sys.stderr)
            found.add(rule.name)
    return found


def _add_bag(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("bag", type=Path, metavar="BAG", help="folder of a bag, or one of its files")


def _opened(bag: Path) -> "Trace":
    import mauve_rt.trace  # noqa: PLC0415
    from mauve_rt.cli.progress import shown  # noqa: PLC0415

    with shown() as progress:
        return mauve_rt.trace.open(one_bag(bag), progress=progress)
