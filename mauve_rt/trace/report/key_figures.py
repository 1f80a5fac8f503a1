"""The figures of a trace to remember, as cards."""

from collections.abc import Iterator, Sequence

from mauve_rt.trace.report.analysis import Analysis
from mauve_rt.trace.report.blocks import Card
from mauve_rt.trace.report.units import counted, time_text

MOST = 8


def key_figures(analysis: Analysis, extra: Sequence[Card] = ()) -> list[Card]:
    """Return at most `MOST` cards for below the verdict, the first ones; all that tell of trouble."""
    cards = [*extra, *_cards(analysis)]
    calm = [card for card in cards if card.level not in ("attention", "bad")]
    left_out = calm[max(MOST - (len(cards) - len(calm)), 0) :]
    return [card for card in cards if not any(card is other for other in left_out)]


def _cards(analysis: Analysis) -> Iterator[Card]:
    """The most important ones first."""
    found = list(analysis.statistics.values())
    releases = sum(one.releases for one in found)
    overruns = sum(one.overruns for one in found)
    released = [one for one in found if one.wakeup.count]
    measured = [swap.measured for swap in analysis.swaps]
    if analysis.faults:
        yield _counted(len(analysis.faults), "fault", "bad")
    yield _counted(overruns, "overrun", "attention" if overruns else "good" if releases else "")
    missed = [one.missed_releases for one in measured if one.missed_releases is not None]
    if missed:
        what = f"missed by {counted(len(measured), 'reconfiguration')}"
        yield _counted(sum(missed), "release", "attention" if sum(missed) else "good", what)
    if longest_ns := max((one.blackout_ns for one in measured), default=0):
        yield Card(time_text(longest_ns), "longest blackout")
    if worst_ns := max((one.wakeup.max_ns for one in released), default=0):
        p99_ns = max(one.wakeup.p99_ns for one in released)
        yield Card(time_text(worst_ns), f"worst wake-up latency, p99 {time_text(p99_ns)}")
    yield _counted(releases, "release", "", f"of {counted(len(found), 'component')}")
    yield Card(time_text(analysis.duration_ns), "recorded")
    lost = analysis.trace.lost
    yield _counted(lost, "record", "attention" if lost else "", "lost")


def _counted(count: int, what: str, level: str = "", more: str = "") -> Card:
    return Card(f"{count:,}", " ".join(filter(None, [what if count == 1 else f"{what}s", more])), level)
