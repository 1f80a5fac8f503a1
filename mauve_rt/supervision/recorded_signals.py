"""What a bag tells conditions: messages that were recorded, and what befell components. Knows no ROS.

As the executor's own feeds tell it (rules/feeds): of a release the component's period in s, of overruns how
many there were so far, of a state its number, of a change and a message only that it was.
"""

from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

from mauve_rt._kernel import SignalSpec
from mauve_rt.fields import number_at
from mauve_rt.model.step_kinds import STEP_KINDS
from mauve_rt.supervision.rules import Rule
from mauve_rt.supervision.view_signals import COMPONENT_STATES
from mauve_rt.supervision.when import When
from mauve_rt.supervision.when_spec import OF_TOPICS, heard
from mauve_rt.trace.format.records import Kind, Records
from mauve_rt.trace.reading.decisions import executors
from mauve_rt.trace.reading.facts import Message
from mauve_rt.trace.reading.trace import Trace

RUNNING = float(COMPONENT_STATES["RUNNING"])
_STATES: Mapping[int, float] = {
    Kind.START: RUNNING,
    Kind.STOP: float(COMPONENT_STATES["STOPPED"]),
    Kind.FAULT: float(COMPONENT_STATES["FAULTED"]),
}
_COMMITTED = 1
_DIAGNOSTICS = "/diagnostics"
_NEVER: Mapping[str, str] = {
    "late": "how late wake-ups and responses of {} were",
    "write": "writes of resource {}",
    "over_declared": "which executions of {} lasted longer than declared",
    "peer": "what was known of executor {}",
    "node": "whether Python worked{}",
    "goal": "states of the goals of resource {}: no record has them",
}


class Told(NamedTuple):
    """Something that a signal is told. ns of CLOCK_MONOTONIC."""

    time_ns: int
    signal: int
    value: float


class RecordedSignals:
    """What one bag can tell."""

    def __init__(self, trace: Trace) -> None:
        """Of one executor."""
        self._trace = trace
        self._node = next(iter(executors(trace)), "")
        self._begin_ns, self._end_ns = trace.span_ns
        self._of_components: Mapping[str, Callable[[str], Iterable[tuple[int, float]]]] = {
            "release": self._releases,
            "overruns": self._overruns,
            "state": self.states,
            "change": self._changes,
        }

    def missing(self, rule: Rule) -> list[str]:
        """What a rule hears, or is about, that is not in the bag."""
        found = [self._unobservable(leaf, signal) for leaf in rule.when.leaves() for signal in heard(leaf)]
        found += [f"component {name}" for name in sorted(rule.targets()) if name not in self._trace.records]
        return [one for one in dict.fromkeys(found) if one]

    def told(self, signals: Sequence[SignalSpec]) -> list[Told]:
        """Return what the bag tells signals, by time; of what was so before its begin, at its begin.

        Raises:
            TraceError: the bag's messages cannot be read.

        """
        found = list(self._of_messages(signals))
        for index, signal in enumerate(signals):
            made = self._of_components.get(signal.kind)
            if made is not None:
                found += [Told(time_ns, index, value) for time_ns, value in made(signal.target)]
        return sorted(found)

    def states(self, component: str) -> list[tuple[int, float]]:
        """When a component came into which state (ComponentState); the first is that of the bag's begin."""
        rows = self._trace.of(component, *_STATES)
        turns = [(int(row["time_ns"]), _STATES[int(row["kind"])]) for row in rows]
        released = self._trace.of(component, Kind.RELEASE)["b"]
        runs = len(released) and (not turns or int(released[0]) < turns[0][0])
        return [(self._begin_ns, RUNNING if runs else 0.0), *sorted(turns)]

    def presence(self, rule: Rule) -> list[tuple[int, bool]]:
        """When all components that a rule needs to run began to, or ceased to."""
        names = {step.target for step in rule.do if STEP_KINDS[step.kind].needs_running}
        running = dict.fromkeys(names, False)
        turns = sorted((at, name, state == RUNNING) for name in names for at, state in self.states(name))
        found: list[tuple[int, bool]] = [] if names else [(self._begin_ns, True)]
        for at, name, runs in turns:
            running[name] = runs
            present = all(running.values())
            if present != (found[-1][1] if found else False):
                found.append((at, present))
        return found

    def _unobservable(self, leaf: When, signal: SignalSpec) -> str:
        if signal.kind in _NEVER:
            return _NEVER[signal.kind].format(signal.target)
        topic = self._topic(signal)
        if signal.kind == "field" and not leaf.parameters.get("topic"):
            return f"field {signal.detail} of resource {signal.target}"
        if topic:
            return "" if topic in self._trace.topics else f"topic {topic}"
        if signal.target and signal.target not in self._trace.records:
            return f"component {signal.target}"
        if signal.kind == "release" and not self._period_ns(signal.target, self._end_ns):
            return f"a period of component {signal.target}"
        return ""

    def _topic(self, signal: SignalSpec) -> str:
        """The full name of the topic that a signal is about; empty when it is about none."""
        if signal.kind == "diagnostic":
            return _DIAGNOSTICS
        if signal.kind not in OF_TOPICS:
            return ""
        if signal.target.startswith("~/"):
            return f"{self._node}/{signal.target[2:]}"
        namespace = self._node.rpartition("/")[0]
        return signal.target if signal.target.startswith("/") else f"{namespace}/{signal.target}"

    # ---- of messages

    def _of_messages(self, signals: Sequence[SignalSpec]) -> Iterator[Told]:
        listening: dict[str, list[tuple[int, SignalSpec]]] = {}
        for index, signal in enumerate(signals):
            if topic := self._topic(signal):
                listening.setdefault(topic, []).append((index, signal))
        if not listening:
            return
        for message in self._trace.messages(*listening):
            for index, signal in listening.get(message.topic, ()):
                for value in _values(message, signal):
                    yield Told(message.monotonic_ns, index, value)

    # ---- of components

    def _releases(self, component: str) -> Iterator[tuple[int, float]]:
        grids = self._trace.deployments(component)
        since = [grid.time_ns for grid in grids]
        released = self._trace.of(component, Kind.RELEASE)["b"].tolist()
        for time_ns in [self._begin_ns, *released]:
            grid = grids[max(bisect_right(since, time_ns) - 1, 0)]
            yield time_ns, grid.period_ns / 1e9

    def _overruns(self, component: str) -> Iterator[tuple[int, float]]:
        yield self._begin_ns, 0.0
        for count, row in enumerate(self._trace.of(component, Kind.OVERRUN), start=1):
            yield int(row["b"]), float(count)

    def _changes(self, component: str) -> Iterator[tuple[int, float]]:
        """Of a component; with none named of the architecture, its starts, stops and faults among them."""
        if component:
            rows = self._committed(component)
            times = [int(row["time_ns"]) for row in rows]
        else:
            each = [
                rows["time_ns"].tolist()
                for name in self._trace.components
                for rows in (self._committed(name), self._trace.of(name, *_STATES))
            ]
            times = sorted(time_ns for one in each for time_ns in one)
        yield from ((time_ns, float(count)) for count, time_ns in enumerate(times, start=1))

    def _committed(self, component: str) -> Records:
        rows = self._trace.of(component, Kind.ARMED)
        committed: Records = rows[rows["b"] == _COMMITTED]
        return committed

    def _period_ns(self, component: str, time_ns: int) -> int:
        grid = self._trace.deployment_at(component, time_ns)
        return grid.period_ns if grid is not None else 0


def _values(message: Message, signal: SignalSpec) -> Iterator[float]:
    """What one message tells a signal."""
    if signal.kind in ("message", "arrival"):
        yield 0.0
    elif signal.kind == "field":
        yield number_at(message.msg, signal.detail)
    else:
        yield from (number_at(one, "level") for one in message.msg.status if one.name == signal.target)
