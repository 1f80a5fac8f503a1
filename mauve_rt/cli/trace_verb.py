"""`mauve trace ...`: what can be done with recorded traces. Its sub-verbs are the table at the end."""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import mauve_rt.trace
from mauve_rt.cli.bag_arguments import all_bags, one_bag
from mauve_rt.cli.verb import OK, REFUSED, Verb
from mauve_rt.trace.errors import TraceError
from mauve_rt.trace.progress import Progress, part

if TYPE_CHECKING:  # numpy takes its time to load
    from mauve_rt.trace.reading.trace import Trace


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the sub-verbs."""
    verbs = parser.add_subparsers(title="verbs", metavar="VERB", required=True)
    for verb in SUB_VERBS:
        subparser = verbs.add_parser(verb.name, help=verb.help, description=verb.help)
        verb.add_arguments(subparser)
        subparser.set_defaults(trace_verb=verb)


def main(args: argparse.Namespace) -> int:
    """Run the sub-verb; returns the exit status."""
    verb: Verb = args.trace_verb
    return verb.main(args)


def _add_export(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "bags",
        nargs="+",
        type=Path,
        metavar="BAG",
        help="folder of one bag or of several; several bags are merged",
    )
    parser.add_argument(
        "--format",
        choices=("perfetto", "csv"),
        default="perfetto",
        help="perfetto: for ui.perfetto.dev (default); csv: tables, and a file for each topic",
    )
    parser.add_argument(
        "--out",
        type=Path,
        metavar="PATH",
        help="output (default: BAG.pftrace, or the folder BAG_csv, in the current folder)",
    )
    parser.add_argument("--force", action="store_true", help="overwrite an existing file")


def _export(args: argparse.Namespace) -> int:
    from mauve_rt.cli.progress import shown  # noqa: PLC0415 - only this verb draws, and pandas is slow to load

    bags = all_bags(args.bags)
    name = bags[0].resolve().name if len(bags) == 1 else "traces"
    problems: list[str] = []
    with shown() as progress:
        traces = _open(bags, part(progress, 0.0, 0.5))
        writing = part(progress, 0.5, 1.0)
        if args.format == "csv":
            from mauve_rt.trace.export.csv_files import export_csv  # noqa: PLC0415
            from mauve_rt.trace.reading.trace import merge_traces  # noqa: PLC0415

            out = args.out or Path(f"{name}_csv")
            trace = merge_traces(traces) if len(traces) > 1 else traces[name]
            problems = export_csv(trace, out, force=args.force, progress=writing)
        else:
            from mauve_rt.trace.export.perfetto import export_perfetto  # noqa: PLC0415

            out = args.out or Path(f"{name}.pftrace")
            problems = export_perfetto(traces, out, force=args.force, progress=writing)
    for problem in problems:
        print(f"note: left out: {problem}", file=sys.stderr)
    print(out)
    return OK


def _open(bags: list[Path], progress: Progress) -> "dict[str, Trace]":
    """The traces by the names of their bags."""
    traces: dict[str, Trace] = {}
    for number, bag in enumerate(bags):
        name = bag.resolve().name
        if name in traces:
            raise TraceError(
                f"bag {bag}: another one is named {name}, too; export them one by one or rename it"
            )
        progress_of_one = part(progress, number / len(bags), (number + 1) / len(bags))
        traces[name] = mauve_rt.trace.open(bag, progress=progress_of_one)
    return traces


def _add_bag(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("bag", type=Path, help="folder of a bag, or one of its files")


def _add_bag_and_json(parser: argparse.ArgumentParser) -> None:
    _add_bag(parser)
    parser.add_argument("--json", action="store_true", help="print JSON")


def _info(args: argparse.Namespace) -> int:
    from mauve_rt.cli.progress import shown  # noqa: PLC0415
    from mauve_rt.cli.tables import print_tables  # noqa: PLC0415
    from mauve_rt.cli.trace_views import info_values, info_view  # noqa: PLC0415
    from mauve_rt.cli.views import console, print_json  # noqa: PLC0415

    with shown() as progress:
        trace = mauve_rt.trace.open(one_bag(args.bag), progress=progress)
    values = info_values(trace)
    if args.json:
        print_json(values)
    else:
        print_tables(info_view(values), console())
    return OK


def _check(args: argparse.Namespace) -> int:
    from mauve_rt.cli.progress import shown  # noqa: PLC0415
    from mauve_rt.trace.reading.check import check_bag  # noqa: PLC0415

    bag = one_bag(args.bag)
    with shown() as progress:
        findings = check_bag(bag, progress=progress)
    for finding in findings:
        print(f"{finding.kind}: {finding.text}")
    bad = [finding for finding in findings if finding.kind != "note"]
    if not bad:
        print(f"{bag}: whole, nothing of the executor is missing, no split change found")
    elif any(finding.is_damage for finding in bad):
        print(f"`mauve trace repair {bag}` makes a bag of it that every reader opens")
    return REFUSED if bad else OK


def _repair(args: argparse.Namespace) -> int:
    from mauve_rt.cli.progress import shown  # noqa: PLC0415
    from mauve_rt.trace.bag.repair import examine_bag, repair_bag  # noqa: PLC0415

    bag = one_bag(args.bag)
    with shown() as progress:
        state = examine_bag(bag, progress=progress)
        repair_bag(state)
    if state.is_finished and not state.removed:
        print(f"{bag}: nothing to repair")
    for path in state.removed:
        print(f"deleted: {path.name}, which max_size_bytes had removed from the bag")
    for damage in state.damages():
        print(f"repaired: {damage}")
    return OK


def _add_snapshot(parser: argparse.ArgumentParser) -> None:
    _add_bag(parser)
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="the copy (default: BAG_snapshot, in the current folder)"
    )


def _snapshot(args: argparse.Namespace) -> int:
    from mauve_rt.cli.progress import shown  # noqa: PLC0415
    from mauve_rt.trace.bag.snapshot import snapshot_bag  # noqa: PLC0415

    bag = one_bag(args.bag)
    out = args.out or Path(f"{bag.resolve().stem}_snapshot")
    with shown() as progress:
        snapshot_bag(bag, out, progress=progress)
    print(out)
    return OK


def _stats(args: argparse.Namespace) -> int:
    from mauve_rt.cli.progress import shown  # noqa: PLC0415
    from mauve_rt.cli.tables import print_tables  # noqa: PLC0415
    from mauve_rt.cli.trace_views import statistics_values, statistics_view  # noqa: PLC0415
    from mauve_rt.cli.views import console, print_json  # noqa: PLC0415
    from mauve_rt.trace.reading.reconfigurations import reconfigurations  # noqa: PLC0415
    from mauve_rt.trace.reading.statistics import all_statistics  # noqa: PLC0415

    with shown() as progress:
        trace = mauve_rt.trace.open(one_bag(args.bag), progress=part(progress, 0.0, 0.5))
        statistics = all_statistics(trace, progress=part(progress, 0.5, 1.0))
    if args.json:
        print_json({name: statistics_values(one) for name, one in statistics.items()})
    else:
        print_tables(statistics_view(statistics, reconfigurations(trace)), console())
    return OK


SUB_VERBS = (
    Verb("info", "show the contents of a bag", _add_bag_and_json, _info),
    Verb(
        "check",
        "check that a bag is complete, lost no record, and has no change with mixed releases",
        _add_bag,
        _check,
    ),
    Verb("repair", "complete a bag that a kill or a full disk left incomplete", _add_bag, _repair),
    Verb("snapshot", "copy a bag that is being written, for every reader", _add_snapshot, _snapshot),
    Verb("stats", "show times and counts of components, states and services", _add_bag_and_json, _stats),
    Verb("export", "convert a trace for ui.perfetto.dev, or to CSV files", _add_export, _export),
)
