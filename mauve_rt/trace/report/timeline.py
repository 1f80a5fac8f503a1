"""The timeline's data: one row per component, as columns for the page's script (static/timeline*.js)."""

import json
from collections.abc import Iterator
from typing import Any

import numpy as np

from mauve_rt.trace.report.analysis import Analysis
from mauve_rt.trace.report.columns import Columns
from mauve_rt.trace.report.cycles import Array, Times
from mauve_rt.trace.report.decisions import decision_flags, decision_places
from mauve_rt.trace.report.detail import BUDGET, Detail, choose_detail
from mauve_rt.trace.report.markers import LOG, VIOLATION, WARNING, Markers, Text, markers_of, numbered
from mauve_rt.trace.report.values import values_data

_WORST = 20
"""Worst wake-ups and responses of each component that the page keeps in full, and can jump to."""
_JUMPS = 500
_SHOWN_SWAPS = 5_000


def timeline_data(analysis: Analysis, *, budget: int = BUDGET) -> tuple[dict[str, Any], str]:
    """Return the timeline's description (JSON) and its columns (base64)."""
    components = analysis.trace.components
    log, texts = numbered(analysis.log, len(analysis.trace.names))
    markers = {component: _markers(analysis, component, log) for component in components}
    tracks = [track for name in components for track in analysis.slices[name].values()]
    tracks += [analysis.releases[name] for name in components]
    instants_ns = interesting_instants(analysis, markers)
    detail = choose_detail(tracks, instants_ns, budget=budget)
    columns = Columns()
    rows = [_row(analysis, name, markers[name], detail, columns) for name in components]
    described = {
        "begin": analysis.begin_ns - analysis.zero_ns,
        "duration": analysis.duration_ns,
        "names": [*analysis.trace.names, *texts],
        "rows": rows,
        "swaps": _swaps(analysis)[:_SHOWN_SWAPS],
        "decisions": decision_flags(analysis),
        "jumps": _jumps(analysis, markers),
        "kept": [] if detail.full else (detail.kept_ns - analysis.begin_ns).tolist(),
        "bucket": detail.bucket_ns,
        "values": values_data(analysis, instants_ns, columns),
        "columns": columns.described,
    }
    return described, columns.data()


def _markers(analysis: Analysis, component: str, log: list[Text]) -> list[Markers]:
    above = (one for one in analysis.violations if one.component == component)
    written = [one for one in log if one.line.component == component]
    return markers_of(analysis.trace.of(component), above, written)


def interesting_instants(analysis: Analysis, markers: dict[str, list[Markers]]) -> Times:
    """Instants to look around: reconfigurations, decisions, what went wrong, begin and end."""
    found: list[Any] = [[analysis.begin_ns, analysis.end_ns]]
    found.append([one.traced.time_ns for one in analysis.decisions[:_JUMPS]])
    found.append([one.time_ns for one in analysis.misses[:_JUMPS]])
    found += [[swap.measured.parked_ns, swap.measured.armed_ns] for swap in analysis.swaps[:_SHOWN_SWAPS]]
    for component, kinds in markers.items():
        for kind, entries in kinds:
            if kind in ("overrun", VIOLATION):
                found.append(_worst(entries, "value", _JUMPS)["time_ns"])
            elif kind not in ("mark", LOG):
                found.append(entries["time_ns"][:_JUMPS])
        releases = analysis.releases[component]
        for measure in ("wakeup_ns", "response_ns"):
            found.append(_worst(releases, measure, _WORST)["begin_ns"])
    return np.concatenate([np.asarray(one, np.int64) for one in found])


def json_for_script(value: Any) -> str:
    """Return JSON that may stand in a script element, whatever texts are in it."""
    text = json.dumps(value, separators=(",", ":"), ensure_ascii=True, allow_nan=False)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _worst(entries: Array, measure: str, count: int) -> Array:
    if len(entries) <= count:
        return entries
    at = np.argpartition(entries[measure], -count)[-count:]
    return entries[np.sort(at)]


def _row(
    analysis: Analysis, component: str, markers: list[Markers], detail: Detail, columns: Columns
) -> dict[str, Any]:
    found = analysis.statistics[component]
    origin_ns = analysis.begin_ns
    grids = analysis.trace.deployments(component)
    releases = detail.thinned(analysis.releases[component])
    return {
        "name": component,
        "period": analysis.period_ns(component),
        "sporadic": analysis.sporadic(component),
        "grids": [
            [one.time_ns - origin_ns, one.epoch_ns + one.offset_ns - origin_ns, one.period_ns]
            for one in grids
        ],
        "lost": found.lost_records,
        "states": [
            {"name": state, **_slice_columns(detail.thinned(slices), origin_ns, columns)}
            for state, slices in analysis.slices[component].items()
        ],
        "releases": {
            "begin": columns.add(releases["begin_ns"] - origin_ns, differences=True),
            "extent": columns.add(releases["extent_ns"]),
            "number": columns.add(releases["number"]),
            "wakeup": columns.add(releases["wakeup_ns"]),
            "response": columns.add(releases["response_ns"]),
        },
        "markers": [
            {
                "kind": one.kind,
                "time": columns.add(one.entries["time_ns"] - origin_ns, differences=True),
                "number": columns.add(one.entries["number"]),
                "name": columns.add(one.entries["name"]),
                "value": columns.add(one.entries["value"]),
                "skipped": columns.add(one.entries["skipped"]),
            }
            for one in markers
        ],
    }


def _slice_columns(slices: Array, origin_ns: int, columns: Columns) -> dict[str, int]:
    return {
        "begin": columns.add(slices["begin_ns"] - origin_ns, differences=True),
        "extent": columns.add(slices["extent_ns"]),
        "idle": columns.add(slices["extent_ns"] - slices["busy_ns"]),
        "number": columns.add(slices["number"]),
    }


def _swaps(analysis: Analysis) -> list[dict[str, Any]]:
    rows = {name: index for index, name in enumerate(analysis.trace.components)}
    return [
        {
            "row": rows[one.component],
            "what": swap_title(one.what, request.to_core if request else ""),
            "cause": request.cause if request else "",
            "by": request.requested_by if request else "",
            "committed": one.committed,
            "parked": one.parked_ns - analysis.begin_ns,
            "armed": one.armed_ns - analysis.begin_ns,
            "adopt": one.adopt_ns,
            "take": one.take_ns,
            "changed": changed_ns - analysis.begin_ns,
            "missed": one.missed_releases,
        }
        for one, request, changed_ns in analysis.swaps
    ]


def swap_title(what: str, to_core: str = "") -> str:
    """Return what was changed, short: `replace_core Local` of `replace_core mauve_examples/Local`."""
    if to_core:
        return to_core.rsplit("/", 1)[-1]
    changes = (change.partition(" ") for change in what.split(", "))
    return (
        ", ".join(f"{verb} {name.rsplit('/', 1)[-1]}".strip() for verb, _, name in changes) or "reconfigured"
    )


def _jumps(analysis: Analysis, markers: dict[str, list[Markers]]) -> dict[str, list[list[int]]]:
    """Places to go to, [row, time, length], by kind and in the order of time."""
    found: dict[str, list[list[int]]] = {
        kind: [] for kind in ("swap", "overrun", "fault", VIOLATION, WARNING, "wakeup", "response")
    }
    found["decision"] = decision_places(analysis)
    found["swap"] = [
        [one["row"], one["parked"], one["armed"] - one["parked"]] for one in _swaps(analysis)[:_JUMPS]
    ]
    for row, component in enumerate(analysis.trace.components):
        for kind, entries in markers[component]:
            if kind in found:
                worst = _worst(entries, "value", _JUMPS)
                late = worst["value"] if kind != WARNING else np.zeros_like(worst["value"])
                found[kind] += _places(row, worst["time_ns"] - late - analysis.begin_ns, late)
    for kind in ("wakeup", "response"):
        found[kind] = _worst_releases(analysis, f"{kind}_ns")
    rows = {name: index for index, name in enumerate(analysis.trace.components)}
    found["miss"] = [
        [rows[one.component], one.time_ns - analysis.begin_ns, one.late_ns]
        for one in analysis.misses[:_JUMPS]
    ]
    for kind in ("swap", "overrun", "fault", VIOLATION, WARNING):
        found[kind].sort(key=lambda place: place[1])
    return found


def _worst_releases(analysis: Analysis, measure: str) -> list[list[int]]:
    """The worst releases of the trace, worst first: each component's worst is among them."""
    places: list[list[int]] = []
    for row, component in enumerate(analysis.trace.components):
        worst = _worst(analysis.releases[component], measure, 3)
        places += _places(row, worst["begin_ns"] - analysis.begin_ns, worst[measure])
    return sorted((place for place in places if place[2] > 0), key=lambda place: -place[2])[:_JUMPS]


def _places(row: int, begin_ns: Times, length_ns: Times) -> Iterator[list[int]]:
    pairs = zip(begin_ns.tolist(), length_ns.tolist(), strict=True)
    return ([row, int(begin), int(length)] for begin, length in pairs)
