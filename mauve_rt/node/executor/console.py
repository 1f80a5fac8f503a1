"""What an executor says on the console and /rosout, a line for each thing: `what: outcome: why`."""

import inspect
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.impl.rcutils_logger import RcutilsLogger
from rclpy.lifecycle import LifecycleNode
from rclpy.qos import QoSPolicyKind

from mauve_rt._bridge import TopicReport
from mauve_rt.control.requests import Outcome, Request
from mauve_rt.counts import counted
from mauve_rt.errors import one_line

REFUSED_EVERY_S = 10.0  # how often the refused messages of a topic are told, after the first
_LONGEST = 400  # characters of foreign text in a line
_NODE_LEASE_S = 20


class Console(RcutilsLogger):
    """A node's logger that takes the caller of a line from the stack.

    rclpy searches for the caller in all loaded modules and their files: 15 ms for the first line, 0.2 ms for
    each other one, while components wait for the interpreter.
    """

    def log(self, message: str, severity: int, **filters: Any) -> bool:
        """Write one line."""
        if filters:  # which rclpy keeps for each caller
            return bool(super().log(message, severity, **filters))
        if not self.is_enabled_for(severity):
            return False
        # Beyond info(), error() ... The frame of log() itself in a variable would keep all of these for the
        # garbage collector, and the requests that they have.
        caller: Any = inspect.currentframe().f_back.f_back  # type: ignore[union-attr]
        code = caller.f_code
        rclpy_implementation.rclpy_logging_rcutils_log(
            severity, self.name, message, code.co_name, code.co_filename, caller.f_lineno
        )
        return True


def log_request(console: RcutilsLogger, request: Request, outcome: Outcome) -> None:
    """Say what was asked, by whom and why, and what came of it."""
    who = f" by {_foreign(request.requested_by)}" if request.requested_by else ""
    why = f" ({_foreign(request.cause)})" if request.cause else ""
    asked = f"request{who}{why}: {_foreign(str(request))}"
    if outcome.success:
        console.info(f"{asked}: done, revision {outcome.revision}: {_foreign(outcome.message)}")
    else:
        console.warning(f"{asked}: refused, {outcome.code.name}: {_foreign(outcome.message)}")


def _foreign(text: str) -> str:
    """Somebody else's text as a part of one line."""
    line = "".join(c if c.isprintable() else "?" for c in one_line(text))
    return line if len(line) <= _LONGEST else f"{line[: _LONGEST - 3]}..."


class TopicWatch:
    """Warns of topics that do not fit and of messages that were refused. look() is for one thread."""

    def __init__(self, console: RcutilsLogger, *, now: Callable[[], float] = time.monotonic) -> None:
        self._console = console
        self._now = now
        self._misfits: set[tuple[str, str]] = set()
        self._refused: dict[str, tuple[int, float]] = {}  # by topic: how many were told, and when

    def look(self, reports: Sequence[TopicReport], types: Mapping[str, Sequence[str]]) -> None:
        """Compare with the last look; `types`: those of other nodes by topic."""
        for report in reports:
            subject = f"topic {report.topic} of resource '{report.resource}'"
            for what in self._news(report, types.get(report.topic, ())):
                self._console.warning(f"{subject}: {what}")
            if more := self._refused_since(report):
                why = report.refusal or "by the middleware"
                self._console.warning(f"{subject}: {counted(more, 'message')} refused: {why}")
        present = {report.topic for report in reports}
        self._misfits = {misfit for misfit in self._misfits if misfit[0] in present}
        self._refused = {topic: told for topic, told in self._refused.items() if topic in present}

    def _news(self, report: TopicReport, types: Sequence[str]) -> Iterator[str]:
        found = (
            {f"other nodes use {' and '.join(types)} on it, with whom it does not talk"} if types else set()
        )
        if report.troubles.incompatible_qos:
            policy = QoSPolicyKind(report.troubles.policy).name.lower()
            found.add(f"another node's quality of service does not fit, in {policy}: they do not talk")
        for what in sorted(found):
            if (report.topic, what) not in self._misfits:
                self._misfits.add((report.topic, what))
                yield what

    def _refused_since(self, report: TopicReport) -> int:
        """How many were refused since they were told last, when it is time to tell."""
        told, when = self._refused.get(report.topic, (0, -REFUSED_EVERY_S))
        if report.refused < told:  # bound anew
            told = 0
        if report.refused == told or self._now() - when < REFUSED_EVERY_S:
            return 0
        self._refused[report.topic] = (report.refused, self._now())
        return report.refused - told


class NameWatch:
    """Warns of another node with this one's name and namespace. look() is for one thread."""

    def __init__(self, node: LifecycleNode) -> None:
        self._node = node
        self._count = 1

    def look(self) -> None:
        """Compare the graph with the last look."""
        own = (self._node.get_name(), self._node.get_namespace())
        before, self._count = self._count, max(1, self._node.get_node_names_and_namespaces().count(own))
        if self._count > 1 and self._count != before:
            self._node.get_logger().warning(f"name: {self.warnings()[0]}")
        elif self._count == 1 and before > 1:
            self._node.get_logger().info("name: no other node has this name any more")

    def warnings(self) -> list[str]:
        """What was found at the last look. From any thread."""
        count, name = self._count, self._node.get_fully_qualified_name()
        what = "requests are answered by any of them; end one, or start it with -r __ns:= or -r __node:="
        killed = f"one that was killed is seen for up to {_NODE_LEASE_S} s"
        return [f"{count} nodes are called {name}: {what} ({killed})"] if count > 1 else []
