"""The tables of two compared runs, as texts: the page and the terminal show the same."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from mauve_rt.trace.report.runs.compared import ComparedRuns
from mauve_rt.trace.report.runs.events import Act, Cost, order_in_words
from mauve_rt.trace.report.runs.timing import Figure
from mauve_rt.trace.report.runs.values import ComparedField
from mauve_rt.trace.report.runs.words import (
    change_text,
    interval_text,
    mark_text,
    text_of,
)
from mauve_rt.trace.report.units import number_text, share_text, time_text

_NONE = "\N{EN DASH}"
_MARK = "larger than noise"
VERDICTS = ("B / A", "B - A", "interval", "largest difference", _MARK)
"""Columns that tell how B differs; a page colours these of a marked row."""
_MANY_ROWS = 400


@dataclass(frozen=True)
class Row:
    """A row; marked when its difference is larger than the noise."""

    cells: tuple[str, ...]
    marked: bool = False


@dataclass(frozen=True)
class View:
    """One table. Its first columns are names, the next may be folded, the others are numbers."""

    heading: str
    names: tuple[str, ...]
    numbers: tuple[str, ...]
    words: tuple[str, ...] = ()
    rows: list[Row] = field(default_factory=list)
    note: str = ""

    @property
    def columns(self) -> tuple[str, ...]:
        """All of them, in order."""
        return (*self.names, *self.words, *self.numbers)

    @property
    def is_marked(self) -> bool:
        """Return whether a row is marked."""
        return any(row.marked for row in self.rows)


def timing_views(found: ComparedRuns) -> list[View]:
    """Return a table for each component that both runs have."""
    return [
        View(
            component,
            ("figure",),
            ("A", "B", "B / A", "interval", _MARK),
            rows=[_figure_row(one) for one in found.timing if one.subject == component],
        )
        for component in found.components
    ]


def decisions_view(found: ComparedRuns) -> View | None:
    """Return the table of rules that acted; None when no rule acted."""
    rows = [Row(_rule_cells(found, rule)) for rule in found.rules()]
    if not rows:
        return None
    times = ("cause to act, A: p50", "A: max", "B: p50", "B: max")
    numbers = ("acts in A", "in B", "order in A", "in B", *times, "only in")
    return View("Decisions", ("rule",), numbers, rows=rows[:_MANY_ROWS], note=order_in_words(*found.acts))


def reconfigurations_view(found: ComparedRuns) -> View | None:
    """Return the table of reconfigurations by kind; None when there was none."""
    rows = []
    for change in found.changes():
        costs = [run.get(change, Cost()) for run in found.costs]
        core = change.to_core.rpartition("/")[2] if change.from_core else change.to_core
        cells = (change.component, change.from_core.rpartition("/")[2] or _NONE, core)
        blackouts = [text for cost in costs for text in _spread(cost.blackouts_ns)]
        missed = [f"{cost.missed_releases:,}" if cost.count else _NONE for cost in costs]
        counts = [f"{cost.count:,}" for cost in costs]
        rows.append(Row((*cells, *counts, *blackouts, *missed, _only(*(cost.count for cost in costs)))))
    if not rows:
        return None
    blackout = ("blackout, A: p50", "A: max", "B: p50", "B: max")
    numbers = ("in A", "in B", *blackout, "missed in A", "in B", "only in")
    return View("Reconfigurations", ("component",), numbers, ("from", "to"), rows[:_MANY_ROWS])


def values_view(found: ComparedRuns) -> View | None:
    """Return the table of values; None when the bags share no topic with a number."""
    if not found.values.fields:
        return None
    numbers = ["mean in A", "in B", "B - A", "interval", _MARK]
    numbers += ["largest difference"] if found.simulated else []
    numbers += ["rms in A", "in B", "range in A", "in B", "samples in A", "in B"]
    rows = [Row(tuple(_value_cells(one, found)), one.differs) for one in found.values.fields]
    return View("Values", ("topic", "field"), tuple(numbers), rows=rows, note=" ".join(_left_out(found)))


def all_views(found: ComparedRuns) -> list[View]:
    """Return all tables."""
    others = (decisions_view(found), reconfigurations_view(found), values_view(found))
    return [*timing_views(found), *(view for view in others if view is not None)]


def _figure_row(figure: Figure) -> Row:
    both = text_of(figure, figure.a), text_of(figure, figure.b)
    cells = (figure.name, *both, change_text(figure), interval_text(figure), mark_text(figure))
    return Row(cells, figure.differs)


def _rule_cells(found: ComparedRuns, rule: str) -> tuple[str, ...]:
    runs = [[act for act in run if act.rule == rule] for run in found.acts]
    order = [list(dict.fromkeys(act.rule for act in run)) for run in found.acts]
    places = [f"{one.index(rule) + 1}." if rule in one else _NONE for one in order]
    delays = [text for run in runs for text in _spread(_delays(run))]
    counts = [len(run) for run in runs]
    return (rule, *(f"{count:,}" for count in counts), *places, *delays, _only(*counts))


def _delays(acts: Sequence[Act]) -> list[int]:
    return [act.delay_ns for act in acts if act.delay_ns is not None]


def _spread(times_ns: Sequence[int]) -> tuple[str, str]:
    """Median and maximum."""
    if not times_ns:
        return _NONE, _NONE
    median = np.quantile(times_ns, 0.5, method="inverted_cdf")
    return time_text(int(median)), time_text(max(times_ns))


def _only(count_a: int, count_b: int) -> str:
    return _NONE if count_a and count_b else "A" if count_a else "B"


def _value_cells(one: ComparedField, found: ComparedRuns) -> Iterator[str]:
    yield from one.field
    yield from map(number_text, (one.mean.a, one.mean.b))
    yield change_text(one.mean)
    yield interval_text(one.mean)
    yield "yes" if one.differs else mark_text(one.mean)
    if found.simulated:
        yield number_text(one.largest_difference)
    yield from map(number_text, (one.rms.a, one.rms.b))
    for run in (one.a, one.b):
        finite = run.finite
        ends = (float(finite.min()), float(finite.max())) if len(finite) else None
        yield " to ".join(map(number_text, ends)) if ends else _NONE
    for run in (one.a, one.b):
        yield f"{len(run.values):,}" + (f" ({share_text(run.nan_share)} NaN)" if run.nan_share else "")


def _left_out(found: ComparedRuns) -> Iterator[str]:
    yield "Mean and rms are compared; the mark is for either. Time stamps and long arrays are left out."
    yield from found.values.left_out
