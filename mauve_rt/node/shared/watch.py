"""Whatever runs in a node on its own (threads, callbacks), so that none of it ends in silence. Knows no ROS.

What is raised there is told with its traceback, and the work goes on with the next item. A thread that cannot
go on ends the process in order: components parked, outputs safe.
"""

import functools
import threading
import time
import traceback
from collections.abc import Callable
from typing import Any

from mauve_rt.errors import exception_text, valid_text

_PAUSE_S = 0.1  # after a failure, so that one that lasts takes no CPU from the components
_PATIENCE = 100  # failures in a row, 10 s of them, after which a thread cannot go on
_SILENCE_S = 60.0  # the same failure is told once in so long
_KEPT = 100  # failures that are remembered as told


class Watch:
    """Of one node. Its methods may be called from any thread, and never raise.

    | member   | written by            | guarded by |
    | -------- | --------------------- | ---------- |
    | `_told`  | tell(): any thread    | `_lock`    |
    | `broken` | a thread that gave up | itself     |
    """

    def __init__(self, log: Callable[[str], Any]) -> None:
        """`log` takes the text of an error, of several lines."""
        self._log = log
        self._lock = threading.Lock()
        self._told: dict[tuple[str, str], float] = {}
        self.broken = threading.Event()  # a thread could not go on: the process has to end

    def tell(self, where: str, error: BaseException) -> None:
        """Log what was raised in `where`, with the traceback; the same again not before a minute."""
        text = exception_text(error)
        if not self._is_news((where, text)):
            return
        lines = "".join(traceback.format_tb(error.__traceback__)).rstrip()
        self._write(f"{where} failed and goes on: {text}\n{valid_text(lines)}".rstrip())

    def report(self, text: str) -> None:
        """Log a line about what was not done."""
        self._write(text)

    def thread(self, name: str, step: Callable[[], None], *, ending: threading.Event) -> threading.Thread:
        """A thread, not started yet, that does `step` again and again until `ending` is set."""
        return threading.Thread(target=self._run, args=(name, step, ending), name=name, daemon=True)

    def guarded(
        self, where: str, callback: Callable[..., Any], *, otherwise: Callable[..., Any] | None = None
    ) -> Callable[..., Any]:
        """The callback, told of rather than ended by what it raises.

        It returns `otherwise(*arguments, error)` then.
        """

        @functools.wraps(callback)
        def guard(*arguments: Any, **options: Any) -> Any:
            try:
                return callback(*arguments, **options)
            except BaseException as error:  # noqa: BLE001 - rclpy would leave its group of callbacks blocked
                self.tell(where, error)
                return otherwise(*arguments, error) if otherwise is not None else None

        return guard

    def _run(self, name: str, step: Callable[[], None], ending: threading.Event) -> None:
        failures = 0
        while not ending.is_set():
            try:
                step()
                failures = 0
            except BaseException as error:  # noqa: BLE001 - SystemExit, too, is of whoever wrote a part
                self.tell(f"thread '{name}'", error)
                failures += 1
                if failures >= _PATIENCE:
                    self._write(f"thread '{name}' failed {failures} times in a row: the executor ends")
                    self.broken.set()
                    return
                ending.wait(_PAUSE_S)

    def _is_news(self, failure: tuple[str, str]) -> bool:
        now_s = time.monotonic()
        with self._lock:
            if now_s - self._told.get(failure, -_SILENCE_S) < _SILENCE_S:
                return False
            while len(self._told) >= _KEPT:
                del self._told[next(iter(self._told))]
            self._told[failure] = now_s
            return True

    def _write(self, text: str) -> None:
        try:
            self._log(text)
        except BaseException:  # noqa: BLE001 - as when the context of ROS is gone: stderr is what is left
            traceback.print_exc()
