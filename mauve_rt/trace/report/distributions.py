"""The page's histograms: wake-up latency and response time per component, execution time per state."""

from html import escape

import numpy as np

from mauve_rt.trace.reading.statistics import Distribution, distribution
from mauve_rt.trace.report.analysis import Analysis
from mauve_rt.trace.report.blocks import Section
from mauve_rt.trace.report.cycles import UNKNOWN
from mauve_rt.trace.report.histograms import Values, histogram
from mauve_rt.trace.report.units import listed, time_text

_OPEN_UP_TO = 6
"""Components up to which the histograms of all are shown unfolded, else those of the first."""


def distributions_section(analysis: Analysis) -> Section:
    """Return the section with all histograms."""
    shown = [name for name in analysis.trace.components if analysis.statistics[name].releases]
    shown += [name for name in analysis.trace.components if name not in shown and analysis.slices[name]]
    figures = {name: _figures(analysis, name) for name in shown}
    drawn = [name for name in shown if figures[name]]
    blocks = "".join(
        _component(name, figures[name], opened=index == 0 or len(drawn) <= _OPEN_UP_TO)
        for index, name in enumerate(drawn)
    )
    if len(drawn) < len(shown):
        others = listed([name for name in shown if name not in drawn])
        blocks += f'<p class="nothing">All times of {escape(others)} are 0, as in simulated time.</p>'
    note = (
        "Heights are logarithms of counts, so that a single outlier is seen among thousands. Lines mark the "
        "median, the 99th and 99.9th percentile and the maximum. Hover for counts."
    )
    empty = '<p class="nothing">No component was released.</p>'
    return Section("Latencies and execution times", blocks or empty, note=note, anchor="distributions")


def _figures(analysis: Analysis, component: str) -> str:
    found = analysis.statistics[component]
    releases = analysis.releases[component]
    response = releases["response_ns"][releases["response_ns"] != UNKNOWN]
    figures = [
        _figure("wake-up latency", component, np.asarray(releases["wakeup_ns"], np.int64), found.wakeup),
        _figure("response time", component, np.asarray(response, np.int64), found.response),
    ]
    for index, (state, slices) in enumerate(analysis.slices[component].items()):
        took = np.asarray(slices["extent_ns"], np.int64)
        figures.append(_figure(f"execution of {state}", component, took, distribution(took), state=index))
    return "".join(figures)


def _component(component: str, figures: str, *, opened: bool) -> str:
    return (
        f'<details class="component"{" open" if opened else ""}><summary>{escape(component)}</summary>'
        f'<div class="grid">{figures}</div></details>'
    )


def _figure(
    what: str, component: str, values: Values, told: Distribution, *, state: int | None = None
) -> str:
    if not len(values):
        return f'<figure><figcaption>{escape(what)}</figcaption><p class="nothing">none recorded</p></figure>'
    if told.min_ns == told.max_ns == 0:
        return ""  # simulated time: nothing is measured
    drawing = histogram([("", values)], described=f"{component}: {what}", told=told)
    css = "" if state is None else f' class="s{state % 8}"'
    marks = (("p50", told.p50_ns), ("p99", told.p99_ns), ("p99.9", told.p999_ns), ("max", told.max_ns))
    figures = "".join(f"<span><i>{name}</i>{escape(time_text(value))}</span>" for name, value in marks)
    return (
        f"<figure{css}><figcaption>{escape(what)} <small>{told.count:,}</small></figcaption>"
        f'{drawing}<div class="marks">{figures}</div></figure>'
    )
