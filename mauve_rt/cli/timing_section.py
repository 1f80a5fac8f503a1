"""The report's section about the timing proof: what was measured beside what is proved."""

from mauve_rt.analysis.study import Surroundings, study
from mauve_rt.cli.analyzed import of_trace
from mauve_rt.cli.measured_times import measured_of
from mauve_rt.trace.report.analysis import Analysis
from mauve_rt.trace.report.blocks import Section, paragraph, table
from mauve_rt.trace.report.units import time_text

_COLUMNS = ("component", "longest response", "bound", "deadline", "")


def timing_section(analysis: Analysis) -> Section | None:
    """The section; None where the bag has no bound of any component."""
    found = of_trace(analysis.trace)
    if found.threads is None:
        return None
    surroundings = Surroundings(threads=found.threads)
    now = study(found.components, surroundings, measured=measured_of(analysis.statistics))
    rows = []
    for name, bound in now.bounds.items():
        measured = analysis.statistics.get(name)
        if bound.response_ns is not None and measured is not None and measured.response.count:
            longest_ns = measured.response.max_ns
            words = "above its bound" if longest_ns > bound.response_ns else ""
            rows.append((name, *map(time_text, (longest_ns, bound.response_ns, bound.deadline_ns)), words))
    if not rows:
        return None
    note = "The bounds are those of mauve analyze, by the times that the bag tells."
    html = paragraph(f"{now.verdict.sentence}.") + table(_COLUMNS, rows)
    return Section("Timing proof", html, note=note, anchor="timing")
