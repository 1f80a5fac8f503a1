"""How a node's process ends on a signal: at once while it loads, in order later, by force where it hangs."""

import signal
import subprocess
import sys
from collections.abc import Iterator

import pytest

from mauve_rt._kernel import END_SIGNALS

SIGNALS = sorted(map(signal.Signals, END_SIGNALS))
BODY = """\
import threading
from mauve_rt.node.shared.process import leave_now, run_until_signalled

def work(stop):
    {work}

leave_now(run_until_signalled(work, program="node"))
"""
LOADS_FOR_GOOD = "print('ready', flush=True); threading.Event().wait()"
ENDS_IN_ORDER = "stop.begin(); print('ready', flush=True); stop.wait(); print('sealed'); return 0"
STAYS_IGNORED = (
    "import os, signal; stop.begin(); os.kill(os.getpid(), signal.SIGHUP); stop.wait(0.2) and leave_now(3); "
    "print('ready', flush=True); stop.wait(); print('sealed'); return 0"
)
HANGS = "stop.begin(); print('ready', flush=True); threading.Event().wait()"


def end(work: str, number: signal.Signals, *wrapper: str) -> tuple[int, str, str]:
    """Status, later output and errors of a process that was signalled when it said that it was ready."""
    with subprocess.Popen(
        [*wrapper, sys.executable, "-c", BODY.format(work=work)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        process.send_signal(number)
        output, errors = process.communicate()
        return process.returncode, output, errors


@pytest.fixture(autouse=True)
def _hangup_is_not_ignored() -> Iterator[None]:
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)  # child processes inherit that
    yield
    signal.signal(signal.SIGHUP, before)


@pytest.mark.parametrize("number", SIGNALS)
def test_while_it_loads_it_is_gone_at_once(number: signal.Signals):
    assert end(LOADS_FOR_GOOD, number) == (0, "", "")


@pytest.mark.parametrize("number", SIGNALS)
def test_what_has_begun_is_ended_in_order(number: signal.Signals):
    assert end(ENDS_IN_ORDER, number) == (0, "sealed\n", "")


def test_what_hangs_is_ended_by_force_and_told():
    status, output, errors = end(HANGS, signal.SIGINT)
    assert (status, output) == (1, "")
    assert errors.startswith("The process did not end within 2700 ms of the signal.")
    assert "in work" in errors


def test_a_signal_that_the_parent_process_ignores_stays_ignored():
    assert end(STAYS_IGNORED, signal.SIGTERM, "nohup") == (0, "sealed\n", "")
