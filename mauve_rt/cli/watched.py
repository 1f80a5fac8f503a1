"""What `mauve watch` knows of executors: polled and received without waiting for any of them."""

import time
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from mauve_msgs.msg import BoundViolation, ReconfigurationEvent
from mauve_msgs.srv import ListComponents, ListRules, ReadValues
from mauve_rt.cli.client import Client
from mauve_rt.fields import field_at, flat_fields
from mauve_rt.trace.format.message_decoding import Decoder

LIST_S, VALUES_S = 1.0, 0.5
"""Between two requests."""
LOST_S = 3.0
"""Without an answer for so long an executor is not there."""
_SAMPLES = 60
_EXECUTION_MAX = "execution_max_ns["


class Figures(NamedTuple):
    """Of a component, from /diagnostics; 0 where it has not told any."""

    rate_hz: float = 0.0
    wakeup_ns: int = 0
    """Worst of the last second, as the next."""
    response_ns: int = 0
    execution_ns: int = 0
    """Longest of any state since the start."""
    overruns: int = 0
    remark: str = ""


@dataclass
class Followed:
    """A value, and how it went lately."""

    text: str = ""
    age_ns: int = 0
    writes: int = 0
    numbers: deque[float] = field(default_factory=lambda: deque(maxlen=_SAMPLES))


class WatchedExecutor:
    """One executor: the last that it said. For one thread."""

    def __init__(self, client: Client, name: str, values: Sequence[str]) -> None:
        """`values`: RESOURCE or COMPONENT.PORT, with a field behind a ':' if one number of it is meant."""
        self.name = name
        self.listed: Any = None
        """The last reply of ~/list_components; None: it never answered."""
        self.rules: Sequence[Any] = ()
        self.figures: dict[str, Figures] = {}
        self.values: dict[str, Followed] = {}
        self.last_event: Any = None
        self.last_violation: Any = None
        self._wanted = [*values]
        self._opened: list[str] = []
        self._decoders: dict[str, Decoder] = {}
        self._lacks_definitions = True
        self._counted: dict[str, tuple[float, int]] = {}
        self._heard_s = 0.0
        self._list = client.poll(ListComponents, f"{name}/list_components", every_s=LIST_S)
        self._list_rules = client.poll(ListRules, f"{name}/list_rules", every_s=LIST_S)
        self._read = client.poll(ReadValues, f"{name}/read_values", every_s=VALUES_S)
        client.follow(ReconfigurationEvent, f"{name}/events", self._take_event)
        client.follow(BoundViolation, f"{name}/violations", self._take_violation)

    @property
    def is_there(self) -> bool:
        """Whether it has answered lately."""
        return self.listed is not None and time.monotonic() < self._heard_s + LOST_S

    def open(self, component: str) -> None:
        """Poll the values of a component's ports too; empty: of none."""
        self._opened = [
            f"{each.name}.{port.name}"
            for each in (self.listed.components if self.listed is not None else ())
            if each.name == component
            for port in each.ports
            if port.resource and port.kind in (port.READ, port.WRITE, port.EVENT)
        ]

    def look(self) -> None:
        """Ask what is due, and take what was answered."""
        if (reply := self._list.look(ListComponents.Request)) is not None:
            self.listed, self._heard_s = reply, time.monotonic()
            known = {component.name for component in reply.components}
            self.figures = {name: each for name, each in self.figures.items() if name in known}
        if (reply := self._list_rules.look(ListRules.Request)) is not None:
            self.rules = reply.rules
        wanted = [*dict.fromkeys([*self._wanted, *self._opened])]
        if wanted and (reply := self._read.look(lambda: self._request(wanted))) is not None:
            self._lacks_definitions = any(
                value.type and value.type not in self._decoders and not value.definition
                for value in reply.values
            )
            self.values = {
                name: self._followed(name, value)
                for name, value in zip(wanted, reply.values, strict=False)
                if value.name == name.partition(":")[0]
            }

    def _request(self, wanted: Sequence[str]) -> Any:
        names = [name.partition(":")[0] for name in wanted]
        return ReadValues.Request(names=names, with_definitions=self._lacks_definitions)

    def _followed(self, name: str, value: Any) -> Followed:
        followed = self.values.get(name, Followed())
        if value.problem:
            return Followed(text=value.problem)
        if value.status == value.NONE:
            return Followed(text="nothing was written yet")
        if value.type not in self._decoders and not value.definition:
            return followed  # of another type now: its definition comes with the next poll
        try:
            message = self._decoder(value).decode(bytes(value.data))
            path = name.partition(":")[2]
            fields = dict(flat_fields(field_at(message, path), path) if path else flat_fields(message))
        except ValueError as error:
            return Followed(text=str(error))
        number = next((each for each in fields.values() if isinstance(each, int | float)), None)
        if number is not None and value.writes != followed.writes:
            followed.numbers.append(float(number))
        followed.text = "  ".join(f"{key} {_short(each)}" for key, each in fields.items())
        followed.age_ns, followed.writes = value.age_ns, value.writes
        return followed

    def _decoder(self, value: Any) -> Decoder:
        if value.type not in self._decoders:
            self._decoders[value.type] = Decoder(value.type, value.definition)
        return self._decoders[value.type]

    def take_diagnostics(self, message: Any) -> None:
        """Take what a DiagnosticArray says of this executor."""
        now_s = message.header.stamp.sec + message.header.stamp.nanosec / 1e9
        prefix = f"{self.name}: "
        for status in message.status:
            if status.name.startswith(prefix):
                name = status.name.removeprefix(prefix)
                told = {value.key: value.value for value in status.values}
                if "wakeup_recent_max_ns" in told:
                    is_well = status.level == b"\0"
                    self.figures[name] = self._figures(name, now_s, told, "" if is_well else status.message)

    def _figures(self, name: str, now_s: float, told: Mapping[str, str], remark: str) -> Figures:
        releases = int(told["releases"])
        then_s, before = self._counted.get(name, (now_s, releases))
        self._counted[name] = now_s, releases
        return Figures(
            rate_hz=(releases - before) / (now_s - then_s) if now_s > then_s and releases >= before else 0.0,
            wakeup_ns=int(told["wakeup_recent_max_ns"]),
            response_ns=int(told.get("response_recent_max_ns", 0)),
            execution_ns=max(_execution_maxima(told), default=0),
            overruns=int(told["overruns"]),
            remark=remark,
        )

    def _take_event(self, event: Any) -> None:
        self.last_event = event

    def _take_violation(self, violation: Any) -> None:
        self.last_violation = violation


def _execution_maxima(told: Mapping[str, str]) -> Iterator[int]:
    return (int(value) for key, value in told.items() if key.startswith(_EXECUTION_MAX))


def _short(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.4g}"
    return "".join(each if each.isprintable() else "?" for each in str(value))[:60]
