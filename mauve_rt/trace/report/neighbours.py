"""What the other components did around a reconfiguration: those not touched should not have noticed."""

from html import escape

import numpy as np

from mauve_rt.trace.format.records import Kind
from mauve_rt.trace.reading.reconfigurations import Reconfiguration
from mauve_rt.trace.report.analysis import Analysis
from mauve_rt.trace.report.blocks import bullets
from mauve_rt.trace.report.cycles import Array
from mauve_rt.trace.report.swap_figure import Window, window_around
from mauve_rt.trace.report.units import counted, listed, share_text, time_text, times


def neighbours_in_words(analysis: Analysis, one: Reconfiguration) -> str:
    """Return HTML: a sentence about all of them, which unfolds into one on each; empty without any."""
    window = window_around(analysis, one)
    names = [name for name in analysis.trace.components if name != one.component]
    if not names:
        return ""
    overruns = {name: _overruns(analysis, name, window) for name in names}
    releases = sum(len(_inside(analysis, name, window)) for name in names)
    who = "the other component was" if len(names) == 1 else f"the other {len(names):,} components were"
    late = [name for name, count in overruns.items() if count]
    how = f"{listed(late)} overran {times(sum(overruns.values()))}" if late else "without an overrun"
    text = f"Meanwhile {who} released {times(releases)}{';' if late else ''} {how}."
    lines = [_line(analysis, name, window, overruns[name]) for name in names]
    return f"<details><summary>{escape(text)}</summary>{bullets(lines)}</details>"


def _line(analysis: Analysis, component: str, window: Window, overruns: int) -> str:
    inside = _inside(analysis, component, window)
    text = f"{component}: {counted(len(inside), 'release')}, {counted(overruns, 'overrun')}"
    if len(inside):
        every = analysis.releases[component]["wakeup_ns"]
        worst_ns = int(inside["wakeup_ns"].max())
        share = float(np.count_nonzero(every > worst_ns)) / len(every)
        text += f"; latest wake-up {time_text(worst_ns)}, exceeded by {share_text(share)} of all its wake-ups"
    return text


def _inside(analysis: Analysis, component: str, window: Window) -> Array:
    releases = analysis.releases[component]
    first, last = np.searchsorted(releases["begin_ns"], (window.begin_ns, window.end_ns))
    return releases[first:last]


def _overruns(analysis: Analysis, component: str, window: Window) -> int:
    times_ns = analysis.trace.of(component, Kind.OVERRUN)["time_ns"]
    return int(np.count_nonzero((times_ns >= window.begin_ns) & (times_ns < window.end_ns)))
