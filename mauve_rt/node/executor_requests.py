"""Requests to an executor and their outcomes, as plain values, and the memory of those already answered."""

from collections import OrderedDict
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Protocol

from mauve_rt._kernel import NOT_MEASURED
from mauve_rt.errors import error_code

__all__ = [
    "NOT_MEASURED",
    "Code",
    "Outcome",
    "RecordingOrder",
    "RefusalError",
    "Report",
    "Request",
    "RequestLog",
    "Step",
    "code_of",
]

KEPT_REQUESTS = 1024
_SHOWN_VALUE = 60


class Code(IntEnum):
    """The codes of mauve_msgs/srv/Reconfigure."""

    OK = 0
    UNKNOWN_COMPONENT = 1
    UNKNOWN_CORE = 2
    UNDECLARED_CORE = 3
    NOT_RUNNING = 4
    ALREADY_RUNNING = 5
    FAULTED = 6
    NOT_RECONFIGURABLE = 7
    WRONG_REVISION = 8
    REQUEST_ID_REUSED = 9
    PREPARE_FAILED = 10
    ADOPT_REFUSED = 11
    TIMEOUT = 12
    NOT_ACTIVE = 13
    INVALID = 14
    UNSUPPORTED = 15


_INVALID = (
    "invalid_argument",
    "type_mismatch",
    "out_of_range",
    "duplicate_name",
    "unknown_property",
    "unknown_port",
    "unknown_service",
    "unknown_resource",
    "unknown_type",
    "bad_period",
)
_CODES = {
    "unknown_component": Code.UNKNOWN_COMPONENT,
    "unknown_core": Code.UNKNOWN_CORE,
    "unknown_fsm": Code.UNKNOWN_CORE,
    "unknown_shell": Code.UNKNOWN_CORE,
    "undeclared_core": Code.UNDECLARED_CORE,
    "not_running": Code.NOT_RUNNING,
    "already_running": Code.ALREADY_RUNNING,
    "faulted": Code.FAULTED,
    "not_reconfigurable": Code.NOT_RECONFIGURABLE,
    "structural_property": Code.NOT_RECONFIGURABLE,
    "wrong_revision": Code.WRONG_REVISION,
    "adopt_refused": Code.ADOPT_REFUSED,
    "timeout": Code.TIMEOUT,
    "not_configured": Code.NOT_ACTIVE,
    **dict.fromkeys(_INVALID, Code.INVALID),
}


def code_of(error: BaseException) -> Code:
    """The code of an error of the kernel; any that is not known otherwise comes from preparing."""
    return _CODES.get(error_code(error), Code.PREPARE_FAILED)


class RefusalError(Exception):
    """A request that is not carried out, and why."""

    def __init__(self, code: Code, message: str) -> None:
        super().__init__(message)
        self.code = code


@dataclass(frozen=True)
class Step:
    """One step of a transaction, as mauve_msgs/msg/ReconfigurationStep."""

    kind: str
    target: str
    name: str = ""
    value: str = ""

    def __str__(self) -> str:
        value = " ".join(self.value.split())
        short = value if len(value) <= _SHOWN_VALUE else f"{value[: _SHOWN_VALUE - 3]}..."
        return " ".join(word for word in (self.kind, self.target, self.name, short) if word)


@dataclass(frozen=True, kw_only=True)
class RecordingOrder:
    """Start to record, or stop; as mauve_msgs/srv/StartRecording."""

    start: bool
    bag: str = ""
    topics: tuple[str, ...] = ()
    split_s: float = 0.0  # 0: the default
    split_bytes: int = 0

    def __str__(self) -> str:
        return (
            " ".join(("start_recording", self.bag, *self.topics)).strip() if self.start else "stop_recording"
        )


@dataclass(frozen=True, kw_only=True)
class Request:
    """What somebody asked for, whichever service it came by: steps, or an order to the recording."""

    steps: tuple[Step, ...] = ()
    recording: RecordingOrder | None = None
    request_id: str = ""
    expected_revision: int = 0
    requested_by: str = ""
    cause: str = ""
    dry_run: bool = False
    timeout_s: float = 0.0  # 0: the default
    clock_ns: int = 0  # of a start: reference instant of the grid, 0: the deployment's

    def __str__(self) -> str:
        if self.recording is not None:
            return str(self.recording)
        words = "; ".join(str(step) for step in self.steps)
        return f"{words} (dry run)" if self.dry_run else words


@dataclass(frozen=True, kw_only=True)
class Report:
    """What one step changed and cost, as mauve_msgs/msg/StepReport. Times in ns."""

    step: str
    component: str
    prepare_ns: int = 0
    blackout_ns: int = NOT_MEASURED
    missed_releases: int = 0
    phase_nominal_ns: int = NOT_MEASURED
    phase_actual_ns: int = NOT_MEASURED
    from_core: str = ""
    to_core: str = ""


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What came of a request."""

    code: Code
    message: str
    revision: int = 0  # after the request
    report: tuple[Report, ...] = ()
    from_core: str = ""
    to_core: str = ""
    bag: str = ""  # of an order to the recording
    pending: "Pending | None" = field(default=None, compare=False, repr=False)  # what its report lacks still
    replayed: bool = field(default=False, compare=False)  # the first outcome of a repeated request_id

    @property
    def success(self) -> bool:
        """Whether it was done."""
        return self.code is Code.OK


class Pending(Protocol):
    """A change that is in force, and what the releases after it will tell."""

    def look(self, outcome: Outcome, *, wait_ns: int) -> Outcome:
        """The outcome with what is known by now, or soon; it is pending no more when no more will come."""


class RequestLog:
    """The last outcomes by request_id. Not thread-safe: the caller serialises requests."""

    def __init__(self, kept: int = KEPT_REQUESTS) -> None:
        self._kept = kept
        self._entries: OrderedDict[str, tuple[Request, Outcome]] = OrderedDict()

    def find(self, request: Request) -> Outcome | None:
        """The first outcome of a repeated request; a refusal for the id of another one; None: not seen."""
        known = self._entries.get(request.request_id) if request.request_id else None
        if known is None:
            return None
        first, outcome = known
        if first == request:
            return outcome
        message = f"request_id '{request.request_id}' was used before, for: {first}; take a new id"
        return Outcome(code=Code.REQUEST_ID_REUSED, message=message)

    def add(self, request: Request, outcome: Outcome) -> None:
        """Remember an outcome; the oldest one is forgotten when there are too many."""
        if request.request_id:
            self._entries[request.request_id] = (request, outcome)
            while len(self._entries) > self._kept:
                self._entries.popitem(last=False)
