"""Statistics of traces whose figures are known because they were written by hand."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from synthetic_traces import trace_of

from mauve_rt.trace.format.records import IN_VAIN, Kind, ReconfigurationPhase
from mauve_rt.trace.reading.reconfigurations import reconfigurations
from mauve_rt.trace.reading.statistics import Distribution, component_statistics, distribution, state_spans
from mauve_rt.trace.reading.typed_records import Armed, typed_records
from mauve_rt.trace.recording.synthetic import SyntheticSource

EPOCH_NS, OFFSET_NS, PERIOD_NS = 1_000_000, 300, 10_000
FIRST_NS = EPOCH_NS + OFFSET_NS


def source_of_one() -> SyntheticSource:
    source = SyntheticSource(["c"])
    source.add("c", Kind.DEPLOYMENT, 0, a=EPOCH_NS, b=OFFSET_NS, c=PERIOD_NS)
    source.add("c", Kind.START, EPOCH_NS - 5, a=FIRST_NS)
    return source


def test_a_periodic_component():
    source = source_of_one()
    instant = FIRST_NS
    for wakeup_ns in (10, 30, 20):
        instant = source.cycle(
            "c", instant, states={"sense": 100, "act": 200}, wait_ns=PERIOD_NS, wakeup_ns=wakeup_ns
        )
    found = component_statistics(trace_of(source), "c")
    assert (found.releases, found.overruns, found.skipped, found.faults, found.lost_records) == (
        3,
        0,
        0,
        0,
        0,
    )
    assert found.wakeup == Distribution(3, 10, 20, 30, 30, 30)
    assert found.response == Distribution(3, 310, 320, 330, 330, 330)
    assert found.phase_error == found.wakeup
    assert found.execution == {
        "sense": Distribution(3, 100, 100, 100, 100, 100),
        "act": Distribution(3, 200, 200, 200, 200, 200),
    }


def test_overruns_count_what_they_skip_and_end_the_response():
    source = source_of_one()
    source.add("c", Kind.RELEASE, FIRST_NS, name="wait", a=FIRST_NS, b=FIRST_NS)
    late_ns = FIRST_NS + 25_000
    source.add("c", Kind.OVERRUN, late_ns, name="wait", a=FIRST_NS + PERIOD_NS, b=late_ns, c=2)
    source.add("c", Kind.WAIT, late_ns + 1, name="wait", a=FIRST_NS + 3 * PERIOD_NS)
    source.cycle("c", FIRST_NS + 3 * PERIOD_NS, states={}, wait_ns=PERIOD_NS)
    found = component_statistics(trace_of(source), "c")
    assert (found.releases, found.overruns, found.skipped) == (2, 1, 2)
    assert found.response.max_ns == 25_000
    assert found.phase_error.max_ns == 0


def test_only_releases_of_the_initial_state_have_a_phase():
    source = source_of_one()  # a loop of wait 3 and wait 7: g is their sum
    instant = FIRST_NS
    for _ in range(4):
        instant = source.cycle("c", instant, states={"first": 1}, wait_ns=3000, wakeup_ns=4)
        instant = source.cycle("c", instant, states={"second": 1}, wait_ns=7000, wakeup_ns=5)
    found = component_statistics(trace_of(source), "c")
    assert found.releases == 8
    assert found.phase_error == Distribution(4, 4, 4, 4, 4, 4)


def test_nothing_is_measured_across_a_gap():
    source = source_of_one()
    source.add("c", Kind.RELEASE, FIRST_NS, name="wait", a=FIRST_NS, b=FIRST_NS)
    source.add("c", Kind.STATE_BEGIN, FIRST_NS, name="sense")
    source.drop("c", 4)  # the end, a whole cycle ...
    source.add("c", Kind.STATE_END, FIRST_NS + 90_000, name="sense")
    source.add("c", Kind.WAIT, FIRST_NS + 90_000, name="wait", a=FIRST_NS + 100_000)
    found = component_statistics(trace_of(source), "c")
    assert (found.releases, found.response.count, found.execution) == (1, 0, {})
    assert found.lost_records == 4


def test_calls_within_calls_count():
    source = source_of_one()
    for kind, time_ns, name in (
        (Kind.SERVICE_BEGIN, 10, "map.update"),
        (Kind.SERVICE_BEGIN, 20, "pose.read"),
        (Kind.SERVICE_END, 25, "pose.read"),
        (Kind.SERVICE_END, 90, "map.update"),
    ):
        source.add("c", kind, time_ns, name=name)
    services = component_statistics(trace_of(source), "c").services
    assert {name: found.max_ns for name, found in services.items()} == {"map.update": 80, "pose.read": 5}


def test_a_stop_ends_nothing():
    source = source_of_one()
    source.add("c", Kind.RELEASE, FIRST_NS, name="wait", a=FIRST_NS, b=FIRST_NS)
    source.add("c", Kind.STOP, FIRST_NS + 5, name="sense")
    source.add("c", Kind.START, FIRST_NS + 900_000, a=FIRST_NS + 1_000_000)
    source.add("c", Kind.WAIT, FIRST_NS + 900_000, name="wait", a=FIRST_NS + 1_000_000)
    assert component_statistics(trace_of(source), "c").response.count == 0


def test_an_empty_component():
    found = component_statistics(trace_of(SyntheticSource(["c"])), "c")
    assert (found.releases, found.wakeup, found.execution) == (0, Distribution(0, 0, 0, 0, 0, 0), {})
    assert reconfigurations(trace_of(SyntheticSource(["c"]))) == []


@given(st.lists(st.integers(0, 10**9), min_size=1))
def test_percentiles_are_values_that_occurred(values: list[int]):
    found = distribution(np.array(values, np.int64))
    ordered = sorted(values)
    assert (found.count, found.min_ns, found.max_ns) == (len(values), ordered[0], ordered[-1])
    for share, value in ((0.5, found.p50_ns), (0.99, found.p99_ns), (0.999, found.p999_ns)):
        assert value in values
        assert sum(one <= value for one in values) >= share * len(values) - 1e-9
        assert sum(one < value for one in values) < share * len(values) + 1e-9


@given(st.lists(st.tuples(st.sampled_from("pqr"), st.integers(0, 10**6)), max_size=30))
def test_spans_come_back_as_written(executions: list[tuple[str, int]]):
    source = source_of_one()
    now_ns, expected = FIRST_NS, []
    for state, execution_ns in executions:
        source.add("c", Kind.STATE_BEGIN, now_ns, name=state)
        source.add("c", Kind.STATE_END, now_ns + execution_ns, name=state)
        expected.append((state, now_ns, now_ns + execution_ns))
        now_ns += execution_ns
    trace = trace_of(source)
    spans = [(trace.name(name), begin, end) for name, begin, end in state_spans(trace.of("c")).tolist()]
    assert spans == expected


def swap(
    source: SyntheticSource, parked_ns: int, armed_ns: int, *, pending_ns: int, committed: bool = True
) -> None:
    source.add("c", Kind.PARKED, parked_ns, name="wait", a=pending_ns)
    for phase, took_ns in ((ReconfigurationPhase.ADOPT, 40), (ReconfigurationPhase.TAKE, 25)):
        source.add("c", Kind.RECONFIGURATION, armed_ns - 1, name="replace_core c New", a=phase, b=took_ns)
    source.add("c", Kind.ARMED, armed_ns, name="wait", a=pending_ns, b=int(committed))


@pytest.mark.parametrize("committed", [True, False])
def test_a_swap_that_misses_nothing(*, committed: bool):
    source = source_of_one()
    pending = source.cycle("c", FIRST_NS, states={"sense": 100}, wait_ns=PERIOD_NS)
    swap(source, FIRST_NS + 500, FIRST_NS + 620, pending_ns=pending, committed=committed)
    source.cycle("c", pending, states={"sense": 100}, wait_ns=PERIOD_NS, wakeup_ns=17)
    (found,) = reconfigurations(trace_of(source))
    assert (found.component, found.what, found.committed) == ("c", "replace_core c New", committed)
    assert (found.blackout_ns, found.adopt_ns, found.take_ns) == (120, 40, 25)
    assert (found.missed_releases, found.phase_nominal_ns, found.phase_actual_ns) == (0, 0, 17)
    assert found.complete


def test_a_park_in_vain_is_no_reconfiguration():
    source = source_of_one()
    pending = source.cycle("c", FIRST_NS, states={"sense": 100}, wait_ns=PERIOD_NS)
    source.add("c", Kind.PARKED, FIRST_NS + 500, name="wait", a=pending)
    late = pending + 2 * PERIOD_NS
    source.add("c", Kind.ARMED, late - 900, name="wait", a=late, b=IN_VAIN, c=2)
    swap(source, late - 500, late - 380, pending_ns=late)
    source.cycle("c", late, states={"sense": 100}, wait_ns=PERIOD_NS)
    trace = trace_of(source)
    (found,) = reconfigurations(trace)
    assert (found.parked_ns, found.missed_releases) == (late - 500, 0)
    in_vain, armed = (one for one in typed_records(trace) if isinstance(one, Armed))
    assert (in_vain.committed, in_vain.lost) == (False, 2)
    assert (armed.committed, armed.lost) == (True, 0)


@given(
    missed=st.integers(0, 50),
    late_ns=st.integers(0, PERIOD_NS // 2 - 1),
    nominal_error_ns=st.integers(-500, 500),
)
def test_missed_releases_and_phase_are_counted_on_the_grid(missed: int, late_ns: int, nominal_error_ns: int):
    source = source_of_one()
    pending = source.cycle("c", FIRST_NS, states={}, wait_ns=PERIOD_NS)
    resumed = pending + missed * PERIOD_NS
    swap(source, FIRST_NS + 500, resumed - 1000, pending_ns=pending)
    source.add("c", Kind.RELEASE, resumed, name="wait", a=resumed + nominal_error_ns, b=resumed + late_ns)
    (found,) = reconfigurations(trace_of(source))
    assert found.missed_releases == max(0, missed + (nominal_error_ns > 0))
    assert (found.phase_nominal_ns, found.phase_actual_ns) == (nominal_error_ns, late_ns)


def test_a_release_after_another_wait_than_the_last_of_a_cycle_is_in_phase_at_its_own_place():
    source = source_of_one()
    pending = FIRST_NS + PERIOD_NS // 4
    swap(source, FIRST_NS + 500, FIRST_NS + 620, pending_ns=pending)
    source.add("c", Kind.RELEASE, pending, name="wait", a=pending, b=pending + 17, c=PERIOD_NS // 4)
    (found,) = reconfigurations(trace_of(source))
    assert (found.missed_releases, found.phase_nominal_ns, found.phase_actual_ns) == (0, 0, 17)


@pytest.mark.parametrize(("factor", "missed"), [(10, 9), (1, 0)])
def test_missed_releases_are_those_of_the_grid_before_a_new_fsm(factor: int, missed: int):
    source = source_of_one()
    resumed = FIRST_NS + 10 * PERIOD_NS
    pending = resumed - missed * PERIOD_NS
    source.add("c", Kind.PARKED, FIRST_NS, name="wait", a=pending)
    source.add("c", Kind.DEPLOYMENT, FIRST_NS, a=EPOCH_NS, c=factor * PERIOD_NS)
    source.add("c", Kind.ARMED, FIRST_NS, name="wait", a=resumed, b=1)
    source.add("c", Kind.RELEASE, resumed, name="wait", a=resumed, b=resumed)
    (found,) = reconfigurations(trace_of(source))
    assert found.missed_releases == missed


def test_a_swap_without_a_release_after_it_has_no_phase():
    source = source_of_one()
    swap(source, FIRST_NS, FIRST_NS + 10, pending_ns=FIRST_NS + 100)
    (found,) = reconfigurations(trace_of(source))
    assert (found.nominal_ns, found.missed_releases, found.phase_actual_ns) == (None, None, None)


def test_a_park_at_the_end_of_the_bag_is_no_swap_yet():
    source = source_of_one()
    source.add("c", Kind.PARKED, FIRST_NS, name="wait", a=FIRST_NS + 10)
    assert reconfigurations(trace_of(source)) == []


def test_a_gap_within_a_swap_makes_it_doubtful():
    source = source_of_one()
    source.add("c", Kind.PARKED, FIRST_NS, name="wait", a=FIRST_NS + 100)
    source.drop("c", 2)
    source.add("c", Kind.ARMED, FIRST_NS + 10, name="wait", a=FIRST_NS + 100, b=1)
    (found,) = reconfigurations(trace_of(source))
    assert not found.complete


def test_a_sporadic_component_has_no_grid():
    source = SyntheticSource(["c"])
    source.add("c", Kind.DEPLOYMENT, 0, a=EPOCH_NS)
    swap(source, FIRST_NS, FIRST_NS + 10, pending_ns=FIRST_NS + 100)
    source.cycle("c", FIRST_NS + 100, states={}, wait_ns=100)
    trace = trace_of(source)
    (found,) = reconfigurations(trace)
    assert (found.blackout_ns, found.missed_releases, found.phase_nominal_ns) == (10, None, None)
    assert component_statistics(trace, "c").phase_error.count == 0
