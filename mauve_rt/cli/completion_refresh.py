"""`python -m mauve_rt.cli.completion_refresh`: ask all executors for their parts, for the next completion.

A completion starts this program in the background. The program ends after 10 s at the latest.
"""

import signal
import sys
import time
from typing import Any

from mauve_rt.node.shared.first_steps import take_first_steps
from mauve_rt.node.shared.lean_start import leave_out_unused

_LIFETIME_S = 10
_REPLY_S = 2.0  # for the reply of an executor that was found: one whose process is frozen gives none
_RESEND_S = 0.5  # a reply to a client that the executor does not know yet is lost
_LOOK_S = 0.01


def main() -> int:
    """Write the cache anew; returns the exit status."""
    signal.alarm(_LIFETIME_S)  # ends the process, whatever ROS waits for
    take_first_steps("mauve")
    leave_out_unused()
    from mauve_rt.cli.client import connected  # noqa: PLC0415 - after what ROS is to leave out

    with connected(first=True) as client:
        _Survey(client).run()
    return 0


class _Survey:
    """Requests to all executors at once. The client writes each answer into the cache."""

    def __init__(self, client: Any) -> None:
        self._client = client
        self._requests: dict[str, list[Any]] = {}  # futures, by executor
        self._sent_s: dict[str, float] = {}
        self._answered: set[str] = set()

    def run(self) -> None:
        """Until all executors are known, and each has answered or had the time to."""
        for found in self._client.search():
            if found is None:
                self._look()
                continue
            deadline_s = time.monotonic() + _REPLY_S
            while not self._answered.issuperset(found) and time.monotonic() < deadline_s:
                self._look()

    def _look(self) -> None:
        self._ask(self._client.seen_executors())
        self._client.spin_all(_LOOK_S)
        self._note_replies()

    def _ask(self, executors: list[str]) -> None:
        now_s = time.monotonic()
        for name in executors:
            is_due = now_s >= self._sent_s.get(name, 0.0) + _RESEND_S
            if name in self._answered or not is_due:
                continue
            future = self._client.ask_for_list(name)
            if future is not None:
                self._requests.setdefault(name, []).append(future)
                self._sent_s[name] = now_s

    def _note_replies(self) -> None:
        for name, futures in self._requests.items():
            done = [future for future in futures if future.done()]
            if done and name not in self._answered:
                self._answered.add(name)
                self._client.note_list(name, done[0].result())


if __name__ == "__main__":
    sys.exit(main())
