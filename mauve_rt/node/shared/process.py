"""A process that ends well: on a signal at any moment, outputs first, gone within 3 s."""

import faulthandler
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterable
from typing import NoReturn

from mauve_rt.node.shared.failures import report_failure

_GRACE_S = 2.7  # after a signal; then the process ends where it stands, telling where that is
_DUMP = signal.SIGRTMIN + 1  # shows where every thread is
FAILED = 1
BAD_INPUT = 2


class Stop(threading.Event):
    """Set by a signal. The work says when it begins what must be ended in order."""

    def __init__(self) -> None:
        super().__init__()
        self._lock = threading.Lock()
        self._begun = False

    def begin(self) -> None:
        """From here on a signal waits for the work to end itself; does not return where one came before."""
        with self._lock:
            self._begun = True

    def ask(self) -> None:
        """Set it, or end the process with status 0 where nothing has begun."""
        with self._lock:  # kept to the end: nothing begins any more
            if not self._begun:
                leave_now(0)
        self.set()


def run_until_signalled(work: Callable[[Stop], int], *, program: str) -> int:
    """Run `work(stop)` on a thread of its own and return its exit status; a signal sets `stop`.

    An exception of the work becomes one line on stderr, which begins with `program`, and status 1.

    Signals are SIGINT, SIGTERM, SIGQUIT, SIGUSR1, SIGUSR2 and, unless the parent process has it ignored (as
    nohup), SIGHUP. Every thread blocks them, and the main one waits for them in C++: none is lost or late,
    whatever the work is doing. There the outputs of all components are made safe, before anything takes the
    interpreter's lock. One before `stop.begin()`, while modules load, ends the process at once: status 0.
    Work that has not returned 2.7 s after a later one ends with the process, with status 1 and the stack of
    every thread on stderr. For the main thread.

    Raises:
        ImportError: the work could not load what it needs.
    """
    signal.pthread_sigmask(signal.SIG_BLOCK, _end_signals())
    main_thread = threading.get_ident()
    stop = Stop()
    done = threading.Event()
    status = FAILED
    missing: ImportError | None = None

    def body() -> None:
        nonlocal status, missing
        try:
            status = work(stop)
        except ImportError as error:
            missing = error
        except BaseException as error:  # noqa: BLE001 - a SystemExit too, which would end the thread without a word
            report_failure(program, error)
        finally:
            done.set()
            signal.pthread_kill(main_thread, signal.SIGTERM)

    worker = threading.Thread(target=body, name="work", daemon=True)
    worker.start()
    from mauve_rt._kernel import wait_end_signal  # noqa: PLC0415 - takes its time to load, the signals blocked

    faulthandler.register(_DUMP, all_threads=True)
    wait_end_signal(grace_ns=round(_GRACE_S * 1e9), dump_signal=_DUMP)
    if not done.is_set():
        stop.ask()
    worker.join()
    if missing is not None:
        raise missing
    return status


def _end_signals() -> set[signal.Signals]:
    always = {signal.SIGINT, signal.SIGTERM, signal.SIGQUIT, signal.SIGUSR1, signal.SIGUSR2}
    return always if signal.getsignal(signal.SIGHUP) == signal.SIG_IGN else {*always, signal.SIGHUP}


def leave_now(status: int) -> NoReturn:
    """End the process as it stands, without destroying anything: what must be ended in order has been."""
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)


def complain(text: str) -> None:
    """One line on stderr."""
    sys.stderr.write(" ".join(text.split()) + "\n")
    sys.stderr.flush()


def asks_for_help(words: Iterable[str]) -> bool:
    """Whether -h or --help is among a command line's words."""
    return any(word in ("-h", "--help") for word in words)
