"""The report's section about the timing proof: what was measured beside what is proved."""

from mauve_rt.analysis.bounds import jobs_by_waits
from mauve_rt.analysis.digraph_times import JobTime
from mauve_rt.analysis.study import Surroundings, study
from mauve_rt.cli.analyzed import of_trace
from mauve_rt.cli.measured_times import measured_of
from mauve_rt.trace.reading.statistics import Distribution, distribution, job_response_times
from mauve_rt.trace.report.analysis import Analysis
from mauve_rt.trace.report.blocks import Section, paragraph, table
from mauve_rt.trace.report.units import time_text

_Row = tuple[str, ...]

_COLUMNS = ("component", "job", "jobs", "median", "99 %", "longest response", "bound", "deadline", "")


def timing_section(analysis: Analysis) -> Section | None:
    """The section; None where the bag has no bound of any component."""
    found = of_trace(analysis.trace)
    if found.threads is None:
        return None
    surroundings = Surroundings(threads=found.threads)
    now = study(found.components, surroundings, measured=measured_of(analysis.statistics))
    rows = []
    machines = {one.name: one for one in found.components}
    for name, bound in now.bounds.items():
        measured = job_response_times(analysis.trace, name) if name in analysis.statistics else {}
        for (after, until), one in jobs_by_waits(machines[name], bound).items():
            if (after, until) in measured:
                rows.append(_row(name, (after, until), one, distribution(measured[after, until])))
    if not rows:
        return None
    note = (
        "The bounds are those of mauve analyze, by the times that the bag tells. A job is everything that a "
        "component executes from one wait to the next."
    )
    html = paragraph(f"{now.verdict.sentence}.") + table(_COLUMNS, rows)
    return Section("Timing proof", html, note=note, anchor="timing")


def _row(component: str, waits: tuple[str, str], job: JobTime, measured: Distribution) -> _Row:
    figures = (measured.p50_ns, measured.p99_ns, measured.max_ns, job.response_ns, job.job.deadline_ns)
    words = "above its bound" if measured.max_ns > job.response_ns else ""
    way = " -> ".join(dict.fromkeys((waits[0], *job.job.states))) + f" -> {waits[1]}"
    return (component, way, f"{measured.count:,}", *map(time_text, figures), words)
