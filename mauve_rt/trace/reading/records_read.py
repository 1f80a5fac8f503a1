"""The records of a trace, put together from its batches, and what is missing of them."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from mauve_rt.trace.format.cdr import Batch
from mauve_rt.trace.format.records import RECORD, Records
from mauve_rt.trace.reading.facts import Loss

NO_RECORDS = np.empty(0, RECORD)


class RecordsRead:
    """Collects batches. A batch is copied once, and not kept."""

    def __init__(self) -> None:
        """Have no records yet."""
        self._parts: dict[int, bytearray] = {}
        self._pairs: list[tuple[int, int]] = []
        self._first = self._last = Batch(0, 0, (), (), b"")
        self._begins_with_trace = True

    def add(self, batch: Batch) -> None:
        """Take the records of a batch."""
        if not self._pairs or batch.monotonic_ns < self._first.monotonic_ns:
            self._first = batch._replace(records=b"")
            self._begins_with_trace = len(batch.records) > 0
        if not self._pairs or batch.monotonic_ns > self._last.monotonic_ns:
            self._last = batch._replace(records=b"")
        self._pairs.append((batch.monotonic_ns, batch.realtime_ns))
        data = memoryview(batch.records)
        numbers = np.frombuffer(data, RECORD)["component"]
        cuts = [0, *(np.flatnonzero(numbers[1:] != numbers[:-1]) + 1).tolist(), len(numbers)]
        for begin, end in pairwise(cuts):
            if end > begin:
                rows = data[begin * RECORD.itemsize : end * RECORD.itemsize]
                self._parts.setdefault(int(numbers[begin]), bytearray()).extend(rows)

    def clock_pairs(self) -> npt.NDArray[np.int64]:
        """Return CLOCK_MONOTONIC and CLOCK_REALTIME at each drain, by the latter."""
        pairs = np.array(self._pairs, np.int64).reshape(-1, 2)
        return pairs[np.argsort(pairs[:, 1], kind="stable")]

    def per_component(self, components: Sequence[str]) -> tuple[dict[str, Records], dict[str, Loss]]:
        """Return the records of each component by its name, and what is missing of them; once."""
        told = dict(enumerate(components))
        present = sorted({*told, *self._parts})  # one damaged number is no reason for 65,535 components
        records: dict[str, Records] = {}
        losses: dict[str, Loss] = {}
        for number in present:
            name = told.get(number, f"component {number}")
            rows = _in_order(np.frombuffer(self._parts.pop(number, bytearray()), RECORD))
            loss = self._loss(rows, number)
            if name in records:  # removed and added again: the same component's next life
                rows = np.concatenate([records[name], rows])
                loss = losses[name].plus(loss)
            records[name], losses[name] = rows, loss
        return records, losses

    def _loss(self, rows: Records, number: int) -> Loss:
        # A file that does not begin with the trace begins with a batch without records: what was before it.
        base_written, base_dropped = (
            (0, 0)
            if self._begins_with_trace
            else (_of(self._first.written, number), _of(self._first.dropped, number))
        )
        gaps = int(rows["sequence"][-1]) + 1 - base_written - len(rows) if len(rows) else 0
        return Loss(
            written=max(_of(self._last.written, number) - base_written, len(rows)),
            received=len(rows),
            dropped=_of(self._last.dropped, number) - base_dropped,
            gaps=max(gaps, 0),
        )


def _in_order(rows: Records) -> Records:
    """Return the records by sequence number."""
    sequence = rows["sequence"]
    if np.all(sequence[1:] > sequence[:-1]):
        return rows
    return rows[np.argsort(sequence, kind="stable")]


def _of(counts: Sequence[int], number: int) -> int:
    return counts[number] if number < len(counts) else 0
