"""The benchmark that holds bounds against runs: it finds what is too long, and says what stalls did."""

import sys
from pathlib import Path

from analysis_machines import MS, execution, machine, wait
from synthetic_traces import EPOCH_NS, PERIOD_NS, SyntheticSource, deploy, trace_of

from mauve_rt.analysis.study import Study, Surroundings, study
from mauve_rt.model.threads import ThreadList

sys.path.append(str(Path(__file__).parents[3] / "benchmarks"))  # at the end: it hides nothing

from proof import Job, held_against


def proved() -> Study:
    """A component of 2 ms in each period."""
    states = (execution("act", "wait", wcet_ms=2, initial=True), wait("wait", "act", ms=10))
    return study([machine(*states)], Surroundings(threads=ThreadList(0, 0, ())))


def jobs(*took_ms: float, witness_late_ms: float = 0.0) -> list[Job]:
    """Of a run with these executions; in its second period the witness wakes late."""
    source = SyntheticSource(["c", "witness_0"])
    deploy(source, "c")
    deploy(source, "witness_0")
    instant_ns = EPOCH_NS
    for number, each_ms in enumerate(took_ms):
        late_ns = round(witness_late_ms * MS) if number == 1 else 0
        source.cycle("witness_0", instant_ns, states={}, wait_ns=PERIOD_NS, wakeup_ns=late_ns)
        instant_ns = source.cycle("c", instant_ns, states={"act": round(each_ms * MS)}, wait_ns=PERIOD_NS)
    return [*held_against(trace_of(source), proved())]


def test_a_response_above_its_bound_is_found():
    found = jobs(1.0, 1.9, 2.1)

    assert [job.is_too_long for job in found] == [False, False, True]
    assert found[2].response_ns - found[2].bound_ns == MS // 10


def test_a_stall_that_a_witness_saw_explains_as_much_as_it_lasted():
    assert [job.is_too_long for job in jobs(1.0, 4.9, 1.0, witness_late_ms=3.0)] == [False, False, False]
    assert [job.is_too_long for job in jobs(1.0, 8.9, 1.0, witness_late_ms=3.0)] == [False, True, False]
