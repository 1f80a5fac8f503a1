"""Whether a bag can be trusted: finished, whole, and nothing missing that was recorded."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mauve_rt.trace.bag.repair import BagState, examine_bag
from mauve_rt.trace.format.records import Kind
from mauve_rt.trace.progress import Progress, part, silent
from mauve_rt.trace.reading.facts import Loss
from mauve_rt.trace.reading.reader import open_trace
from mauve_rt.trace.reading.trace import Trace
from mauve_rt.trace.recording.recorder import DROPPED_MESSAGES


@dataclass(frozen=True)
class Finding:
    """Something that is to be known before a bag is trusted."""

    text: str
    is_damage: bool = False
    """The bag is no finished one: other readers may refuse it. A repair helps."""
    is_loss: bool = False
    """Something that was to be recorded is missing."""


def check_bag(path: Path, *, progress: Progress = silent) -> list[Finding]:
    """Return what is wrong with a bag; nothing where it is whole.

    Raises:
        TraceError: it is no bag with a trace, or cannot be read.

    """
    state = examine_bag(path, progress=part(progress, 0.0, 0.5))
    found = [Finding(text, is_damage=True) for text in state.damages()]
    if state.unreadable:
        return found
    trace = open_trace(path, progress=part(progress, 0.5, 1.0))
    found += [Finding(_words(name, loss), is_loss=True) for name, loss in trace.losses.items() if loss.lost]
    if dropped := _dropped_messages(state):
        found.append(
            Finding(f"{dropped:,} messages of topics were dropped on their way into the bag", is_loss=True)
        )
    found += [
        Finding(f"{file.path.name}: its chunks are not in order of time; readers that need it sort them")
        for file in state.files
        if not file.is_in_order
    ]
    return found + _notes(trace)


def _words(component: str, loss: Loss) -> str:
    share = loss.lost / max(loss.written, 1)
    return (
        f"component '{component}': {loss.lost:,} of {loss.written:,} records ({share:.2%}) are missing: "
        f"{loss.dropped:,} found no room in its ring (trace_records in the architecture file), and the "
        f"sequence numbers have gaps of {loss.gaps:,}"
    )


def _dropped_messages(state: BagState) -> int:
    text = state.custom_data.get(DROPPED_MESSAGES, "0")
    return int(text) if text.isdigit() else 0


def _notes(trace: Trace) -> list[Finding]:
    notes = []
    for name, rows in trace.records.items():
        unknown = np.setdiff1d(rows["kind"], [int(kind) for kind in Kind])
        if len(unknown):
            kinds = ", ".join(map(str, unknown))
            notes.append(
                Finding(f"component '{name}': records of kinds that this version does not know: {kinds}")
            )
        if len(rows) and int(rows["name"].max()) >= len(trace.names):
            notes.append(Finding(f"component '{name}': words of its last records are not in the bag"))
    if not trace.architecture:
        notes.append(Finding("the bag does not tell the architecture (recorded by an earlier version)"))
    return notes
