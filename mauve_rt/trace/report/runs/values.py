"""Values of messages in two runs: each numeric field of each topic that both bags have."""

from dataclasses import dataclass

import numpy as np

from mauve_rt.trace.reading.trace import Trace
from mauve_rt.trace.reading.value_tables import Floats
from mauve_rt.trace.reading.values import Field, Samples, read_samples, value_topics
from mauve_rt.trace.report.runs.noise import block_count, moment_changes
from mauve_rt.trace.report.runs.timing import TOO_SHORT, Figure

MOST_FIELDS = 200


@dataclass(frozen=True)
class ComparedField:
    """A field in both runs."""

    field: Field
    a: Samples
    b: Samples
    mean: Figure
    rms: Figure
    largest_difference: float | None = None
    """Of samples at equal instants of simulated time; None in real time."""

    @property
    def differs(self) -> bool:
        """Return whether B differs by more than the noise; in simulated time, whether any sample differs."""
        return self.mean.differs or self.rms.differs or bool(self.largest_difference)


@dataclass(frozen=True)
class Values:
    """The fields that both runs have, and what was left out."""

    fields: list[ComparedField]
    only_a: list[str]
    """Topics."""
    only_b: list[str]
    left_out: list[str]
    """Sentences."""


def compared_values(a: Trace, b: Trace, *, simulated: bool) -> Values:
    """Read and compare the values of both runs; `simulated`: both are of simulated time."""
    topics = [value_topics(trace) for trace in (a, b)]
    shared = [topic for topic in topics[0] if topic in topics[1]]
    left_out: list[str] = []
    runs = [read_samples(trace, shared, left_out) for trace in (a, b)]
    fields = [field for field in runs[0] if field in runs[1]]
    if len(fields) > MOST_FIELDS:
        topics_out = {field.topic for field in fields[MOST_FIELDS:]}
        text = f"{len(fields) - MOST_FIELDS:,} more fields are left out (of {', '.join(sorted(topics_out))})."
        left_out.append(text)
    return Values(
        [_compare(field, runs[0][field], runs[1][field], simulated) for field in fields[:MOST_FIELDS]],
        [topic for topic in topics[0] if topic not in topics[1]],
        [topic for topic in topics[1] if topic not in topics[0]],
        list(dict.fromkeys(left_out)),
    )


def _compare(field: Field, a: Samples, b: Samples, simulated: bool) -> ComparedField:  # noqa: FBT001
    blocks = tuple(block_count(len(one.finite), int(np.ptp(one.monotonic_ns))) for one in (a, b))
    changes = moment_changes(a.finite, b.finite, (blocks[0], blocks[1])) if all(blocks) else (None, None)
    remark = "" if all(blocks) else TOO_SHORT
    means, rms = (
        [float(of(one.finite)) if len(one.finite) else np.nan for one in (a, b)] for of in (np.mean, _rms)
    )
    subject = f"{field.topic} {field.name}"
    return ComparedField(
        field,
        a,
        b,
        Figure(subject, "value", "mean", means[0], means[1], change=changes[0], remark=remark),
        Figure(subject, "value", "rms", rms[0], rms[1], change=changes[1], remark=remark),
        _largest_difference(a, b) if simulated else None,
    )


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _largest_difference(a: Samples, b: Samples) -> float | None:
    _, at_a, at_b = np.intersect1d(a.monotonic_ns, b.monotonic_ns, return_indices=True)
    with np.errstate(invalid="ignore"):  # infinity minus infinity
        apart = np.abs(a.values[at_a] - b.values[at_b])
    apart = apart[np.isfinite(apart)]
    return float(apart.max()) if len(apart) else None
