"""Safe outputs wait for nothing: no interpreter's lock, no console that nobody reads, no request."""

import fcntl
import os
import signal
import tempfile
import tty
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from std_msgs.msg import Float64

from mauve_msgs.msg import ReconfigurationStep
from mauve_msgs.srv import ListComponents, LoadRules, Reconfigure
from mauve_rt.control.requests import Code

NODE = "/robot_1/executor"
REQUESTS = 100
SMALLEST_PIPE = 4096  # bytes
DEACTIVATE = Transition(id=Transition.TRANSITION_DEACTIVATE)


def counts_of(graph: Any) -> list[Float64]:
    counts: list[Float64] = graph.hear(Float64, "/robot_1/count")
    graph.spin_until(lambda: len(counts) > 3, "counts")
    return counts


def await_safe(graph: Any, counts: list[Float64]) -> None:
    graph.spin_until(lambda: counts[-1].data == 0.0, "the type's zero, written at the stop")


@pytest.fixture(params=["pipe", "terminal"])
def unread(request: Any) -> Iterator[int]:
    """The writer's end of something that nobody reads, and that holds a few lines."""
    if request.param == "pipe":
        reader, writer = os.pipe()
        fcntl.fcntl(writer, fcntl.F_SETPIPE_SZ, SMALLEST_PIPE)
    else:
        reader, writer = os.openpty()
        tty.setraw(writer)
    yield writer
    os.close(writer)
    os.close(reader)


def test_a_console_that_nobody_reads_holds_up_nothing(
    unread: int, architecture: Path, start_executor: Callable[..., Any], graph: Any
) -> None:
    executor = start_executor("-p", f"architecture:={architecture}", console=unread)
    counts = counts_of(graph)
    for number in range(REQUESTS):  # each is a line of some 300 characters
        text = f"'{number:0200}'"
        label = ReconfigurationStep(kind="set_property", target="sleepy", name="label", value=text)
        assert graph.ask(Reconfigure, f"{NODE}/reconfigure", steps=[label]).success
    assert graph.ask(ListComponents, f"{NODE}/list_components").components
    assert executor.end(signal.SIGTERM)[0] == 0
    await_safe(graph, counts)


def test_a_signal_waits_for_no_lock_of_the_interpreter(
    architecture: Path, start_executor: Callable[..., Any], graph: Any
) -> None:
    text = architecture.read_text(encoding="utf-8").replace("period_ms: 5000", "period_ms: 20")
    before, after = "sleepy: {shell: executor_tests/CounterShell, core: executor_tests/", "PyKeeping,"
    text = text.replace(f"{before}Counter,", f"{before}{after}", 1)
    architecture.write_text(text, encoding="utf-8")
    executor = start_executor("-p", f"architecture:={architecture}")
    counts = counts_of(graph)
    keeping = Path(tempfile.gettempdir()) / f"mauve_keeping_{executor.process.pid}"
    keeping.touch()
    try:
        graph.spin_until(lambda: keeping.read_text("utf-8") == "keeping", "the interpreter to be kept")
        executor.process.send_signal(signal.SIGTERM)
        await_safe(graph, counts)
        assert keeping.read_text("utf-8") == "keeping", "outputs are safe while the interpreter is kept"
        executor.wait()
    finally:
        keeping.unlink()


def test_a_rules_file_that_is_a_pipe_is_refused_at_once(
    architecture: Path, start_executor: Callable[..., Any], graph: Any, tmp_path: Path
) -> None:
    executor = start_executor("-p", f"architecture:={architecture}")
    counts = counts_of(graph)
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    refused = graph.ask(LoadRules, f"{NODE}/load_rules", path=str(pipe))
    assert (refused.success, refused.code) == (False, Code.INVALID), refused
    assert "not a regular file" in refused.message
    assert graph.ask(ChangeState, f"{NODE}/change_state", transition=DEACTIVATE).success
    await_safe(graph, counts)
    assert executor.end(signal.SIGTERM)[0] == 0
