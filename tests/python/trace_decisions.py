"""Bags of executors that ran rules: decisions as records and as messages, made by hand."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from synthetic_traces import MS, deploy, record, run

import mauve_rt.trace
from mauve_rt.trace.format.records import Kind
from mauve_rt.trace.reading.decisions import DECISION_TYPE
from mauve_rt.trace.reading.facts import Message
from mauve_rt.trace.reading.trace import Trace
from mauve_rt.trace.recording.synthetic import SyntheticSource

REALTIME_OFFSET_NS = 10**18
ARMED, TRUE, DO, DONE, NO_UNDO, COOLDOWN = 0, 3, 5, 7, 12, 3
TOPIC = "/executor/decisions"


def trace_with_rules(folder: Path, *messages: Message) -> Trace:
    """A component that ran, and a rule that did its part; the messages are those that the bag has."""
    source = SyntheticSource(["c", "(rules)"], realtime_offset_ns=REALTIME_OFFSET_NS)
    deploy(source, "c")
    run(source, "c", 20)
    decide(source, 30, ARMED)
    decide(source, 50, TRUE, cause_ms=49)
    decide(source, 51, DO, cause_ms=49)
    decide(source, 60, DONE, cause_ms=49)
    decide(source, 90, NO_UNDO, cause_ms=80, why=COOLDOWN)
    trace = mauve_rt.trace.open(record(source, folder))

    def only(topics: tuple[str, ...]) -> Iterator[Message]:
        return (message for message in messages if {DECISION_TYPE, message.topic} & set(topics))

    return replace(trace, message_source=only)


def decide(
    source: SyntheticSource,
    at_ms: int,
    code: int,
    *,
    rule: str = "lidar_lost",
    cause_ms: int = 0,
    why: int = 0,
) -> None:
    """Write the record of a decision."""
    source.add("(rules)", Kind.DECISION, at_ms * MS, name=rule, a=code, b=cause_ms * MS, c=why)


def said(
    at_ms: int,
    decision: str,
    reason: str,
    *,
    act: str = "",
    rule: str = "lidar_lost",
    topic: str = TOPIC,
    **more: Any,
) -> Message:
    """The message of a decision, sent 2 ms after it."""
    seconds, nanoseconds = divmod(at_ms * MS + REALTIME_OFFSET_NS, 10**9)
    stamp = SimpleNamespace(sec=seconds, nanosec=nanoseconds)
    told = {"took_s": -1.0, "bound_s": -1.0, "measured": 0.0, **more}
    msg = SimpleNamespace(stamp=stamp, rule=rule, decision=decision, reason=reason, act=act, **told)
    sent_ns = (at_ms + 2) * MS
    return Message(topic, sent_ns + REALTIME_OFFSET_NS, sent_ns, msg)
