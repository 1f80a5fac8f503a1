"""Requests to an executor and their outcomes, as plain values, and the memory of those already answered."""

from _blake2 import blake2b  # hashlib would load OpenSSL: 4 MB and 3 ms of each start
from collections import OrderedDict
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from enum import IntEnum
from typing import TYPE_CHECKING, Any, Literal, Protocol

from mauve_msgs.msg import ReplyCode
from mauve_rt._kernel import ERROR_REPLIES, NOT_MEASURED
from mauve_rt.errors import error_code
from mauve_rt.file_schema.words import cut
from mauve_rt.model.steps import SHOWN_STEP, Step

if TYPE_CHECKING:
    from mauve_rt._kernel import OutputStep

__all__ = [
    "NOT_MEASURED",
    "Code",
    "Outcome",
    "RecordingOrder",
    "RefusalError",
    "ReloadOrder",
    "Report",
    "Request",
    "RequestLog",
    "Step",
    "TimingVerdict",
    "code_name",
    "code_of",
    "reused_id",
]

KEPT_REQUESTS = 1024
_LONGEST_WORDS = 4000


_IntEnum: Any = IntEnum  # to mypy, which knows no generated messages: a test looks at the names in use


class Code(_IntEnum):
    """The constants of mauve_msgs/msg/ReplyCode."""

    vars().update({name: value for name, value in vars(ReplyCode).items() if isinstance(value, int)})


def code_of(error: BaseException) -> Code:
    """The code of an error: the kernel's table has it."""
    code: Code = getattr(Code, ERROR_REPLIES.get(error_code(error), "PREPARE_FAILED"))
    return code


def code_name(code: int) -> str:
    """The name of a code; of one that is not known here its number."""
    return str(Code(code).name) if code in set(Code) else str(code)


class RefusalError(Exception):
    """A request that is not carried out, and why."""

    def __init__(self, code: Code, message: str, timing: "tuple[TimingVerdict, ...]" = ()) -> None:
        super().__init__(message)
        self.code, self.timing = code, timing


BY_RELOAD = "reload by "  # how the author begins of a reload's changes
OVER_RULES = "rules"  # all that are no safety rules
BY_RULE = "rule "  # how the author begins of what a rule does


@dataclass(frozen=True, kw_only=True)
class RecordingOrder:
    """Start to record, stop, or write a snapshot; as mauve_msgs/srv/StartRecording and WriteSnapshot."""

    kind: Literal["start", "stop", "snapshot"]
    bag: str = ""
    topics: tuple[str, ...] = ()
    topic_regexes: tuple[str, ...] = ()
    values: tuple[str, ...] = ()
    split_s: float = 0.0  # 0: the default
    split_bytes: int = 0
    max_size_bytes: int = 0  # 0: no limit
    compression: str = ""  # empty: none
    snapshot_s: float = 0.0  # 0: into a bag, not into memory
    snapshot_bytes: int = 0  # 0: the default

    def __str__(self) -> str:
        words = "stop_recording" if self.kind == "stop" else f"write_snapshot {self.bag}"
        if self.kind == "start":
            words = " ".join(("start_recording", self.bag, *self.topics, *self.topic_regexes, *self.values))
        return cut(words.strip(), _LONGEST_WORDS)


@dataclass(frozen=True, kw_only=True)
class ReloadOrder:
    """Load code anew, or go back; as mauve_msgs/srv/Reload."""

    targets: tuple[str, ...] = ()  # packages and components; none: all that was rebuilt
    back: bool = False
    probation: str = ""  # YAML text, as the value of a step replace_core; empty: none
    generation: int = 0  # to go back from; 0: the last one

    def __str__(self) -> str:
        words = " ".join(("reload", *self.targets)) + " back" * self.back
        return cut(f"{words} {self.probation}" if self.probation else words, _LONGEST_WORDS)


@dataclass(frozen=True, kw_only=True)
class Request:
    """What somebody asked for, by any service: steps, an order to the recording, or a reload."""

    steps: tuple[Step, ...] = ()
    recording: RecordingOrder | None = None
    reload: ReloadOrder | None = None
    request_id: str = ""
    expected_revision: int = 0
    requested_by: str = ""
    cause: str = ""
    rule: str = ""  # whose action it is: its steps are what it wants while it is active
    release: bool = False  # the rule ends; its steps become the base
    priority: int = 0  # of the rule
    release_on_loss: bool = False  # the rule ends, too, when the node that asks is gone
    over: str = ""  # a person's request over the rules: OVER_RULES, or the name of a safety rule
    base: bool = False  # a person's request about what comes back once rules have ended
    dry_run: bool = False
    timeout_s: float = 0.0  # 0: the default
    force: bool = (
        False  # a component whose state does not end in time is given up: see Host.stop() and commit()
    )
    idle: bool = False  # it is made while no job of a participant is pending: see Host.commit()
    idle_within_s: float = 0.0  # 0: the default
    clock_ns: int = 0  # of a start: reference instant of the grid, 0: the deployment's

    def __str__(self) -> str:
        if self.recording is not None:
            return str(self.recording)
        if self.reload is not None:
            return str(self.reload) + " (dry run)" * self.dry_run
        words = cut("; ".join(str(step) for step in self.steps), _LONGEST_WORDS)
        return (
            words + " at an idle instant" * self.idle + " by force" * self.force + " (dry run)" * self.dry_run
        )

    @property
    def is_direct(self) -> bool:
        """Whether it is carried out without a transaction, beside whatever else there is."""
        if self.dry_run or self.idle:
            return False
        return len(self.steps) == 1 and self.steps[0].kind in ("start", "stop")

    @property
    def author(self) -> str:
        """Who makes the change, for `mauve list` and for rules that look whether they did it."""
        if self.rule:
            return f"{BY_RULE}{self.rule}"
        who = (BY_RELOAD if self.reload is not None else "") + (self.requested_by or "a request")
        return cut(f"{who}: {self.cause}" if self.cause else who, SHOWN_STEP)

    def texts(self) -> Iterator[str]:
        """All that is of no fixed size."""
        yield from (self.request_id, self.requested_by, self.cause, self.rule)
        for step in self.steps:
            yield from (step.kind, step.target, step.name, step.value)
        if self.recording is not None:
            order = self.recording
            yield from (order.bag, *order.topics, *order.topic_regexes, *order.values)
        if self.reload is not None:
            yield from (*self.reload.targets, self.reload.probation)

    def digest(self) -> bytes:
        """Of its contents: equal where two requests are, for all that anybody will ever see."""
        return _digest(repr(self))


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
    remark: str = ""
    instant_ns: int = NOT_MEASURED
    release_ns: int = NOT_MEASURED
    taken: tuple[str, ...] = ()
    left: tuple[str, ...] = ()
    outputs: tuple["OutputStep", ...] = ()


@dataclass(frozen=True, kw_only=True)
class TimingVerdict:
    """What the timing analysis says before, during or after a change, as mauve_msgs/msg/TimingVerdict."""

    outcome: str
    sentence: str
    missing: tuple[str, ...] = ()
    witness: str = ""


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
    loaded: tuple[str, ...] = ()  # of a reload: libraries and modules
    timing: tuple[TimingVerdict, ...] = ()  # before, during and after a change, where that is judged
    pending: "Pending | None" = field(default=None, compare=False, repr=False)  # what its report lacks still
    replayed: bool = field(default=False, compare=False)  # the first outcome of a repeated request_id

    @property
    def success(self) -> bool:
        """Whether it was done."""
        return self.code is Code.OK

    def cut(self) -> "Outcome":
        """The same, no text of it longer than people read."""
        return replace(
            self,
            message=cut(self.message, _LONGEST_WORDS),
            report=tuple(replace(step, step=cut(step.step, SHOWN_STEP)) for step in self.report),
            from_core=cut(self.from_core, SHOWN_STEP),
            to_core=cut(self.to_core, SHOWN_STEP),
        )


class Pending(Protocol):
    """A change that is in force, and what the releases after it will tell."""

    def look(self, outcome: Outcome, *, wait_ns: int) -> Outcome:
        """The outcome with what is known by now, or soon; it is pending no more when no more will come."""


class RequestLog:
    """The last outcomes by request_id. Not thread-safe: the caller serialises requests.

    Of a request it keeps a digest and the beginning of its words: requests own no memory, however large.
    """

    def __init__(self, kept: int = KEPT_REQUESTS) -> None:
        self._kept = kept
        self._entries: OrderedDict[bytes, tuple[bytes, str, Outcome]] = OrderedDict()

    def find(self, request: Request) -> Outcome | None:
        """What came of a repeated request, as far as known; a refusal for an id in use; None: not seen."""
        known = self._entries.get(_key(request)) if request.request_id else None
        if known is None:
            return None
        digest, first, outcome = known
        if digest == request.digest():
            return outcome
        return reused_id(request, first)

    def add(self, request: Request, outcome: Outcome) -> None:
        """Remember an outcome; the oldest one is forgotten when there are too many."""
        if request.request_id:
            self._entries[_key(request)] = (request.digest(), cut(str(request), SHOWN_STEP), outcome)
            while len(self._entries) > self._kept:
                self._entries.popitem(last=False)

    def complete(self, request: Request, outcome: Outcome) -> None:
        """Replace the outcome of a request that it remembers by one whose report is complete."""
        known = self._entries.get(_key(request)) if request.request_id else None
        if known is not None and known[0] == request.digest():
            self._entries[_key(request)] = (*known[:2], outcome)


def reused_id(request: Request, first: "Request | str") -> Outcome:
    """The refusal of a request by the id of another one."""
    shown_id, words = cut(request.request_id, SHOWN_STEP), cut(str(first), SHOWN_STEP)
    message = f"request_id '{shown_id}' was used before, for: {words}; take a new id"
    return Outcome(code=Code.REQUEST_ID_REUSED, message=message)


def _key(request: Request) -> bytes:
    return _digest(request.request_id)


def _digest(text: str) -> bytes:
    return blake2b(text.encode("utf-8", "surrogatepass"), digest_size=32).digest()
