"""Times of chains in a trace: by hand; and what is left out because jobs may be missing."""

from collections.abc import Callable

import numpy as np
from synthetic_traces import EPOCH_NS, MS, deploy, trace_of

from mauve_rt.trace.format.records import Kind
from mauve_rt.trace.reading.chains import ChainTimes, chain_times, data_ages_ns, jobs_of, reactions_ns
from mauve_rt.trace.reading.trace import Trace
from mauve_rt.trace.recording.synthetic import SyntheticSource


def two(*, count: int = 6, between: Callable[[SyntheticSource], None] | None = None) -> Trace:
    """`a` every 10 ms for 2 ms, `b` every 20 ms for 5 ms, 1 ms later; `between`: after half of `a`."""
    source = SyntheticSource(["a", "b"])
    deploy(source, "a")
    deploy(source, "b")
    instant = EPOCH_NS
    for number in range(count):
        if between is not None and number == count // 2:
            between(source)
        instant = source.cycle("a", instant, states={"run": 2 * MS}, wait_ns=10 * MS)
    instant = EPOCH_NS + MS
    for _ in range(count // 2):
        instant = source.cycle("b", instant, states={"run": 5 * MS}, wait_ns=20 * MS)
    return trace_of(source)


def values(trace: Trace) -> tuple[list[int], list[int]]:
    """Reactions and data ages in ms."""
    jobs = [jobs_of(trace.of(name)) for name in ("a", "b")]
    return [int(ns) // MS for ns in reactions_ns(jobs)], [int(ns) // MS for ns in data_ages_ns(jobs)]


def test_reactions_and_ages_by_hand() -> None:
    """ms after the epoch: a runs in 0-2, 10-12, 20-22, ..., b in 1-6, 21-26, 41-46.

    A change just after 10 misses that job of a: the job at 20 takes it, then b at 41. A change just after 20
    comes there by the job at 30. At 46 b replaces its output of 26, which it made of what a read at 10.
    """
    reactions, ages = values(two())
    assert reactions == [46 - 10, 46 - 20], "a change at 0 is not counted: b has not run before"
    assert ages == [46 - 10]


def test_the_distribution_is_of_all_of_them() -> None:
    trace = two()
    found = chain_times([jobs_of(trace.of(name)) for name in trace.components])
    assert isinstance(found, ChainTimes)
    assert found.reaction.count
    assert found.reaction.max_ns == 36 * MS
    assert found.data_age.max_ns == 36 * MS


def test_one_component_is_a_chain() -> None:
    trace = two()
    jobs = [jobs_of(trace.of("a"))]
    assert {*reactions_ns(jobs)} == {12 * MS}
    assert np.array_equal(reactions_ns(jobs), data_ages_ns(jobs))


def test_what_spans_a_break_is_left_out() -> None:
    def stop(source: SyntheticSource) -> None:
        source.add("a", Kind.STOP, EPOCH_NS + 23 * MS, name="wait", a=EPOCH_NS + 30 * MS)

    def lose(source: SyntheticSource) -> None:
        source.drop("a")

    def restart(source: SyntheticSource) -> None:
        source.add("a", Kind.RELEASE, EPOCH_NS + 23 * MS, name="wait", a=EPOCH_NS + 23 * MS)
        source.add("a", Kind.START, EPOCH_NS + 24 * MS, a=EPOCH_NS + 30 * MS)

    for between in (stop, lose, restart):
        assert values(two(between=between)) == ([], []), "what begins at 10 or 20 ends behind the break"


def test_nothing_is_known_before_a_recording_begins() -> None:
    source = SyntheticSource(["a", "b"])
    for name, begin, period, count in (("a", 0, 10, 6), ("b", 15, 20, 2)):
        instant = EPOCH_NS + begin * MS
        for _ in range(count):
            instant = source.cycle(name, instant, states={"run": MS}, wait_ns=period * MS)
    reactions, _ = values(trace_of(source))
    assert reactions == [36 - 20], "changes at 0 and 10 are not counted: b may have run at 13"
