"""Traces as pandas data frames: a row per thing that happened, component after component, each by time.

Times are int64 ns of CLOCK_MONOTONIC; names of components, states, waits, services, resources are
categories. A figure that is not known, such as one that lost records would be needed for, is <NA>.
"""

from collections.abc import Iterable
from dataclasses import fields
from functools import cached_property

import numpy as np
import numpy.typing as npt
import pandas as pd

from mauve_rt.trace.format.records import RECORD, Kind, Records
from mauve_rt.trace.reading.decisions import explained_decisions
from mauve_rt.trace.reading.facts import Deployment, TracedDecision
from mauve_rt.trace.reading.pairs import Indices, following, nested
from mauve_rt.trace.reading.reconfigurations import Reconfiguration
from mauve_rt.trace.reading.reconfigurations import reconfigurations as find_reconfigurations
from mauve_rt.trace.reading.shadows import Shadow, ShadowOutput
from mauve_rt.trace.reading.trace import Trace

_Int64s = npt.NDArray[np.int64]
_Known = npt.NDArray[np.bool_]
_PARTS_OF_SHADOWS = ("outputs", "steps", "curves")


def releases(trace: Trace) -> pd.DataFrame:
    """Ends of waits: component, wait, nominal_ns, actual_ns, wakeup_ns, response_ns, phase_error_ns.

    response_ns: from the nominal instant to the entry of the next wait. phase_error_ns: the actual release
    minus the nearest instant of the deployment's grid, where the initial state was released.
    """
    found = {name: trace.of(name, Kind.RELEASE) for name in trace.components}
    response = [_response_times(trace.of(name)) for name in found]
    phase = [_phase_errors(trace.of(name), trace.deployments(name)) for name in found]
    component, rows = _stacked(found)
    return pd.DataFrame(
        {
            "component": component,
            "wait": _words(trace, rows["name"]),
            "nominal_ns": rows["a"],
            "actual_ns": rows["b"],
            "wakeup_ns": rows["b"] - rows["a"],
            "response_ns": _where_known(response),
            "phase_error_ns": _where_known(phase),
        }
    )


def states(trace: Trace) -> pd.DataFrame:
    """Executions of states: component, state, begin_ns, end_ns, execution_ns (preemption included)."""
    return _spans(trace, (Kind.STATE_BEGIN, Kind.STATE_END), "state", "execution_ns")


def services(trace: Trace) -> pd.DataFrame:
    """Calls of resources' services: component, service (resource.service), begin_ns, end_ns, service_ns."""
    return _spans(trace, (Kind.SERVICE_BEGIN, Kind.SERVICE_END), "service", "service_ns")


def contention(trace: Trace) -> pd.DataFrame:
    """Waits for a lock that another thread held: component, resource, end_ns, waited_ns, holder_tid."""
    component, rows = _of_kind(trace, Kind.CONTENDED)
    return pd.DataFrame(
        {
            "component": component,
            "resource": _words(trace, rows["name"]),
            "end_ns": rows["time_ns"],
            "waited_ns": rows["b"],
            "holder_tid": rows["a"],
        }
    )


def overruns(trace: Trace) -> pd.DataFrame:
    """Waits entered too late: component, wait, missed_ns (instant), entered_ns, late_ns, skipped."""
    component, rows = _of_kind(trace, Kind.OVERRUN)
    return pd.DataFrame(
        {
            "component": component,
            "wait": _words(trace, rows["name"]),
            "missed_ns": rows["a"],
            "entered_ns": rows["b"],
            "late_ns": rows["b"] - rows["a"],
            "skipped": rows["c"],
        }
    )


def marks(trace: Trace) -> pd.DataFrame:
    """Users' marks: component, mark, time_ns, and the users' own a, b, c."""
    component, rows = _of_kind(trace, Kind.MARK)
    own = {key: rows[key] for key in ("time_ns", "a", "b", "c")}
    return pd.DataFrame({"component": component, "mark": _words(trace, rows["name"]), **own})


def decisions(trace: Trace) -> pd.DataFrame:
    """What rules decided: time_ns, rule, decision, cause_ns, why, reason, took_s, bound_s (unknown: NaN)."""
    found = explained_decisions(trace)
    columns = {name: [getattr(one.traced, name) for one in found] for name in TracedDecision._fields}
    columns |= {name: [getattr(one, name) for one in found] for name in ("reason", "took_s", "bound_s")}
    kinds = {"time_ns": "int64", "cause_ns": "int64", "took_s": "float64", "bound_s": "float64"}
    words = dict.fromkeys(("rule", "decision", "why"), "category")
    return pd.DataFrame(columns).astype(kinds | words)


def shadows(trace: Trace) -> pd.DataFrame:
    """Reports of shadows, a row per number: the fields of `Shadow` and of `ShadowOutput`.

    compared: releases in which both cores wrote the number.
    """
    found = [(one, output) for one in trace.shadow_reports for output in one.outputs]
    of_output = [field.name for field in fields(ShadowOutput)]
    of_shadow = [field.name for field in fields(Shadow) if field.name not in {*of_output, *_PARTS_OF_SHADOWS}]
    columns = {name: [getattr(one, name) for one, _ in found] for name in of_shadow}
    columns |= {name: [getattr(output, name) for _, output in found] for name in of_output}
    words = ("component", "core", "live_core", "verdict", "reason", "port", "field")
    kinds = dict.fromkeys(words, "category") | dict.fromkeys(("maximum", "rms"), "float64")
    kinds |= dict.fromkeys(("end_ns", "lag"), "Int64")
    return pd.DataFrame(columns).astype({name: kinds.get(name, "int64") for name in columns})


def output_curves(trace: Trace) -> pd.DataFrame:
    """Outputs of bumpless changes around the swap, a row per number: the series live, candidate, new_core.

    swap_ns: T; missing where the candidate did not go in.
    """
    rows = [
        (one.component, one.core, curve.output, series, time_ns, number, curve.instant_ns)
        for one in trace.shadows
        for curve in one.curves
        for series in ("live", "candidate", "new_core")
        for time_ns, number in curve.points(series)
    ]
    words = ("component", "core", "output", "series")
    kinds = dict.fromkeys(words, "category") | {"time_ns": "int64", "number": "float64", "swap_ns": "Int64"}
    return pd.DataFrame(rows, columns=list(kinds)).astype(kinds)


def deployments(trace: Trace) -> pd.DataFrame:
    """Grids epoch + offset + k * period: component, time_ns, epoch_ns, offset_ns, period_ns (0: sporadic)."""
    component, rows = _of_kind(trace, Kind.DEPLOYMENT)
    names = {"time_ns": "time_ns", "epoch_ns": "a", "offset_ns": "b", "period_ns": "c"}
    return pd.DataFrame({"component": component, **{name: rows[key] for name, key in names.items()}})


def reconfigurations(trace: Trace) -> pd.DataFrame:
    """Reconfigurations, all by time: the fields of `Reconfiguration`, and blackout_ns."""
    found = find_reconfigurations(trace)
    names = [*(field.name for field in fields(Reconfiguration)), "blackout_ns"]
    kinds = dict.fromkeys(("component", "what"), "category") | dict.fromkeys(
        ("committed", "complete"), "bool"
    )
    maybe = ("nominal_ns", "actual_ns", "missed_releases", "phase_nominal_ns", "phase_actual_ns")
    kinds |= dict.fromkeys(maybe, "Int64")
    columns = {name: [getattr(one, name) for one in found] for name in names}
    return pd.DataFrame(columns).astype({name: kinds.get(name, "int64") for name in names})


def of_kind(trace: Trace, kind: int) -> pd.DataFrame:
    """Records of any kind: component, time_ns, and its fields as the bag's table names them."""
    component, rows = _of_kind(trace, kind)
    fields = trace.kinds[kind].fields
    told = {
        name: _words(trace, rows["name"]) if field == "name" else rows[field]
        for field, name in fields.items()
    }
    return pd.DataFrame({"component": component, "time_ns": rows["time_ns"], **told})


def records(trace: Trace) -> pd.DataFrame:
    """Every record: component, sequence, time_ns, kind, name, a, b, c; see mauve_msgs/msg/TraceRecord.msg."""
    component, rows = _stacked(trace.records)
    kinds, which = np.unique(rows["kind"], return_inverse=True)
    known = {number: kind.name for number, kind in trace.kinds.items()}
    return pd.DataFrame(
        {
            "component": component,
            "sequence": rows["sequence"],
            "time_ns": rows["time_ns"],
            "kind": _categories([known.get(int(kind), f"kind {kind}") for kind in kinds], which),
            "name": _words(trace, rows["name"]),
            **{key: rows[key] for key in ("a", "b", "c")},
        }
    )


def _spans(trace: Trace, kinds: tuple[Kind, Kind], what: str, duration: str) -> pd.DataFrame:
    pairs = {name: nested(trace.of(name), *kinds) for name in trace.components}
    component, begins = _stacked({name: trace.of(name)[begin] for name, (begin, _) in pairs.items()})
    _, ends = _stacked({name: trace.of(name)[end] for name, (_, end) in pairs.items()})
    return pd.DataFrame(
        {
            "component": component,
            what: _words(trace, begins["name"]),
            "begin_ns": begins["time_ns"],
            "end_ns": ends["time_ns"],
            duration: ends["time_ns"] - begins["time_ns"],
        }
    )


def _of_kind(trace: Trace, kind: int) -> tuple[pd.Categorical, Records]:
    return _stacked({name: trace.of(name, kind) for name in trace.components})


def _stacked(of_components: dict[str, Records]) -> tuple[pd.Categorical, Records]:
    """All rows below each other, and the component of each."""
    lengths = [len(rows) for rows in of_components.values()]
    component = _categories(of_components, np.repeat(np.arange(len(lengths)), lengths))
    return component, np.concatenate([*of_components.values(), np.empty(0, RECORD)])


def _words(trace: Trace, numbers: npt.NDArray[np.uint32]) -> pd.Categorical:
    used, which = np.unique(numbers, return_inverse=True)
    return _categories([trace.name(int(number)) for number in used], which)


def _categories(words: Iterable[str], which: npt.NDArray[np.intp]) -> pd.Categorical:
    """`which` indexes the words; equal ones (of a bag that is not ours) are one category."""
    words = list(words)
    once = {word: index for index, word in enumerate(dict.fromkeys(words))}
    codes = np.array([once[word] for word in words], np.intp)[which] if words else which
    return pd.Categorical.from_codes(codes, categories=pd.Index(list(once), dtype="str"))


def _where_known(parts: list[tuple[_Int64s, _Known]]) -> pd.arrays.IntegerArray:
    values = np.concatenate([*(values for values, _ in parts), np.empty(0, np.int64)])
    known = np.concatenate([*(known for _, known in parts), np.empty(0, np.bool_)])
    return pd.arrays.IntegerArray(values, ~known)


def _response_times(rows: Records) -> tuple[_Int64s, _Known]:
    release, wait = following(rows, Kind.RELEASE, (Kind.WAIT, Kind.OVERRUN), (Kind.RELEASE, Kind.STOP))
    return _of_releases(rows, release, rows["time_ns"][wait] - rows["a"][release])


def _phase_errors(rows: Records, deployments: list[Deployment]) -> tuple[_Int64s, _Known]:
    """Only releases of the initial state, the one begun first after a start, are on the grid."""
    _, first = following(rows, Kind.START, (Kind.STATE_BEGIN,), (Kind.STOP,))
    release, begun = following(rows, Kind.RELEASE, (Kind.STATE_BEGIN,), (Kind.RELEASE, Kind.STOP))
    if len(first):
        release = release[np.isin(rows["name"][begun], rows["name"][first])]
    if not deployments:
        return _of_releases(rows, release[:0], np.empty(0, np.int64))
    grids = np.array(deployments, np.int64)
    in_force = np.maximum(np.searchsorted(grids[:, 0], rows["b"][release], side="right") - 1, 0)
    on_grid = grids[in_force, 3] > 0  # a sporadic component has none
    release, in_force = release[on_grid], in_force[on_grid]
    _, epoch_ns, offset_ns, period_ns = grids[in_force].T
    half_ns = period_ns // 2
    phases_ns = (rows["b"][release] - epoch_ns - offset_ns + half_ns) % period_ns - half_ns
    return _of_releases(rows, release, phases_ns)


def _of_releases(rows: Records, which: Indices, values: _Int64s) -> tuple[_Int64s, _Known]:
    """Spread values of some records over all releases."""
    all_values, known = np.zeros(len(rows), np.int64), np.zeros(len(rows), np.bool_)
    all_values[which], known[which] = values, True
    releases = rows["kind"] == Kind.RELEASE
    return all_values[releases], known[releases]


class Frames:
    """The data frames of one trace, each made when it is first looked at."""

    def __init__(self, trace: Trace) -> None:
        """Take the trace."""
        self._trace = trace

    @cached_property
    def releases(self) -> pd.DataFrame:
        """As frames.releases."""
        return releases(self._trace)

    @cached_property
    def states(self) -> pd.DataFrame:
        """As frames.states."""
        return states(self._trace)

    @cached_property
    def services(self) -> pd.DataFrame:
        """As frames.services."""
        return services(self._trace)

    @cached_property
    def contention(self) -> pd.DataFrame:
        """As frames.contention."""
        return contention(self._trace)

    @cached_property
    def overruns(self) -> pd.DataFrame:
        """As frames.overruns."""
        return overruns(self._trace)

    @cached_property
    def marks(self) -> pd.DataFrame:
        """As frames.marks."""
        return marks(self._trace)

    @cached_property
    def decisions(self) -> pd.DataFrame:
        """As frames.decisions."""
        return decisions(self._trace)

    @cached_property
    def shadows(self) -> pd.DataFrame:
        """As frames.shadows."""
        return shadows(self._trace)

    @cached_property
    def output_curves(self) -> pd.DataFrame:
        """As frames.output_curves."""
        return output_curves(self._trace)

    @cached_property
    def deployments(self) -> pd.DataFrame:
        """As frames.deployments."""
        return deployments(self._trace)

    @cached_property
    def reconfigurations(self) -> pd.DataFrame:
        """As frames.reconfigurations."""
        return reconfigurations(self._trace)

    @cached_property
    def records(self) -> pd.DataFrame:
        """As frames.records."""
        return records(self._trace)
