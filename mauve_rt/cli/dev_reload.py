"""One reload of `mauve dev`: from the request to the verdict on the new code."""

import time
import uuid
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from mauve_msgs.msg import Probation
from mauve_msgs.srv import ReadValues, Reload
from mauve_rt.cli.dev_outputs import OutputSamples, OutputStep
from mauve_rt.cli.exchange import Exchange
from mauve_rt.cli.views import is_incomplete
from mauve_rt.control.requests import code_name

_SAMPLE_S = 0.05  # between two polls of the outputs
_FIRST_SAMPLE_S = 0.5  # without a reply for so long, the reload goes on without values of before
_REPEAT_S = 0.02  # between two requests for the releases that followed
_RELEASE_S = 2.0  # wait for the first release of a component, and for its outputs
_NO_PROBATION_S = 3.0  # a list of components comes each second
_VERDICTS = {
    Probation.RUNNING: "running",
    Probation.PASSED: "passed",
    Probation.REVERTED: "reverted",
    Probation.INCONCLUSIVE: "inconclusive",
}


class Verdict(NamedTuple):
    """The probations of all components that a reload has changed, as one."""

    name: str
    """running, passed, reverted, inconclusive; none: the executor reports no probation."""
    reason: str = ""
    left_s: float = 0.0


class Answer(NamedTuple):
    """The executor's reply."""

    success: bool
    message: str
    is_changed: bool
    """Whether code was loaded, or put in force again."""


@dataclass
class Links:
    """The services of one executor that a reload needs."""

    reload: Exchange
    read: Exchange
    components: Callable[[], Sequence[Any]]
    """As the executor listed them last."""


@dataclass
class ReloadRun:
    """Polled by look(); waits for nothing. For one thread."""

    links: Links
    request: Reload.Request
    outputs: Sequence[str]
    answer: Answer | None = None
    release_s: float | None = None
    """First release with the new code, of the last component, by time.monotonic(); None: none seen."""
    steps: Sequence[OutputStep] = ()
    is_settled: bool = False
    """Whether the releases and the steps in the outputs are known, or the wait for them is over."""
    _samples: OutputSamples = field(default_factory=OutputSamples)
    _begun_s: float = field(default_factory=time.monotonic)
    _is_asked: bool = False
    _reply: Any = None
    _answered_s: float = 0.0
    _due_s: float = 0.0
    _repeat_s: float = 0.0
    _known: frozenset[tuple[str, int]] = frozenset()

    def __post_init__(self) -> None:
        """Take note of the probations of before."""
        self.request.request_id = str(uuid.uuid4())
        listed = self.links.components()
        self._known = frozenset((each.component, each.begin_ns) for one in listed for each in one.probations)
        self._read()

    def look(self) -> None:
        """Take replies, and send requests that are due."""
        now_s = time.monotonic()
        if self.is_settled:
            return
        is_sampled = not self.outputs
        if (values := self.links.read.look(now_s)) is not None:
            self._samples.take(values.values)
            is_sampled = not self._samples.lacks_definitions
            self._due_s = now_s + (0.0 if self._samples.lacks_definitions else _SAMPLE_S)
        if self._due_s and now_s >= self._due_s:
            self._read()
        if not self._is_asked and (is_sampled or now_s >= self._begun_s + _FIRST_SAMPLE_S):
            self._is_asked = True
            self.links.reload.send(self.request)
        if self._is_asked and (reply := self.links.reload.look(now_s)) is not None:
            self._take(reply, now_s)
        if self.answer is not None and self._reply is not None:
            self._settle(now_s)

    def verdict(self) -> Verdict:
        """On the new code."""
        found = [
            each
            for component in self.links.components()
            if component.name in self._components()
            for each in component.probations
            if (each.component, each.begin_ns) not in self._known
        ]
        since_s = time.monotonic() - self._answered_s
        if not found:
            return (
                Verdict("running", left_s=self.request.probation_s)
                if since_s < _NO_PROBATION_S
                else Verdict("none")
            )
        names = [_VERDICTS.get(each.verdict, "inconclusive") for each in found]
        for name in ("reverted", "running", "inconclusive"):
            if name in names:
                first = found[names.index(name)]
                reason = f"{first.component}: {first.reason}" if first.reason else ""
                left_s = (
                    max(0.0, (first.end_ns - first.begin_ns) / 1e9 - since_s) if name == "running" else 0.0
                )
                return Verdict(name, reason, left_s)
        return Verdict("passed")

    def _components(self) -> set[str]:
        return (
            {step.component for step in self._reply.report if step.component}
            if self._reply is not None
            else set()
        )

    def _instants_ns(self) -> Mapping[str, int]:
        none = -(2**63) + 1
        return {step.component: step.instant_ns for step in self._reply.report if step.instant_ns != none}

    def _read(self) -> None:
        self._due_s = 0.0
        if self.outputs:
            names = [*self.outputs]
            request = ReadValues.Request(names=names, with_definitions=self._samples.lacks_definitions)
            self.links.read.send(request)

    def _take(self, reply: Any, now_s: float) -> None:
        self._reply = reply
        if self.answer is None:
            self._answered_s = now_s
            refused = f"{code_name(reply.code)} ({reply.code}): {reply.message}"
            is_changed = reply.success and bool(reply.loaded or reply.report)
            self.answer = Answer(reply.success, reply.message if reply.success else refused, is_changed)

    def _settle(self, now_s: float) -> None:
        """Wait for the releases and the outputs; then note both."""
        is_late = now_s >= self._answered_s + _RELEASE_S
        if self.answer is None or not self.answer.is_changed:
            self.is_settled = True
            return
        is_complete = not is_incomplete(self._reply)
        if is_complete and self.release_s is None:
            self.release_s = _release_s(self._reply.report, self._begun_s, now_s)
        if is_late or (is_complete and self._samples.are_after(self._instants_ns())):
            self.steps = self._samples.steps(self._instants_ns())
            self.is_settled = True
        elif not is_complete and not self.links.reload.is_busy and now_s >= self._repeat_s:
            self._repeat_s = now_s + _REPEAT_S
            self.links.reload.send(self.request)


def _release_s(report: Sequence[Any], begun_s: float, now_s: float) -> float | None:
    """Of the last component; `now_s` where instants are not of CLOCK_MONOTONIC; None: none came."""
    releases_s = []
    for step in report:
        none = type(step).NOT_MEASURED
        if none not in (step.release_ns, step.phase_nominal_ns, step.phase_actual_ns):
            releases_s.append((step.release_ns - step.phase_nominal_ns + step.phase_actual_ns) / 1e9)
    if not releases_s:
        return None
    last_s = max(releases_s)
    return last_s if begun_s <= last_s <= now_s else now_s
