"""`mauve report BAG...`: one page about a run, or about two runs compared."""

import argparse
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from mauve_rt.cli import compare
from mauve_rt.cli.bag_arguments import all_bags
from mauve_rt.cli.verb import BAD_USAGE, OK

if TYPE_CHECKING:
    from mauve_rt.trace.report.analysis import Analysis
    from mauve_rt.trace.report.blocks import Section


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the verb's arguments."""
    parser.add_argument(
        "bag",
        nargs="+",
        type=Path,
        help="bags of one run: rosbag2 folders, folders with several bags, or MCAP files",
    )
    parser.add_argument(
        "--out",
        type=Path,
        metavar="FILE.html",
        help="file of the page (default: report.html, or comparison.html, in the first folder, "
        "or next to the first file)",
    )
    parser.add_argument("--title", default="", help="title of the page (default: names of the bags)")
    parser.add_argument(
        "--compare",
        action="store_true",
        help="compare two runs, A and B (each a bag or a folder of bags), and mark differences that are "
        "larger than the noise",
    )
    parser.add_argument("--json", action="store_true", help="print the comparison as JSON")


def main(args: argparse.Namespace) -> int:
    """Write the page; prints where it is."""
    if args.json and not args.compare:
        print("mauve: report: --json prints a comparison. Add --compare.", file=sys.stderr)
        return BAD_USAGE
    first: Path = args.bag[0]
    name = "comparison.html" if args.compare else "report.html"
    out = args.out or (first if first.is_dir() else first.parent) / name
    try:
        return compare.main(args, out) if args.compare else _report(args, out)
    except BrokenPipeError:
        raise  # the reader of the tables is gone
    except OSError as error:
        print(f"mauve: report {out}: cannot be written ({error.strerror or error})", file=sys.stderr)
        return BAD_USAGE


def _report(args: argparse.Namespace, out: Path) -> int:
    from mauve_rt.cli.progress import shown  # noqa: PLC0415 - numpy and rich take their time to load
    from mauve_rt.trace.progress import part  # noqa: PLC0415
    from mauve_rt.trace.report import write_report  # noqa: PLC0415
    from mauve_rt.trace.report.bags import bag_names, open_bags  # noqa: PLC0415

    bags = all_bags(args.bag)
    title = args.title or f"Trace of {', '.join(bag_names(bags))}"
    with shown() as progress:
        trace = open_bags(bags, progress=part(progress, 0, 0.5))
        more = _timing() if trace.threads is not None else []
        write_report(out, trace, title=title, more=more, progress=part(progress, 0.5, 1))
    print(f"{out} ({out.stat().st_size / 1e6:.1f} MB)")
    return OK


def _timing() -> "list[Callable[[Analysis], Section | None]]":
    """The section about the timing proof, which needs the native library."""
    try:
        from mauve_rt.cli.timing_section import timing_section  # noqa: PLC0415
    except ImportError:
        return []  # this computer only reads bags
    return [timing_section]
