"""What `mauve trace info`, `check` and `stats` print."""

from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from typing import Any

from rich.console import Group
from rich.markup import escape
from rich.table import Table

from mauve_rt.cli.tables import number_table
from mauve_rt.counts import counted
from mauve_rt.trace.bag.deletion import Deleted
from mauve_rt.trace.reading.reconfigurations import Reconfiguration
from mauve_rt.trace.reading.statistics import ComponentStatistics, Distribution
from mauve_rt.trace.reading.trace import Trace

_ROUNDED_UP = 0.9995
"""From this share of the next unit on, three digits are no longer enough: 1e+03 us."""
_FIGURES = ("count", "min", "p50", "p99", "p99.9", "max")


def info_values(trace: Trace) -> dict[str, Any]:
    """What a bag holds."""
    begin_ns, end_ns = trace.span_ns
    realtime_ns = int(trace.clock_pairs[0][1]) if len(trace.clock_pairs) else 0
    return {
        "files": [
            {
                "path": str(file.path),
                "library": file.library,
                "bytes": file.whole_bytes,
                "damage": file.damage,
            }
            for file in trace.files
        ],
        "recorded": datetime.fromtimestamp(realtime_ns / 1e9, UTC).isoformat(timespec="seconds"),
        "clock_steps": [step.text for step in trace.clock_steps],
        "deleted": [one._asdict() for one in trace.deleted],
        "duration_s": (end_ns - begin_ns) / 1e9,
        "records": sum(loss.received for loss in trace.losses.values()),
        "lost": trace.lost,
        "components": {
            name: {"records": loss.received, "lost": loss.lost} for name, loss in trace.losses.items()
        },
        "topics": {name: {"type": kind, "messages": count} for name, (kind, count) in trace.topics.items()},
    }


def info_view(values: Mapping[str, Any]) -> Group:
    """The same for people."""
    size = sum(file["bytes"] for file in values["files"])
    head = (
        f"{counted(values['records'], 'record')} of {counted(len(values['components']), 'component')} in "
        f"{values['duration_s']:.3f} s, {values['lost']:,} lost; recorded {values['recorded']}; "
        f"{counted(len(values['files']), 'file')}, {size / 1e6:.1f} MB"
    )
    damages = [f"{file['path']}: {file['damage']}" for file in values["files"] if file["damage"]]
    components = number_table(["component"], [], ["records", "lost"])
    for name, counts in values["components"].items():
        components.add_row(escape(name), f"{counts['records']:,}", f"{counts['lost']:,}")
    topics = number_table(["topic"], ["type"], ["messages"])
    for name, topic in values["topics"].items():
        topics.add_row(escape(name), escape(topic["type"]), f"{topic['messages']:,}")
    deleted = [Deleted(**fields).text for fields in values["deleted"]]
    notes = [*(f"[red]{escape(line)}" for line in damages), *map(escape, [*deleted, *values["clock_steps"]])]
    return Group(escape(head), *notes, components, topics)


def statistics_values(found: ComponentStatistics) -> dict[str, Any]:
    """Everything that is known of a component, with distributions as values in ns."""
    return {name: _plain(value) for name, value in vars(found).items()}


def statistics_view(statistics: Mapping[str, ComponentStatistics], swaps: list[Reconfiguration]) -> Group:
    """A table of times, one of counts, one of reconfigurations."""
    counts = number_table(
        ["component"], [], ["period", "load", "releases", "overruns", "skipped", "faults", "lost records"]
    )
    times = number_table(["component"], ["what"], _FIGURES)
    for name, one in statistics.items():
        period = time_text(one.period_ns) if one.period_ns else "sporadic"
        figures = (one.releases, one.overruns, one.skipped, one.faults, one.lost_records)
        counts.add_row(escape(name), period, f"{one.load:.1%}", *(f"{figure:,}" for figure in figures))
        for number, (what, distribution) in enumerate(_distributions(one)):
            times.add_row(escape(name) if number == 0 else "", escape(what), *_cells(distribution))
        times.add_section()
    return Group(counts, times, *([_swap_table(swaps)] if swaps else []))


def _distributions(one: ComponentStatistics) -> Iterator[tuple[str, Distribution]]:
    yield "wake-up latency", one.wakeup
    yield "response time", one.response
    if one.period_ns:
        yield "phase error", one.phase_error
    for kind, group in (("state", one.execution), ("service", one.services), ("lock of", one.contention)):
        for name, distribution in group.items():
            yield f"{kind} {name}", distribution


def _cells(distribution: Distribution) -> list[str]:
    if not distribution.count:
        return ["0", *("-" for _ in _FIGURES[1:])]
    count, *times = vars(distribution).values()
    return [f"{count:,}", *(time_text(time) for time in times)]


def _swap_table(swaps: list[Reconfiguration]) -> Table:
    table = number_table(["component"], ["what"], ["committed", "blackout", "missed", "phase", "woken"])
    table.title, table.title_justify = "reconfigurations", "left"
    for swap in swaps:
        known = (swap.phase_nominal_ns, swap.phase_actual_ns)
        table.add_row(
            escape(swap.component),
            escape(swap.what),
            "yes" if swap.committed else "refused",
            time_text(swap.blackout_ns),
            "-" if swap.missed_releases is None else str(swap.missed_releases),
            *("-" if time is None else time_text(time) for time in known),
        )
    return table


def _plain(value: Any) -> Any:
    if isinstance(value, Distribution):
        return dict(vars(value))
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    return value


def time_text(time_ns: int) -> str:
    """A time with three digits and its unit."""
    for limit, unit in ((1e3, "ns"), (1e6, "us"), (1e9, "ms")):
        if abs(time_ns) < limit * _ROUNDED_UP:
            return f"{time_ns / (limit / 1e3):.3g} {unit}"
    return f"{time_ns / 1e9:,.3f} s"
