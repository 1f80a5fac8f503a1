"""The section with the architecture and its loads, drawn by Graphviz."""

from html import escape
from types import SimpleNamespace
from typing import Any

from mauve_rt.graph.components import Measured, architecture_drawing
from mauve_rt.graph.svg import GraphError, svg_element
from mauve_rt.trace.report.analysis import Analysis
from mauve_rt.trace.report.blocks import Section
from mauve_rt.trace.report.units import share_text

_WIDEST_PX = 1090


def architecture_section(analysis: Analysis) -> Section | None:
    """Return the section with the graph; None when there is no component at all."""
    trace = analysis.trace
    if not trace.components:
        return None
    known = {info.name: info for info in trace.architecture}
    names = list(dict.fromkeys([*trace.components, *known]))
    loads = {name: found.load for name, found in analysis.statistics.items()}
    measured = {name: Measured(loads.get(name, 0.0), share_text(loads.get(name, 0.0))) for name in names}
    components = [known.get(name) or _recorded(analysis, name) for name in names]
    drawing = architecture_drawing("the architecture as a graph", components, measured=measured)
    note = "Loads are shares of the recorded time spent in execution states, preemption included. "
    if known:
        note += "An arrow points from the giver of data to its taker; hover over an arrow for the port."
    else:
        note += "The bag does not tell how the components are connected."
    try:
        html = f'<div class="scroll">{svg_element(drawing, widest_px=_WIDEST_PX)}</div>'
    except GraphError as error:
        html = f'<p class="nothing">No graph: {escape(str(error))}. Then write the report again.</p>'
    return Section("Architecture", html, note=note, anchor="architecture")


def _recorded(analysis: Analysis, name: str) -> Any:
    """A component of which the bag has the records alone."""
    period_ns = analysis.period_ns(name) or (0 if analysis.sporadic(name) else None)
    return SimpleNamespace(
        name=name, shell="", core="", fsm="", period_ns=period_ns, priority=0, cpus=None, ports=()
    )
