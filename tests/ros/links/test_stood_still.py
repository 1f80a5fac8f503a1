"""An executor that is stopped for a while tells that from silence; silence is found all the same."""

import contextlib
import os
import random
import signal
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from listener import Listener, Talker

LIMIT_S, UNDO_S, PERIOD_S = 0.1, 0.1, 0.02
STOPS, LONGEST_S = 20, 40.0


@pytest.fixture
def listener(tmp_path: Path, domain: int) -> Iterator[Listener]:
    made = Listener(tmp_path, limit_s=LIMIT_S, undo_s=UNDO_S, environment={"ROS_DOMAIN_ID": str(domain)})
    yield made
    made.close()


@pytest.fixture
def talker(domain: int, tmp_path: Path) -> Iterator[Talker]:
    made = Talker(PERIOD_S, times=tmp_path / "times", environment={"ROS_DOMAIN_ID": str(domain)})
    yield made
    made.signal(signal.SIGKILL)


def _sleep(talker_stalls: list[float], duration_s: float) -> None:
    """Sleep, and note how late this process woke up: the executor's threads may have been as late."""
    due_s = time.monotonic() + duration_s
    while (left_s := due_s - time.monotonic()) > 0:
        step_s = min(left_s, 0.01)
        began_s = time.monotonic()
        time.sleep(step_s)
        talker_stalls.append(time.monotonic() - began_s - step_s)


def _waits_s(process: int) -> dict[str, float]:
    """How long each thread of a process has been ready to run and did not; a stop is no such wait."""
    waits = {}
    for thread in Path(f"/proc/{process}/task").iterdir():
        with contextlib.suppress(OSError):  # it has ended
            waits[thread.name] = int((thread / "schedstat").read_text().split()[1]) * 1e-9
    return waits


def test_a_stop_of_the_executor_is_no_silence(listener: Listener, talker: Talker) -> None:
    lengths = random.Random(1)  # noqa: S311 - no secret
    listener.until(listener.is_usual, "the rule to be armed")
    time.sleep(1.0)
    listener.until(listener.is_usual, "both to find each other")
    stalls: list[float] = []
    stops = false_alarms = 0
    ends_s = time.monotonic() + LONGEST_S
    while stops < STOPS and time.monotonic() < ends_s:
        before, began_s = listener.alarms(), time.monotonic()
        stalls.clear()
        os.kill(listener.process(), signal.SIGSTOP)
        _sleep(stalls, lengths.choice((0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 2.0)) * lengths.uniform(0.8, 1.2))
        waits_s = _waits_s(listener.process())
        os.kill(listener.process(), signal.SIGCONT)
        _sleep(stalls, lengths.uniform(0.15, 0.35))
        # Else the talker was silent, or the executor's threads could read nothing in time: it proves nothing.
        now_s = _waits_s(listener.process())
        waited_s = max((now_s[thread] - waits_s.get(thread, 0.0) for thread in now_s), default=0.0)
        is_awake = max(stalls) < LIMIT_S / 4 and waited_s < LIMIT_S / 2
        if is_awake and talker.longest_silence_s(began_s) < LIMIT_S / 2:
            stops += 1
            false_alarms += listener.alarms() - before
    assert stops > 5, "so it was asked something"
    assert false_alarms == 0, listener.executor.output
    before = listener.alarms()
    talker.signal(signal.SIGSTOP)
    listener.until(lambda: listener.alarms() > before, "silence that is real")
    talker.signal(signal.SIGCONT)
    listener.until(listener.is_usual, "the way back")
