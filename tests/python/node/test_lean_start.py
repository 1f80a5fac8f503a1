"""What our programs leave out of their start."""

import json
import subprocess
import sys

import pytest

PROGRAM = """
import json, os, sys
from mauve_rt.node.shared.lean_start import leave_out_unused
leave_out_unused()
import numpy
from std_msgs.msg import Header
Header.__import_type_support__()
threads = len(os.listdir("/proc/self/task"))
print(json.dumps([threads, os.environ["OPENBLAS_NUM_THREADS"], "lark" in sys.modules]))
"""


def started(monkeypatch: pytest.MonkeyPatch, chosen: str | None) -> list[object]:
    """Threads, chosen number of threads, and whether the message generator was loaded."""
    if chosen is None:
        monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    else:
        monkeypatch.setenv("OPENBLAS_NUM_THREADS", chosen)
    done = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=True)
    found: list[object] = json.loads(done.stdout)
    return found


def test_neither_threads_of_numpy_nor_the_message_generator(monkeypatch: pytest.MonkeyPatch) -> None:
    assert started(monkeypatch, None) == [1, "1", False]


def test_the_users_number_of_threads_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    assert started(monkeypatch, "2")[1:] == ["2", False]
