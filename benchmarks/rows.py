"""Rows of the result: what was measured, beside what, against which target, and how it went."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from ratios import Interval, Verdict, median_interval, percentile, ratio_interval, verdict


@dataclass(frozen=True, kw_only=True)
class Row:
    """One row; `measured` and `reference` are medians over the rounds."""

    what: str
    unit: str = ""
    measured: float | None = None
    measured_interval: Interval | None = None
    reference: float | None = None
    reference_what: str = ""
    ratio: float | None = None
    ratio_interval: Interval | None = None
    target: str = "-"
    verdict: Verdict = "reported"
    note: str = ""
    rounds: Sequence[Sequence[float]] = ()

    def as_json(self) -> dict[str, Any]:
        """The row for machines; intervals are [low, high]."""
        row = asdict(self)
        for name in ("measured_interval", "ratio_interval"):
            interval = getattr(self, name)
            row[name] = None if interval is None else [interval.low, interval.high]
        return row


def compared(
    what: str,
    pairs: Sequence[tuple[float, float]],
    *,
    unit: str,
    beside: str,
    ratio_limit: float | None = None,
    limit: float | None = None,
    note: str = "",
) -> Row:
    """A row of rounds, each a pair (measured, reference).

    The verdict is about the ratio when that has a limit, else about the measured value when that has one.
    """
    measured = median_interval([pair[0] for pair in pairs])
    ratio = ratio_interval(pairs)
    target: str = "-"
    outcome: Verdict = "reported"
    if ratio_limit is not None:
        target, outcome = f"ratio <= {ratio_limit:g}", verdict(ratio, ratio_limit, rounds=len(pairs))
    elif limit is not None:
        target, outcome = f"<= {limit:g} {unit}", verdict(measured, limit, rounds=len(pairs))
    return Row(
        what=what,
        unit=unit,
        measured=measured.value,
        measured_interval=measured,
        reference=median_interval([pair[1] for pair in pairs]).value,
        reference_what=beside,
        ratio=ratio.value,
        ratio_interval=ratio,
        target=target,
        verdict=outcome,
        note=note,
        rounds=pairs,
    )


def alone(
    what: str, values: Sequence[float], *, unit: str, limit: float | None = None, note: str = ""
) -> Row:
    """A row of rounds that stand beside nothing."""
    measured = median_interval(values)
    target: str = "-"
    outcome: Verdict = "reported"
    if limit is not None:
        target, outcome = f"<= {limit:g} {unit}", verdict(measured, limit, rounds=len(values))
    return Row(
        what=what,
        unit=unit,
        measured=measured.value,
        measured_interval=measured,
        target=target,
        verdict=outcome,
        note=note,
        rounds=[(value,) for value in values],
    )


def pooled(
    what: str,
    measured: Sequence[float],
    percent: float,
    *,
    unit: str,
    reference: Sequence[float] = (),
    beside: str = "",
) -> Row:
    """A row about the rare: a percentile over all rounds together, with the maximum in its note."""
    note = f"maximum {max(measured):.4g} {unit} of {len(measured)}"
    if reference:
        note += f", of the reference {max(reference):.4g} {unit} of {len(reference)}"
    return Row(
        what=what,
        unit=unit,
        measured=percentile(measured, percent),
        reference=percentile(reference, percent) if reference else None,
        reference_what=beside,
        note=note,
        rounds=[tuple(measured), tuple(reference)],
    )


def exactly_zero(what: str, values: Sequence[float], *, unit: str = "", note: str = "") -> Row:
    """A row about something that must not happen at all; the worst round counts."""
    return never_over(what, values, limit=0, unit=unit, note=note)


def never_over(what: str, values: Sequence[float], *, limit: float, unit: str = "", note: str = "") -> Row:
    """A row about a bound that no round may break; the worst one counts."""
    worst = max(values)
    bound = f"{limit:g} {unit}".strip()
    return Row(
        what=what,
        unit=unit,
        measured=worst,
        target=f"<= {bound}" if limit else bound,
        verdict="met" if worst <= limit else "missed",
        note=note,
        rounds=[(value,) for value in values],
    )


def not_available(what: str, why: str) -> Row:
    """A row that this machine does not yield."""
    return Row(what=what, verdict="not available", note=why)


def markdown(rows: Sequence[Row]) -> str:
    """The table, notes below it."""
    lines = [
        "| what | measured | reference | ratio [95 %] | target | verdict |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    notes: list[str] = []
    for row in rows:
        mark = ""
        if row.note:
            if row.note not in notes:
                notes.append(row.note)
            mark = f" ({notes.index(row.note) + 1})"
        cells = (row.what + mark, _measured(row), _reference(row), _ratio(row), row.target, row.verdict)
        lines.append("| " + " | ".join(cells) + " |")
    lines += [f"\n({number}) {note}" for number, note in enumerate(notes, start=1)]
    return "\n".join(lines)


def _measured(row: Row) -> str:
    if row.measured is None:
        return "-"
    value = f"{_number(row.measured)} {row.unit}".strip()
    interval = row.measured_interval
    return value if interval is None else f"{value} [{_number(interval.low)}, {_number(interval.high)}]"


def _reference(row: Row) -> str:
    return "-" if row.reference is None else f"{_number(row.reference)} {row.unit} ({row.reference_what})"


def _ratio(row: Row) -> str:
    interval = row.ratio_interval
    return "-" if interval is None else f"{interval.value:.2f} [{interval.low:.2f}, {interval.high:.2f}]"


def _number(value: float) -> str:
    """With three digits at least, and never as a power of ten that a reader has to multiply out."""
    digits = f"{value:.3g}"
    return f"{value:.0f}" if "e+" in digits else digits
