"""Values of resources and topics as curves below the timeline, on its axis (static/values.js)."""

from collections import Counter
from html import escape
from typing import Any

import numpy as np

from mauve_rt.trace.reading.values import Field, Samples
from mauve_rt.trace.report.analysis import Analysis
from mauve_rt.trace.report.blocks import Section, attribute
from mauve_rt.trace.report.columns import Columns
from mauve_rt.trace.report.cycles import Array, Times
from mauve_rt.trace.report.detail import Detail, choose_detail
from mauve_rt.trace.report.timeline_section import names_px
from mauve_rt.trace.report.units import counted, listed, number_text, time_text

MOST_CURVES = 24
MOST_ENTRIES = 13_000
"""Of a curve, about: 3,900 pairs of smallest and largest value; the others are single samples."""
_ALL_ENTRIES = 150_000
"""Of all curves together: about 2 MB of the page."""
_DIGITS = 6
_MOSTLY = 0.5
_TAIL = 9
"""Characters at the end of a name that are always shown: the field."""
_VALUE = np.dtype(
    [("begin_ns", "<i8"), ("extent_ns", "<i8"), ("number", "<i8"), ("low", "<f8"), ("high", "<f8")]
)


def value_entries(samples: Samples) -> Array:
    """Return an entry for each sample, as `Detail.thinned` merges them; NaN for each that is not finite."""
    entries = np.zeros(len(samples.values), _VALUE)
    entries["begin_ns"], entries["number"] = samples.monotonic_ns, 1
    entries["low"] = entries["high"] = np.where(np.isfinite(samples.values), samples.values, np.nan)
    return entries


def values_data(analysis: Analysis, instants_ns: Times, columns: Columns) -> dict[str, Any]:
    """Return the curves' description (JSON); their numbers are added to the columns of the page.

    Each sample around `instants_ns` is kept; elsewhere samples of a long run are merged.
    """
    found = _within_reach(analysis)
    names = {field: analysis.trace.values.name(field) for field in found}
    chosen = _chosen(found)
    budget = min(MOST_ENTRIES, _ALL_ENTRIES // max(len(chosen), 1))
    details: dict[str, Detail] = {}
    shared: dict[str, dict[str, int]] = {}
    curves = []
    for field in chosen:
        every = value_entries(found[field])
        if field.topic not in details:
            details[field.topic] = choose_detail([every], instants_ns, budget=budget)
        entries = details[field.topic].thinned(every)
        if field.topic not in shared:
            shared[field.topic] = {
                "time": columns.add(entries["begin_ns"] - analysis.begin_ns, differences=True),
                "number": columns.add(entries["number"]),
            }
        low = columns.add_floats(entries["low"])
        high = low if details[field.topic].full else columns.add_floats(entries["high"])
        curves.append(
            {
                "name": names[field],
                **shared[field.topic],
                "low": low,
                "high": high,
                "gaps": len(every) - len(found[field].finite),
                "samples": len(every),
                "bucket": details[field.topic].bucket_ns,
                "range": _range_text(found[field]),
            }
        )
    return {
        "curves": curves,
        "left_out": [names[field] for field in found if field not in chosen],
        "problems": list(analysis.trace.values.problems),
    }


def values_section(analysis: Analysis, described: dict[str, Any]) -> Section | None:
    """Return the section that static/values.js brings to life; None where there is nothing to say.

    `described` is what values_data() returned.
    """
    if not analysis.records or not (described["curves"] or described["problems"]):
        return None
    note = _note(described)
    if not described["curves"]:
        return Section("Values", "", note=note, anchor="values")
    names = "".join(_row_name(curve) for curve in described["curves"])
    html = (
        f'<div id="values-view" class="timeline values" style="--names: {names_px(analysis)}px" tabindex="0" '
        'role="application" '
        'aria-label="values: arrow keys move, plus and minus zoom, 0 shows everything">'
        f'<div class="lanes"><div class="names"><div class="axis-room"></div>{names}</div>'
        '<div class="plot"><canvas></canvas></div></div></div>'
        '<p class="keys"><span><i class="key-swap"></i>parked to armed</span>'
        '<span><i class="key-fault"></i>fault</span></p>'
    )
    return Section("Values", html, note=note, anchor="values", wide=True)


def _within_reach(analysis: Analysis) -> dict[Field, Samples]:
    """Samples with a time that the page can show: no further from the trace than its duration."""
    first_ns, last_ns = analysis.begin_ns - analysis.duration_ns, analysis.end_ns + analysis.duration_ns
    found = {}
    for field, (times, values) in analysis.trace.values.samples.items():
        first, last = np.searchsorted(times, first_ns), np.searchsorted(times, last_ns, side="right")
        if last > first:
            found[field] = Samples(times[first:last], values[first:last])
    return found


def _chosen(found: dict[Field, Samples]) -> list[Field]:
    """The values of most interest: those of resources, then those that change, some of each topic."""
    within: Counter[str] = Counter()
    interest = {}
    for field, samples in found.items():
        finite = samples.finite
        constant = not len(finite) or bool((finite == finite[0]).all())
        interest[field] = (
            not field.of_resource,
            constant,
            samples.nan_share > _MOSTLY,
            "[" in field.name,
            within[field.topic],
        )
        within[field.topic] += 1
    chosen = set(sorted(found, key=interest.__getitem__)[:MOST_CURVES])
    return [field for field in found if field in chosen]


def _range_text(samples: Samples) -> str:
    finite = samples.finite
    if not len(finite):
        return "no finite number"
    low, high = (number_text(float(end), digits=_DIGITS) for end in (finite.min(), finite.max()))
    return low if low == high else f"{low} to {high}"


def _row_name(curve: dict[str, Any]) -> str:
    gaps = f"{curve['gaps']:,} of them NaN, infinite or missing" if curve["gaps"] else ""
    tip = "\n".join(
        [curve["name"], curve["range"], counted(curve["samples"], "value"), *([gaps] if gaps else [])]
    )
    gaps_shown = f'<em class="gaps">{counted(curve["gaps"], "gap")}</em> ' if gaps else ""
    head, tail = curve["name"][:-_TAIL], curve["name"][-_TAIL:]
    return (
        f'<div class="row-name" data-tip="{attribute(tip)}">'
        f"<b><span>{escape(head)}</span><span>{escape(tail)}</span></b>"
        f"<output>\N{EN DASH}</output><div>{gaps_shown}<span>{escape(curve['range'])}</span></div></div>"
    )


def _note(described: dict[str, Any]) -> str:
    curves, left_out = described["curves"], described["left_out"]
    note = ""
    if curves:
        note = (
            "The curves share axis, zoom and cursor with the timeline. A curve holds each value until the "
            "next one; its height is scaled to the values in view. A gap is a value that is NaN, infinite or "
            "missing."
        )
    buckets = [curve["bucket"] for curve in curves if curve["bucket"]]
    if buckets:
        note += (
            f" {counted(len(buckets), 'curve')} of {len(curves)} "
            f"{'has' if len(buckets) == 1 else 'have'} more samples than fit: around "
            "reconfigurations, decisions, overruns, faults and the worst latencies each sample is kept; "
            f"elsewhere the curve shows the smallest and the largest value within {time_text(max(buckets))}."
        )
    if left_out:
        note += (
            f" Of {len(curves) + len(left_out):,} values {len(curves)} are drawn: those of recorded "
            f"resources first, then values of topics that change. Left out: {listed(left_out)}."
        )
    return " ".join([note, *described["problems"]]).strip()
