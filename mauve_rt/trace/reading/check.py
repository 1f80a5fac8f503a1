"""Whether a bag can be trusted: finished, whole, nothing missing that was recorded, no change split."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mauve_rt.counts import counted
from mauve_rt.trace.bag.deletion import deleted_of
from mauve_rt.trace.bag.disk import METADATA
from mauve_rt.trace.bag.files import is_sqlite
from mauve_rt.trace.bag.repair import BagState, examine_bag
from mauve_rt.trace.format.records import Kind
from mauve_rt.trace.progress import Progress, part, silent
from mauve_rt.trace.reading.facts import Loss
from mauve_rt.trace.reading.reader import open_trace
from mauve_rt.trace.reading.split_changes import SplitChange, has_takes_without_instant, split_changes
from mauve_rt.trace.reading.trace import Trace
from mauve_rt.trace.recording.ledger import (
    DROPPED_MESSAGES,
    INTERRUPTIONS,
    Entry,
    Interruption,
    ledger_of,
    snapshot_of,
)


@dataclass(frozen=True)
class Finding:
    """Something that is to be known before a bag is trusted."""

    text: str
    is_damage: bool = False
    """The bag is no finished one: other readers may refuse it. A repair helps."""
    is_loss: bool = False
    """Something that was to be recorded is missing."""
    is_wrong: bool = False
    """The records show that the kernel broke a rule of its own."""

    @property
    def kind(self) -> str:
        """`damage`, `loss`, `wrong`, or `note` where the bag can be trusted all the same."""
        kinds = {"damage": self.is_damage, "loss": self.is_loss, "wrong": self.is_wrong}
        return next((kind for kind, is_so in kinds.items() if is_so), "note")


def check_bag(path: Path, *, progress: Progress = silent) -> list[Finding]:
    """Return what is wrong with a bag; nothing where it is whole.

    Raises:
        TraceError: it is no bag with a trace, or cannot be read.

    """
    examining = part(progress, 0.0, 0.5)
    state = BagState(path, (), "", {}, {}) if is_sqlite(path) else examine_bag(path, progress=examining)
    found = [Finding(text, is_damage=True) for text in state.damages()]
    if state.unreadable:
        return found
    trace = open_trace(path, progress=part(progress, 0.5, 1.0))
    found += [Finding(_words(name, loss), is_loss=True) for name, loss in trace.losses.items() if loss.lost]
    found += [Finding(_interruption_words(one), is_loss=True) for one in _interruptions(state)]
    ledger = ledger_of(state.custom_data)
    found += [Finding(text, is_loss=True) for text in _missing(state, ledger)]
    found += [Finding(text, is_loss=True) for text in _lost_before(ledger)]
    if dropped := _dropped_messages(state) - sum(entry.lost for entry in ledger.values()):
        found.append(
            Finding(f"{dropped:,} messages of topics were dropped on their way into the bag", is_loss=True)
        )
    found += [
        Finding(f"{file.path.name}: its chunks are not in order of time; readers that need it sort them")
        for file in state.files
        if not file.is_in_order
    ]
    found += [
        Finding(_split_words(name, split), is_wrong=True)
        for name, rows in trace.records.items()
        for split in split_changes(rows)
    ]
    if (snapshot := snapshot_of(state.custom_data)) is not None:
        torn = "" if snapshot.is_complete else "; the bag has its begin only: the executor or its disk failed"
        found.append(Finding(f"{snapshot.text}{torn}", is_loss=bool(torn)))
    found += [Finding(text) for text in (*_deleted(state), *_others(state))]
    return found + _notes(trace) + [Finding(text) for text in _not_known(ledger)]


def _words(component: str, loss: Loss) -> str:
    share = loss.lost / max(loss.written, 1)
    return (
        f"component '{component}': {loss.lost:,} of {loss.written:,} records ({share:.2%}) are missing: "
        f"{loss.dropped:,} found no room in its ring (trace_records in the architecture file), and the "
        f"sequence numbers have gaps of {loss.gaps:,}"
    )


def _split_words(component: str, split: SplitChange) -> str:
    distance_ns = abs(split.release_ns - split.instant_ns)
    if split.is_new:
        what, where = "a release before T ran with new parts", f"{distance_ns:,} ns before T"
        expected = "releases with new parts at or after T only"
    else:
        what, where = "a release at or after T ran with old parts", f"{distance_ns:,} ns after T"
        expected = "releases with old parts before T only"
    where = where if distance_ns else "at T"
    return (
        f"component '{component}': the change at T = {split.instant_ns} ns was split: {what}; "
        f"found the release at {split.release_ns} ns, {where}, expected {expected}"
    )


def _dropped_messages(state: BagState) -> int:
    text = state.custom_data.get(DROPPED_MESSAGES, "0")
    return int(text) if text.isdigit() else 0


def _interruptions(state: BagState) -> list[Interruption]:
    try:
        return [Interruption(**fields) for fields in json.loads(state.custom_data.get(INTERRUPTIONS, "[]"))]
    except (ValueError, TypeError):  # somebody else wrote it
        return []


def _interruption_words(one: Interruption) -> str:
    paused = f"the recording paused for {(one.until_ns - one.from_ns) / 1e9:.1f} s"
    what = paused if one.until_ns else "the recording ended by itself"
    return f"{what} ({one.reason}): {counted(one.records, 'record')} lost"


def _deleted(state: BagState) -> Iterator[str]:
    deleted = deleted_of(state.custom_data)
    if deleted is not None:
        yield deleted.text
    for path in state.removed:
        yield (
            f"{path.name}: no longer part of the bag: max_size_bytes removed it, and the recorder ended "
            f"before it deleted the file. Delete it: mauve trace repair {state.path}"
        )


def _others(state: BagState) -> Iterator[str]:
    for path in state.others:
        yield f"{path.name}: no file of this bag: {METADATA} does not name it. It is not read"


def _missing(state: BagState, ledger: Mapping[str, Entry]) -> Iterator[str]:
    recorded = {topic.name: topic.messages for topic in state.topics()}
    for topic, entry in ledger.items():
        absent = entry.recorded - recorded.get(topic, 0)
        if entry.lost or absent > 0:
            lost = entry.lost + max(absent, 0)
            yield f"topic {topic}: {lost:,} of {entry.received:,} messages that came are not in the bag"


def _lost_before(ledger: Mapping[str, Entry]) -> Iterator[str]:
    for topic, entry in ledger.items():
        if entry.lost_before:
            by = "gaps in the numbers of their writers" if entry.numbered else "report of the middleware"
            lost = counted(entry.lost_before, "message")
            yield (
                f"topic {topic}: {lost} lost before the recorder received them, by {by}; "
                f"{entry.received:,} came. Record {topic} with :reliable if its publisher is reliable"
            )


def _not_known(ledger: Mapping[str, Entry]) -> Iterator[str]:
    """Of the topics of other nodes nothing tells what was sent."""
    others = {topic: entry for topic, entry in ledger.items() if entry.numbered is not None}
    whole = [topic for topic, entry in others.items() if entry.numbered and not entry.lost_before]
    if whole:
        yield (
            f"{', '.join(whole)}: no gap between the first and the last message of each writer; "
            "whether messages were sent before and after these is not known"
        )
    if unnumbered := [topic for topic, entry in others.items() if not entry.numbered]:
        yield (
            f"{', '.join(unnumbered)}: the middleware numbers no messages: "
            "whether more of them were lost before the recorder received them is not known"
        )


def _notes(trace: Trace) -> list[Finding]:
    notes = [Finding(step.text) for step in trace.clock_steps]
    for name, rows in trace.records.items():
        unknown = np.setdiff1d(rows["kind"], [int(kind) for kind in Kind])
        if len(unknown):
            kinds = ", ".join(map(str, unknown))
            notes.append(
                Finding(f"component '{name}': records of kinds that this version does not know: {kinds}")
            )
        if len(rows) and int(rows["name"].max()) >= len(trace.names):
            notes.append(Finding(f"component '{name}': words of its last records are not in the bag"))
    if any(has_takes_without_instant(rows) for rows in trace.records.values()):
        notes.append(
            Finding(
                "the bag does not tell T of its changes (recorded by an earlier version): "
                "whether one was split cannot be checked"
            )
        )
    if not trace.architecture:
        notes.append(Finding("the bag does not tell the architecture (recorded by an earlier version)"))
    return notes
