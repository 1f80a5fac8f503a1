"""The verdict on traces whose course is known: nothing is said that they do not prove."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from synthetic_traces import (
    EPOCH_NS,
    MS,
    PERIOD_NS,
    deploy,
    overrun,
    periodic_trace,
    run,
    swap,
    trace_of,
)

from mauve_rt.trace.format.records import DEADLINE_MISSED, Kind
from mauve_rt.trace.reading.architecture import ComponentInfo, with_known_policies
from mauve_rt.trace.reading.trace import Trace
from mauve_rt.trace.recording.synthetic import SyntheticSource
from mauve_rt.trace.report import Card, Verdict, judge
from mauve_rt.trace.report.analysis import analyse
from mauve_rt.trace.report.distributions import distributions_section
from mauve_rt.trace.report.key_figures import key_figures

FAULT = "RuntimeError: cable on fire"


def verdict_on(trace: Trace) -> Verdict:
    return judge(analyse(trace))


def said(verdict: Verdict) -> str:
    text = " ".join(sentence.text for sentence in verdict.sentences)
    return text.replace("\N{NARROW NO-BREAK SPACE}", " ")


def test_a_punctual_trace_is_good():
    found = verdict_on(periodic_trace(("a", "b"), 50))
    assert (found.level, found.sentence) == ("good", "Yes: no overrun, no fault.")
    assert "2 components" in said(found)
    assert "none was lost" in said(found)
    assert "No overrun in 100 releases" in said(found)
    assert "Nothing was reconfigured" in said(found)


def test_overruns_name_the_component_and_what_took_the_time():
    source = SyntheticSource(["good", "late"])
    for component in source.components:
        deploy(source, component)
    run(source, "good", 1000)
    overrun(source, "late", run(source, "late", 1000))
    found = verdict_on(trace_of(source))
    assert (found.level, found.sentence) == ("attention", "No: 1 overrun in 2,001 releases.")
    assert "late overran once" in said(found)
    assert "skipped 1 instant; in that cycle its state act took longest, 11 ms" in said(found)
    assert "good had no overrun" in said(found)


def test_a_deadline_that_an_analysis_marked_as_missed_is_told():
    source = SyntheticSource(["c"])
    deploy(source, "c")
    run(source, "c", 5)
    at_ns = source.now_ns + MS
    source.add("c", Kind.MARK, at_ns, name=DEADLINE_MISSED, a=2 * MS)
    found = verdict_on(trace_of(source))
    assert (found.level, found.sentence) == ("bad", "No: 1 missed deadline.")
    assert "c missed its deadline at" in said(found)
    assert "by 2 ms." in said(found)


def test_a_late_wake_up_is_not_blamed_on_a_state():
    source = SyntheticSource(["c"])
    deploy(source, "c")
    source.add("c", Kind.RELEASE, EPOCH_NS + 12 * MS, name="wait", a=EPOCH_NS, b=EPOCH_NS + 12 * MS)
    late = EPOCH_NS + 12 * MS + 5
    source.add("c", Kind.OVERRUN, late, name="wait", a=EPOCH_NS + PERIOD_NS, b=late, c=1)
    assert "the wake-up itself took longest, 12 ms" in said(verdict_on(trace_of(source)))


def late_together(source: SyntheticSource, *, hog_ns: int) -> None:
    """Three components released at one instant, all woken 5 ms later; the first had executed meanwhile."""
    source.add("hog", Kind.RELEASE, EPOCH_NS, name="wait", a=EPOCH_NS, b=EPOCH_NS)
    source.add("hog", Kind.STATE_BEGIN, EPOCH_NS, name="act")
    source.add("hog", Kind.STATE_END, EPOCH_NS + hog_ns, name="act")
    for component in ("a", "b", "c"):
        source.add(component, Kind.RELEASE, EPOCH_NS + 5 * MS, name="wait", a=EPOCH_NS, b=EPOCH_NS + 5 * MS)


def test_what_came_from_outside_is_not_laid_to_the_components():
    source = SyntheticSource(["hog", "a", "b", "c"])
    late_together(source, hog_ns=1000)
    found = said(verdict_on(trace_of(source)))
    assert (
        "The machine stalled once: several components woke late together while none of them was executing, "
        "3 of them by up to 5 ms" in found
    )


def test_a_component_that_kept_the_others_waiting_is_not_excused():
    source = SyntheticSource(["hog", "a", "b", "c"])
    late_together(source, hog_ns=4_900_000)
    assert "woke late together" not in said(verdict_on(trace_of(source)))


def test_nor_is_one_whose_state_never_ended():
    source = SyntheticSource(["hog", "a", "b", "c"])
    source.add("hog", Kind.STATE_BEGIN, EPOCH_NS - MS, name="act")
    late_together(source, hog_ns=0)
    assert "woke late together" in said(verdict_on(trace_of(source)))
    source = SyntheticSource(["hog", "stuck", "a", "b", "c"])
    source.add("stuck", Kind.STATE_BEGIN, EPOCH_NS - MS, name="act")
    late_together(source, hog_ns=0)
    assert "woke late together" not in said(verdict_on(trace_of(source)))


def overrun_at(source: SyntheticSource, component: str, due_ns: int, late_ns: int) -> None:
    source.add(component, Kind.OVERRUN, due_ns + late_ns, name="wait", a=due_ns, b=due_ns + late_ns, c=1)


def test_overruns_that_a_stall_brought_about_are_told_apart_from_those_of_a_component():
    source = SyntheticSource(["hog", "a", "b", "c", "own"])
    for component in source.components:
        deploy(source, component)
    run(source, "own", 3)
    overrun(source, "own", EPOCH_NS + 3 * PERIOD_NS)
    late_together(source, hog_ns=0)
    overrun_at(source, "a", EPOCH_NS + 4 * MS, 1_000_100)  # without the 5 ms it had ended in time
    overrun_at(source, "b", EPOCH_NS + 4 * MS, 5_000_100)  # without them it had not
    found = verdict_on(trace_of(source))
    assert found.sentence == "No: 3 overruns in 8 releases (1 of them while the machine stalled)."
    told = {one.text.split()[0]: one.text for one in found.sentences if " overran " in one.text}
    assert told["a"].endswith("; the machine stalled then.")
    assert "stalled" not in told["b"]
    assert "stalled" not in told["own"]
    assert found.sentences[3].level == "attention"
    assert found.sentences[3].text.startswith("The machine stalled once")


def test_when_all_overruns_are_the_machines_the_first_sentence_says_so():
    source = SyntheticSource(["hog", "a", "b", "c"])
    late_together(source, hog_ns=0)
    overrun_at(source, "a", EPOCH_NS + 4 * MS, 1_000_100)
    overrun_at(source, "b", EPOCH_NS + 4 * MS, 1_000_100)
    found = verdict_on(trace_of(source))
    assert found.sentence == "No: 2 overruns in 4 releases (all while the machine stalled)."
    source = SyntheticSource(["hog", "a", "b", "c"])
    late_together(source, hog_ns=4_900_000)
    overrun_at(source, "a", EPOCH_NS + 4 * MS, 1_000_100)
    assert verdict_on(trace_of(source)).sentence == "No: 1 overrun in 4 releases."


def test_the_most_serious_reason_comes_first():
    source = SyntheticSource(["rarely", "faulty"])
    for component in source.components:
        deploy(source, component)
    overrun(source, "rarely", run(source, "rarely", 300))
    run(source, "faulty", 3)
    source.add("faulty", Kind.FAULT, EPOCH_NS + 50 * MS, name="act")
    found = verdict_on(trace_of(source))
    assert found.sentence == "No: 1 fault and 1 overrun in 304 releases."
    weights = ["bad", "attention", "good", ""]
    levels = [one.level for one in found.sentences]
    assert levels == sorted(levels, key=weights.index)
    assert set(levels) == set(weights)
    assert found.sentences[0].text.startswith("faulty had a fault")


def test_overruns_as_a_habit_are_bad():
    source = SyntheticSource(["c"])
    deploy(source, "c")
    instant = EPOCH_NS
    for _ in range(10):
        instant = overrun(source, "c", run(source, "c", 5, begin_ns=instant))
    found = verdict_on(trace_of(source))
    assert (found.level, found.sentence) == ("bad", "No: 10 overruns in 60 releases.")


def test_a_swap_that_cost_nothing_is_told_with_its_figures():
    source = SyntheticSource(["c"])
    deploy(source, "c")
    pending = run(source, "c", 20)
    swap(source, "c", pending)
    run(source, "c", 20, begin_ns=pending)
    found = verdict_on(trace_of(source))
    assert found.level == "good"
    assert found.sentence == "Yes: no overrun, no fault, and 1 reconfiguration without a missed release."
    assert "1 reconfiguration of c; the blackout lasted 20 \N{MICRO SIGN}s." in said(found)
    assert "on the grid of the deployment, and came at most 10 \N{MICRO SIGN}s after it" in said(found)


def test_missed_releases_and_a_lost_phase_are_told():
    source = SyntheticSource(["c"])
    deploy(source, "c")
    pending = run(source, "c", 20)
    swap(source, "c", pending)
    run(source, "c", 20, begin_ns=pending + 2 * PERIOD_NS + 3)
    found = verdict_on(trace_of(source))
    assert found.level == "bad"
    assert found.sentence == "No: 3 releases missed in reconfigurations and a phase that was not kept."
    assert "1 reconfiguration left the component off its grid, by up to 3 ns" in said(found)


def test_a_fault_is_bad():
    source = SyntheticSource(["c"])
    deploy(source, "c")
    run(source, "c", 3)
    source.add("c", Kind.FAULT, EPOCH_NS + 50 * MS, name="act")
    found = verdict_on(trace_of(source))
    assert (found.level, found.sentence) == ("bad", "No: 1 fault.")
    assert "c had a fault in its state act, 70 ms after the begin; it was parked (FAULTED)." in said(found)


def faulted_at(time_ns: int, *components: str) -> Any:
    """A message of type ArchitectureState, as a trace gives it."""
    parts = [SimpleNamespace(name=name, fault=f"{FAULT}\n\nAt:\n  a.py(7): act") for name in components]
    state = SimpleNamespace(components=parts)
    return SimpleNamespace(topic="/robot_1/executor/state", monotonic_ns=time_ns, msg=state)


def fallback_trace(component: str) -> tuple[SyntheticSource, int]:
    """A fault, after which the core `p/Safe` goes on at the next instant; and the time of the fault."""
    source = SyntheticSource([component])
    deploy(source, component)
    pending = run(source, component, 3)
    fault_ns = pending - PERIOD_NS + MS
    source.add(component, Kind.FAULT, fault_ns, a=pending - PERIOD_NS, name="act")
    source.add(component, Kind.RECONFIGURATION, fault_ns + 2000, a=2, name="replace_core p/Safe")
    source.add(component, Kind.START, fault_ns + 3000, a=pending)
    run(source, component, 3, begin_ns=pending)
    return source, fault_ns


def test_a_fault_tells_its_reason_and_what_followed():
    source, fault_ns = fallback_trace("c")
    trace = trace_of(source)
    states = [faulted_at(fault_ns - 1), faulted_at(fault_ns + MS, "other", "c")]
    analysis = analyse(trace, states=states)
    assert (
        f"c had a fault in its state act, 41 ms after the begin: {FAULT}; fallback core Safe took over after "
        "3 µs, and was released 9.01 ms after the fault."
    ) in said(judge(analysis))
    (swap,) = analysis.swaps
    measured = swap.measured
    assert (measured.after_fault, measured.what, measured.blackout_ns) == (True, "replace_core p/Safe", 3000)
    assert (measured.missed_releases, measured.phase_nominal_ns, measured.complete) == (0, 0, True)


def test_a_fault_that_is_followed_by_a_start_alone_is_no_takeover():
    source = SyntheticSource(["c"])
    deploy(source, "c")
    pending = run(source, "c", 3)
    source.add("c", Kind.FAULT, pending, a=pending, name="act")
    source.add("c", Kind.START, pending + MS, a=pending + PERIOD_NS)
    run(source, "c", 3, begin_ns=pending + PERIOD_NS)
    found = analyse(trace_of(source))
    assert found.swaps == []
    assert [fault.takeover for fault in found.faults] == [None]


def test_lost_records_make_every_count_a_lower_bound():
    source = SyntheticSource(["c"])
    deploy(source, "c")
    pending = run(source, "c", 20)
    source.drop("c", 7)
    run(source, "c", 20, begin_ns=pending + 5 * PERIOD_NS)
    found = verdict_on(trace_of(source))
    assert found.level == "attention"
    assert found.sentence == "Not proved: nothing was late in what was recorded, but records are missing."
    assert "at least 7 more were lost" in said(found)
    assert "No overrun in 40 releases that were recorded" in said(found)
    assert "Records of c are missing: their counts here are lower bounds" in said(found)


def test_without_releases_nothing_is_proved():
    for trace in (
        Trace({}, (), {}, np.empty((0, 2), np.int64)),
        trace_of(SyntheticSource(["c"])),
    ):
        found = verdict_on(trace)
        assert found.level == "attention"
        assert found.sentence == "Not proved: the trace holds no release."


def test_of_a_sporadic_component_no_phase_is_claimed():
    source = SyntheticSource(["events"])
    deploy(source, "events", period_ns=0)
    pending = run(source, "events", 5)
    swap(source, "events", pending)
    run(source, "events", 5, begin_ns=pending)
    verdict = verdict_on(trace_of(source))
    assert verdict.sentence == "Yes: no overrun, no fault, and 1 reconfiguration."
    found = said(verdict)
    assert "events is event-triggered: phase and missed releases do not apply" in found
    assert "grid" not in found
    assert "missed a release" not in found
    assert "Of 1 reconfiguration no missed releases can be told" in found


def test_ordinary_scheduling_is_not_hidden():
    info = ComponentInfo("c", "p/S", "p/C", "p/F", PERIOD_NS, 0, "SCHED_OTHER", 0, (), ())
    found = verdict_on(replace(periodic_trace(), architecture=(info,)))
    assert found.level == "attention"
    assert "Without real-time scheduling (SCHED_OTHER): c." in said(found)


def test_a_policy_is_known_after_the_threads_have_ended():
    running = ComponentInfo("c", "p/S", "p/C", "p/F", PERIOD_NS, 0, "SCHED_OTHER", 0, (), ())
    other = replace(running, name="new", policy="")
    assert with_known_policies([replace(running, policy=""), other], [running]) == (running, other)


@pytest.mark.parametrize("extra", [0, 3, 9])
def test_there_are_at_most_eight_cards_and_none_of_trouble_is_left_out(extra: int):
    source, _ = fallback_trace("c")
    overrun(source, "c", EPOCH_NS + 40 * PERIOD_NS)
    cards = key_figures(
        analyse(trace_of(source)), [Card(f"{index}", "of the caller") for index in range(extra)]
    )
    assert len(cards) == 8
    assert {"1 fault", "1 overrun"} <= {f"{card.value} {card.meaning}" for card in cards}
    assert sum(card.meaning == "of the caller" for card in cards) == min(extra, 6)


def test_what_took_no_time_has_no_panels():
    source = SyntheticSource(["real", "simulated"])
    deploy(source, "real")
    run(source, "real", 3)
    deploy(source, "simulated")
    instant = EPOCH_NS
    for _ in range(3):
        instant = source.cycle("simulated", instant, states={"act": 0}, wait_ns=PERIOD_NS, wakeup_ns=0)
    body = distributions_section(analyse(trace_of(source))).html
    assert "<summary>real</summary>" in body
    assert "<summary>simulated</summary>" not in body
    assert "All times of simulated are 0, as in simulated time." in body
