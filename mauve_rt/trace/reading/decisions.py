"""What an executor's rules decided: by the records, and in words by the messages recorded beside them."""

from bisect import bisect_left
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from mauve_rt.trace.format.kinds import RecordKind
from mauve_rt.trace.format.records import Kind, Records
from mauve_rt.trace.reading.facts import Message, TracedDecision

if TYPE_CHECKING:
    from mauve_rt.trace.reading.trace import Trace

DECISION_TYPE = "mauve_msgs/msg/SupervisorDecision"
RULES = "(rules)"
"""Under this name a trace has the decisions; no component can be called so."""
_BATCH_TYPE = "mauve_msgs/msg/TraceBatch"
_NOT_KNOWN = -1.0
_SAME_NS = 1_000_000_000  # a message and a record that are farther apart are of different decisions

# What a record calls a decision, and what its message does: decision and act.
TOLD_AS: Mapping[str, tuple[str, str]] = {
    "armed": ("armed", ""),
    "not armed": ("suppressed", ""),
    "adopted": ("adopted", ""),
    "condition true": ("condition_true", ""),
    "condition false": ("condition_false", ""),
    "condition unknown": ("condition_unknown", ""),
    "do": ("do", ""),
    "undo": ("undo", ""),
    "done": ("done", "do"),
    "undone": ("done", "undo"),
    "do failed": ("failed", "do"),
    "undo failed": ("failed", "undo"),
    "no do": ("suppressed", "do"),
    "no undo": ("suppressed", "undo"),
    "otherwise": ("otherwise", ""),
    "otherwise done": ("done", "otherwise"),
    "otherwise failed": ("failed", "otherwise"),
}


class ExplainedDecision(NamedTuple):
    """A decision with what its message adds."""

    traced: TracedDecision
    reason: str
    """In words; empty when the bag has no message of it."""
    took_s: float | None
    """From the cause to the first release after what was done; None where that is not known."""
    bound_s: float | None
    """How long that takes at most; None where that is not known."""
    message: Message | None = None


class _Said(NamedTuple):
    time_ns: int
    message: Message


def traced_decisions(
    rows: Records, names: Sequence[str], kinds: Mapping[int, RecordKind]
) -> tuple[TracedDecision, ...]:
    """Return the decisions among the records of `(rules)`, by time, in the words of the bag's own table."""
    table = kinds.get(Kind.DECISION)
    words = table.words if table is not None else {}
    decided, reasons = words.get("a", {}), words.get("c", {})
    found = []
    for row in rows[rows["kind"] == Kind.DECISION]:
        name, decision, why = int(row["name"]), int(row["a"]), int(row["c"])
        found.append(
            TracedDecision(
                time_ns=int(row["time_ns"]),
                rule=names[name] if name < len(names) else f"name {name}",
                decision=decided.get(decision, f"decision {decision}"),
                cause_ns=int(row["b"]),
                why=reasons.get(why, f"why {why}") if why else "",
            )
        )
    return tuple(sorted(found, key=lambda one: one.time_ns))


def explained_decisions(trace: "Trace") -> list[ExplainedDecision]:
    """Return the decisions of a trace, each with the message of the same rule and kind that is nearest.

    Raises:
        TraceError: the bag's messages cannot be read.

    """
    if not trace.decisions:
        return []
    return joined(trace, trace.messages(DECISION_TYPE))


def executors(trace: "Trace") -> tuple[str, ...]:
    """Return the full names of the executors' nodes, by the topics of their traces."""
    batches = [topic for topic, (type_name, _) in trace.topics.items() if type_name == _BATCH_TYPE]
    return tuple(topic.removesuffix("/trace/batches") for topic in sorted(batches))


def joined(trace: "Trace", messages: Iterable[Message]) -> list[ExplainedDecision]:
    """Return the decisions of a trace, each with its message; see `explained_decisions`.

    A supervisor may have a rule of the same name: where executors tell of theirs, only these count.
    """
    own = {f"{node}/decisions" for node in executors(trace)} & set(trace.topics)
    said: dict[tuple[str, str, str], list[_Said]] = defaultdict(list)
    for one in messages:
        if own and one.topic not in own:
            continue
        entry = _Said(stamp_ns(one, trace.clock_pairs), one)
        kind = str(one.msg.decision)
        for act in {"", str(getattr(one.msg, "act", ""))}:
            said[str(one.msg.rule), kind, act].append(entry)
    for entries in said.values():
        entries.sort(key=lambda entry: entry.time_ns)
    return [_explained(one, said) for one in trace.decisions]


def stamp_ns(message: Message, clock_pairs: npt.NDArray[np.int64]) -> int:
    """Return when a decision was made, ns of CLOCK_MONOTONIC: its stamp, by the clock pairs.

    A stamp that is not of CLOCK_REALTIME (ROS time may be simulated) is of no use: when it was sent, then.
    """
    stamp = message.msg.stamp
    realtime_ns = int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)
    if not len(clock_pairs):
        return int(message.monotonic_ns)
    at = min(int(np.searchsorted(clock_pairs[:, 1], realtime_ns)), len(clock_pairs) - 1)
    found = realtime_ns - int(clock_pairs[at, 1] - clock_pairs[at, 0])
    return found if abs(found - message.monotonic_ns) <= _SAME_NS else int(message.monotonic_ns)


def _explained(one: TracedDecision, said: Mapping[tuple[str, str, str], list[_Said]]) -> ExplainedDecision:
    owner, _, rule = one.rule.rpartition("/")
    kind, act = TOLD_AS.get(one.decision, (one.decision, ""))
    entries = said.get((rule, kind, act), [])
    if owner:
        own = [entry for entry in entries if f"/{owner}/" in entry.message.topic]
        entries = own or entries
    at = bisect_left(entries, one.time_ns, key=lambda entry: entry.time_ns)
    near = sorted(entries[max(at - 1, 0) : at + 1], key=lambda entry: abs(entry.time_ns - one.time_ns))
    if not near or abs(near[0].time_ns - one.time_ns) > _SAME_NS:
        return ExplainedDecision(one, "", None, None)
    message = near[0].message
    took_s, bound_s = (float(getattr(message.msg, key, _NOT_KNOWN)) for key in ("took_s", "bound_s"))
    return ExplainedDecision(
        one,
        str(message.msg.reason),
        took_s if took_s >= 0 else None,
        bound_s if bound_s >= 0 else None,
        message,
    )
