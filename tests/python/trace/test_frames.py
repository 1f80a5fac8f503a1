"""Data frames of traces whose rows are known because they were written by hand."""

from typing import Any

import pandas as pd
from hypothesis import given
from hypothesis import strategies as st
from synthetic_traces import trace_of

from mauve_rt.trace.format.records import Kind, ReconfigurationPhase
from mauve_rt.trace.reading import frames
from mauve_rt.trace.reading.statistics import component_statistics, distribution
from mauve_rt.trace.recording.synthetic import SyntheticSource

PERIOD_NS = 10_000


def rows(frame: pd.DataFrame) -> list[tuple[Any, ...]]:
    return list(frame.astype(object).itertuples(index=False, name=None))


def two_components() -> SyntheticSource:
    source = SyntheticSource(["a", "b"])
    for component, offset_ns in (("a", 0), ("b", 300)):
        source.add(component, Kind.DEPLOYMENT, 0, a=1000, b=offset_ns, c=PERIOD_NS)
        source.add(component, Kind.START, 0, a=1000 + offset_ns)
        instant = 1000 + offset_ns
        for wakeup_ns in (7, 9):
            instant = source.cycle(
                component, instant, states={"sense": 100, "act": 50}, wait_ns=PERIOD_NS, wakeup_ns=wakeup_ns
            )
    return source


def test_releases() -> None:
    found = frames.releases(trace_of(two_components()))
    assert rows(found) == [
        ("a", "wait", 1000, 1007, 7, 157, 7),
        ("a", "wait", 11000, 11009, 9, 159, 9),
        ("b", "wait", 1300, 1307, 7, 157, 7),
        ("b", "wait", 11300, 11309, 9, 159, 9),
    ]
    kinds = {name: str(kind) for name, kind in found.dtypes.items()}
    assert kinds == {
        "component": "category",
        "wait": "category",
        "nominal_ns": "int64",
        "actual_ns": "int64",
        "wakeup_ns": "int64",
        "response_ns": "Int64",
        "phase_error_ns": "Int64",
    }


def test_states_and_records() -> None:
    trace = trace_of(two_components())
    assert rows(frames.states(trace))[:3] == [
        ("a", "sense", 1007, 1107, 100),
        ("a", "act", 1107, 1157, 50),
        ("a", "sense", 11009, 11109, 100),
    ]
    every = frames.records(trace)
    assert len(every) == sum(len(trace.of(name)) for name in trace.components)
    assert rows(every)[0] == ("a", 0, 0, "deployment", "", 1000, 0, PERIOD_NS)
    assert rows(frames.deployments(trace)) == [("a", 0, 1000, 0, PERIOD_NS), ("b", 0, 1000, 300, PERIOD_NS)]


def test_services_nest_and_do_not_span_a_gap() -> None:
    source = SyntheticSource(["a"])
    for kind, time_ns, name in (
        (Kind.SERVICE_END, 1, "lost.begin"),
        (Kind.SERVICE_BEGIN, 2, "map.update"),
        (Kind.SERVICE_BEGIN, 3, "pose.read"),
        (Kind.SERVICE_END, 5, "pose.read"),
        (Kind.SERVICE_END, 9, "map.update"),
        (Kind.SERVICE_BEGIN, 10, "map.update"),
    ):
        source.add("a", kind, time_ns, name=name)
    source.drop("a", 2)
    source.add("a", Kind.SERVICE_END, 90, name="map.update")
    source.add("a", Kind.SERVICE_BEGIN, 91, name="pose.read")
    source.add("a", Kind.SERVICE_END, 93, name="pose.read")
    assert rows(frames.services(trace_of(source))) == [
        ("a", "map.update", 2, 9, 7),
        ("a", "pose.read", 3, 5, 2),
        ("a", "pose.read", 91, 93, 2),
    ]


def test_a_state_that_a_fault_ended_has_no_end() -> None:
    source = SyntheticSource(["a"])
    source.add("a", Kind.STATE_BEGIN, 1, name="sense")
    source.add("a", Kind.FAULT, 2, name="sense")
    source.add("a", Kind.START, 5, a=6)
    source.cycle("a", 6, states={"sense": 3}, wait_ns=10)
    assert rows(frames.states(trace_of(source))) == [("a", "sense", 6, 9, 3)]


def test_what_is_not_known_is_missing() -> None:
    source = SyntheticSource(["a"])
    source.add("a", Kind.DEPLOYMENT, 0, a=1000)  # sporadic
    source.add("a", Kind.START, 0, a=1000)
    source.cycle("a", 1000, states={"sense": 1}, wait_ns=10)
    source.add("a", Kind.RELEASE, 1010, name="wait", a=1010, b=1010)
    source.drop("a")
    source.add("a", Kind.WAIT, 1030, name="wait", a=1040)
    assert rows(frames.releases(trace_of(source))[["response_ns", "phase_error_ns"]]) == [
        (1, pd.NA),
        (pd.NA, pd.NA),
    ]


def test_what_happened() -> None:
    source = two_components()
    source.add("a", Kind.OVERRUN, 90_000, name="wait", a=80_000, b=90_000, c=2)
    source.add("b", Kind.CONTENDED, 91_000, name="map", a=1234, b=500)
    source.add("b", Kind.MARK, 92_000, name="seen", a=-1, b=2, c=3)
    source.add("a", Kind.PARKED, 100_000, name="wait", a=101_000)
    source.add(
        "a", Kind.RECONFIGURATION, 100_060, name="replace_core New", a=ReconfigurationPhase.ADOPT, b=40
    )
    source.add("a", Kind.ARMED, 100_070, name="wait", a=101_000, b=1)
    trace = trace_of(source)
    assert rows(frames.overruns(trace)) == [("a", "wait", 80_000, 90_000, 10_000, 2)]
    assert rows(frames.contention(trace)) == [("b", "map", 91_000, 500, 1234)]
    assert rows(frames.marks(trace)) == [("b", "seen", 92_000, -1, 2, 3)]
    told = frames.reconfigurations(trace)[["component", "what", "blackout_ns", "adopt_ns", "missed_releases"]]
    assert rows(told) == [("a", "replace_core New", 70, 40, pd.NA)]


def test_a_trace_of_nothing_has_columns() -> None:
    for components in ([], ["a"]):
        trace = trace_of(SyntheticSource(components))
        found = [
            make(trace)
            for make in (
                frames.releases,
                frames.states,
                frames.overruns,
                frames.services,
                frames.contention,
                frames.marks,
                frames.reconfigurations,
                frames.deployments,
                frames.records,
            )
        ]
        assert all(len(frame) == 0 and len(frame.columns) >= 5 for frame in found)


@given(
    st.lists(st.tuples(st.integers(0, 400), st.integers(0, 300), st.integers(0, 3)), max_size=20),
    st.integers(0, 50),
)
def test_frames_tell_what_the_statistics_tell(cycles: list[tuple[int, int, int]], late_ns: int) -> None:
    source = SyntheticSource(["a"])
    source.add("a", Kind.DEPLOYMENT, 0, a=1000, c=1000)
    source.add("a", Kind.START, 0, a=1000)
    instant = 1000
    for sense_ns, act_ns, lost in cycles:
        instant = source.cycle(
            "a", instant, states={"sense": sense_ns, "act": act_ns}, wait_ns=1000, wakeup_ns=late_ns
        )
        source.drop("a", lost)
    trace = trace_of(source)
    told, releases, states = component_statistics(trace, "a"), frames.releases(trace), frames.states(trace)
    for column, expected in (
        ("wakeup_ns", told.wakeup),
        ("response_ns", told.response),
        ("phase_error_ns", told.phase_error),
    ):
        assert distribution(releases[column].dropna().to_numpy("int64")) == expected
    for state, expected in told.execution.items():
        assert distribution(states[states["state"] == state]["execution_ns"].to_numpy()) == expected
