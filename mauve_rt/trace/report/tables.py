"""The page's tables: components, states, resources, reconfigurations, lost records; and the words."""

from html import escape

from mauve_rt.trace.reading.architecture import ComponentInfo
from mauve_rt.trace.reading.reconfigurations import Reconfiguration
from mauve_rt.trace.reading.statistics import Distribution
from mauve_rt.trace.recording.ledger import Entry
from mauve_rt.trace.report.analysis import Analysis, Swap
from mauve_rt.trace.report.blocks import Cell, Section, details, table
from mauve_rt.trace.report.units import share_text, time_text

_PERCENTILES = ("count", "min", "p50", "p99", "p99.9", "max")
_COUNTS = ("component", "scheduled", "period", "load", "releases", "overruns", "skipped")
_MANY_ROWS = 400

WORDS = {
    "Release": "the end of a wait. Nominal: the instant of the component's clock; actual: the first "
    "instruction after it.",
    "Wake-up latency": "actual release minus nominal release.",
    "Response time": "entry of the next wait minus nominal release.",
    "Execution time": "of a state, from its begin to its end, preemption included.",
    "Load": "share of the time that passed in execution states, preemption included.",
    "Overrun": "a cycle that ended after the instant at which the next one was due. Skipped: the instants "
    "given up.",
    "Period (g)": "the greatest common divisor of the lengths of the component's cycles.",
    "Grid": "the instants epoch + offset + k g, as the deployment recorded them.",
    "Phase error": "actual release minus the nearest instant of the grid, not by the component's clock.",
    "Blackout": "from the parked to the armed record of a component that is reconfigured, both written by "
    "its own thread.",
    "Missed releases": "(first nominal instant after the commit minus the instant pending at the park) / g.",
    "Adopt, take": "the new core adopts the state of the old one, which may fail; then it takes its bulk.",
    "Sporadic": "triggered by events, not by time: it has no period, no phase and no missed releases.",
    "Stall": "a moment at which three components or more woke late by a millisecond or more, while none of "
    "them executed: the machine, its host or another program held the processors.",
    "Lost": "records that a full ring dropped, or that are missing by their sequence numbers.",
}


def components_section(analysis: Analysis) -> Section:
    """Return the tables per component and per state."""
    faults = ("faults",) if analysis.faults else ()
    components = table(
        (*_COUNTS, *faults, *_spread("wake-up"), *_spread("response")),
        [_component_row(analysis, name) for name in analysis.trace.components],
    )
    states = [
        (name, state, *_distribution(found))
        for name in analysis.trace.components
        for state, found in analysis.statistics[name].execution.items()
    ]
    latencies = [
        (name, what, *_distribution(found))
        for name, one in analysis.statistics.items()
        for what, found in (("wake-up", one.wakeup), ("response", one.response), ("phase", one.phase_error))
        if found.count
    ]
    html = components
    html += _titled("Execution time by state", table(("component", "state", *_PERCENTILES), states), states)
    html += details("Latencies in full", table(("component", "measure", *_PERCENTILES), latencies))
    return Section("Components", html, anchor="components")


def resources_section(analysis: Analysis) -> Section | None:
    """Return the tables of services and contention; None when no call was recorded."""
    services = [
        (name, service, *_distribution(found))
        for name, one in analysis.statistics.items()
        for service, found in one.services.items()
    ]
    contention = [
        (name, resource, *_distribution(found))
        for name, one in analysis.statistics.items()
        for resource, found in one.contention.items()
    ]
    if not services and not contention:
        return None
    html = table(("component", "service", *_PERCENTILES), services[:_MANY_ROWS]) if services else ""
    html += "<h3>Waiting for a lock that another thread held</h3>"
    if contention:
        html += table(("component", "resource", *_PERCENTILES), contention[:_MANY_ROWS])
    else:
        html += "<p>No lock was contended.</p>"
    return Section(
        "Resources", html, note="Calls of services, from their begin to their end.", anchor="resources"
    )


def reconfigurations_table(analysis: Analysis) -> str:
    """Return the table of all reconfigurations."""
    columns = ("at", "component", "change", "asked by", "why", "prepared in", "blackout", "adopt, take")
    rows = [_swap_row(analysis, swap) for swap in analysis.swaps[:_MANY_ROWS]]
    html = table((*columns, "missed", "phase", "woken after"), rows)
    more = len(analysis.swaps) - _MANY_ROWS
    return html + (f"<p>{more:,} more are not listed.</p>" if more > 0 else "")


def losses_section(analysis: Analysis) -> Section:
    """Return what is in the trace and what is missing."""
    rows = [
        (name, loss.written, loss.received, Cell(f"{loss.lost:,}", "attention" if loss.lost else ""))
        for name, loss in analysis.trace.losses.items()
    ]
    html = "".join(f"<p>{escape(_sentence(one.text))}</p>" for one in analysis.trace.deleted)
    html += table(("component", "records written", "in the bag", "lost"), rows)
    if others := [
        _topic_row(*item) for item in analysis.trace.ledger.items() if item[1].numbered is not None
    ]:
        html += table(("topic of other nodes", "received", "lost before the recorder", "lost by it"), others)
    files = [
        (file.path.name, file.library, f"{file.whole_bytes:,}", file.damage or "whole")
        for file in analysis.trace.files
    ]
    if files:
        html += details("Files", table(("file", "written by", "bytes read", "state"), files))
    return Section("What is in the trace", html, anchor="losses")


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}."


def _topic_row(topic: str, entry: Entry) -> tuple[object, ...]:
    before = f"{entry.lost_before:,}{'' if entry.numbered else ' reported, more not known'}"
    return (
        topic,
        entry.received,
        Cell(before, "attention" if entry.lost_before else ""),
        Cell(f"{entry.lost:,}", "attention" if entry.lost else ""),
    )


def words_section() -> str:
    """Return the definitions of the words, folded."""
    items = "".join(f"<dt>{escape(word)}</dt><dd>{escape(meaning)}</dd>" for word, meaning in WORDS.items())
    return (
        f'<section id="words" class="words">{details("What the words mean", f"<dl>{items}</dl>")}</section>'
    )


def _titled(title: str, html: str, rows: list[object] | list[tuple[object, ...]]) -> str:
    return f"<h3>{escape(title)}</h3>{html}" if rows else ""


def _spread(what: str) -> tuple[str, ...]:
    return tuple(f"{what} {name}" for name in ("p50", "p99", "max"))


def _component_row(analysis: Analysis, component: str) -> tuple[object, ...]:
    found = analysis.statistics[component]
    period = (
        time_text(found.period_ns)
        if found.period_ns
        else "sporadic"
        if analysis.sporadic(component)
        else None
    )
    info = next((one for one in analysis.trace.architecture if one.name == component), None)
    scheduled = None if info is None else scheduling_in_words(info)
    return (
        component,
        scheduled,
        Cell(period or "\N{EN DASH}"),
        Cell(share_text(found.load)),
        found.releases,
        Cell(f"{found.overruns:,}", "attention" if found.overruns else ""),
        Cell(f"{found.skipped:,}", "attention" if found.skipped else ""),
        *([Cell(f"{found.faults:,}", "bad" if found.faults else "")] if analysis.faults else []),
        *_short(found.wakeup),
        *_short(found.response),
    )


def scheduling_in_words(info: ComponentInfo) -> str:
    """Return how a component's thread was scheduled: FIFO 40, CPU 1."""
    policy = info.policy.removeprefix("SCHED_") or "priority"  # no thread to read it back from
    cpus = f", CPU {' '.join(map(str, info.cpus))}" if info.cpus else ""
    return f"{policy} {info.priority}{cpus}"


def _short(found: Distribution) -> tuple[Cell, ...]:
    return (_time(found.p50_ns, found), _percentile(found.p99_ns, found, 100), _time(found.max_ns, found))


def _distribution(found: Distribution) -> tuple[object, ...]:
    return (
        found.count,
        _time(found.min_ns, found),
        _time(found.p50_ns, found),
        _percentile(found.p99_ns, found, 100),
        _percentile(found.p999_ns, found, 1000),
        _time(found.max_ns, found),
    )


def _percentile(value: int, found: Distribution, least: int) -> Cell:
    """A percentile, in grey where fewer values than `least` make it the maximum."""
    if 0 < found.count < least:
        return Cell(
            time_text(value),
            "faint",
            f"{value:,} ns\nthe maximum: it takes {least:,} values to tell them apart",
        )
    return _time(value, found)


def _time(value: int, found: Distribution) -> Cell:
    return Cell(
        time_text(value) if found.count else "\N{EN DASH}", tip=f"{value:,} ns" if found.count else ""
    )


def _swap_row(analysis: Analysis, swap: Swap) -> tuple[object, ...]:
    one, request, _ = swap
    change = one.what if request is None else request.steps or one.what
    if request is not None and request.to_core:
        change = " \N{RIGHTWARDS ARROW} ".join(
            core.rsplit("/", 1)[-1] for core in (request.from_core, request.to_core)
        )
    missed = one.missed_releases
    phase = one.phase_nominal_ns
    known = one.nominal_ns is not None and one.actual_ns is not None
    late_ns = (one.actual_ns or 0) - (one.nominal_ns or 0) if known else None
    return (
        Cell(time_text(one.parked_ns - analysis.zero_ns)),
        one.component,
        change + ("" if one.committed else " (refused)"),
        None if request is None else request.requested_by or "not given",
        None if request is None else request.cause or "not given",
        Cell(time_text(None if request is None else request.prepare_ns)),
        Cell(time_text(one.blackout_ns), "" if one.complete else "attention", f"{one.blackout_ns:,} ns"),
        Cell(time_text(one.adopt_ns + one.take_ns), tip=_adopt_and_take(one)),
        Cell("\N{EN DASH}" if missed is None else f"{missed:,}", "attention" if missed else ""),
        Cell(time_text(phase), "bad" if phase else ""),
        Cell(time_text(late_ns)),
    )


def _adopt_and_take(one: Reconfiguration) -> str:
    return f"adopt {time_text(one.adopt_ns)}\ntake {time_text(one.take_ns)}"
