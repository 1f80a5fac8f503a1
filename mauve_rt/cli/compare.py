"""`mauve report A B --compare`: two runs compared, as a page and as tables or JSON on standard output."""

import argparse
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mauve_rt.cli.bag_arguments import all_bags
from mauve_rt.cli.verb import BAD_USAGE, OK
from mauve_rt.counts import counted

if TYPE_CHECKING:  # numpy and rich take their time to load
    from rich.console import Group

    from mauve_rt.trace.report.runs.compared import ComparedRuns
    from mauve_rt.trace.report.runs.timing import Figure

_PLAIN = {
    "\N{NARROW NO-BREAK SPACE}": " ",
    "\N{MICRO SIGN}": "u",
    "\N{EN DASH}": "-",
    "\N{MINUS SIGN}": "-",
    "\N{MULTIPLICATION SIGN}": "x",
    "\N{INFINITY}": "inf",
    "\N{LEFT DOUBLE QUOTATION MARK}": '"',
    "\N{RIGHT DOUBLE QUOTATION MARK}": '"',
}
"""What a page writes, as every terminal shows it."""


def main(args: argparse.Namespace, out: Path) -> int:
    """Compare two runs; writes the page, and prints the tables or JSON.

    Raises:
        TraceError: a bag cannot be read, or the runs have no component in common.
        OSError: the page cannot be written.

    """
    from mauve_rt.cli.progress import shown  # noqa: PLC0415
    from mauve_rt.cli.tables import print_tables  # noqa: PLC0415
    from mauve_rt.cli.views import console, print_json  # noqa: PLC0415
    from mauve_rt.trace.progress import part  # noqa: PLC0415
    from mauve_rt.trace.report.bags import open_bags  # noqa: PLC0415
    from mauve_rt.trace.report.runs.compared import compare_runs  # noqa: PLC0415
    from mauve_rt.trace.report.runs.page import write_comparison  # noqa: PLC0415

    runs: list[Path] = args.bag
    if len(runs) != 2:  # noqa: PLR2004
        found = counted(len(runs), "argument")
        print(
            f"mauve: report --compare: expected two runs, A and B, found {found}. Name two bags; "
            "put several bags of one run into one folder and name the folder.",
            file=sys.stderr,
        )
        return BAD_USAGE
    names = str(runs[0]), str(runs[1])
    with shown() as progress:
        a = open_bags(all_bags(runs[:1]), progress=part(progress, 0, 0.3))
        b = open_bags(all_bags(runs[1:]), progress=part(progress, 0.3, 0.6))
        found_runs = compare_runs(a, b, names=names, progress=part(progress, 0.6, 1))
    write_comparison(out, found_runs, title=args.title or f"{names[1]} (B) compared with {names[0]} (A)")
    if args.json:
        print_json(comparison_values(found_runs))
        return OK
    print_tables(comparison_view(found_runs), console())
    print(f"{out} ({out.stat().st_size / 1e6:.1f} MB)")
    return OK


def comparison_view(found: "ComparedRuns") -> "Group":
    """Return the verdict and the tables of the page for the terminal."""
    from rich.console import Group  # noqa: PLC0415
    from rich.markup import escape  # noqa: PLC0415

    from mauve_rt.cli.tables import number_table  # noqa: PLC0415
    from mauve_rt.trace.report.runs.tables import all_views  # noqa: PLC0415
    from mauve_rt.trace.report.runs.words import verdict_on  # noqa: PLC0415

    verdict = verdict_on(found)
    parts: list[Any] = [escape(f"A: {found.names[0]}\nB: {found.names[1]}"), escape(plain(verdict.headline))]
    parts += [escape(plain(f"- {one.text}")) for one in verdict.sentences]
    for view in all_views(found):
        table = number_table(view.names, view.words, view.numbers)
        table.title, table.title_justify = escape(plain(view.heading)), "left"
        for row in view.rows:
            cells = (escape(plain(cell)) for cell in row.cells)
            table.add_row(*cells, style="bold yellow" if row.marked else None)
        parts.append(table)
        if view.note:
            parts.append(escape(plain(view.note)))
    return Group(*parts)


def plain(text: str) -> str:
    """Return a text of the page in the characters of every terminal."""
    for written, shown in _PLAIN.items():
        text = text.replace(written, shown)
    return text


def comparison_values(found: "ComparedRuns") -> dict[str, Any]:
    """Return the comparison for programs: times in ns; what is not known or not finite is null."""
    from mauve_rt.trace.report.runs.compared import only_in_one  # noqa: PLC0415
    from mauve_rt.trace.report.runs.words import verdict_on  # noqa: PLC0415

    return {
        "a": found.names[0],
        "b": found.names[1],
        "verdict": plain(verdict_on(found).headline),
        "tested": found.tested,
        "simulated": found.simulated,
        "figures": [_figure_values(one) for one in found.figures],
        "only_in": [{"run": run, "what": what} for run, what in only_in_one(found)],
        "acts": {run: [vars(act) for act in acts] for run, acts in zip("ab", found.acts, strict=True)},
        "reconfigurations": {
            run: [vars(change) | vars(cost) for change, cost in costs.items()]
            for run, costs in zip("ab", found.costs, strict=True)
        },
        "values": [
            {
                **one.field._asdict(),
                "samples": [len(run.values) for run in (one.a, one.b)],
                "nan_share": [run.nan_share for run in (one.a, one.b)],
                "min": [float(run.finite.min()) if len(run.finite) else None for run in (one.a, one.b)],
                "max": [float(run.finite.max()) if len(run.finite) else None for run in (one.a, one.b)],
                "largest_difference": one.largest_difference,
                "differs": one.differs,
            }
            for one in found.values.fields
        ],
        "left_out": found.values.left_out,
    }


def _figure_values(figure: "Figure") -> dict[str, Any]:
    judged = figure.judged
    change = None
    if judged is not None:
        kind = "ratio" if judged.is_ratio else "difference"
        change = {"kind": kind, **{key: _finite(getattr(judged, key)) for key in ("value", "low", "high")}}
    return {
        "subject": figure.subject,
        "measure": figure.measure,
        "statistic": figure.statistic,
        "unit": "ns" if figure.is_time else "",
        "a": _finite(figure.a),
        "b": _finite(figure.b),
        "change": change,
        "differs": figure.differs,
        "remark": figure.remark,
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
