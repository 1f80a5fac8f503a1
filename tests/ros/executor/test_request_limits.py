"""What requests may take of an executor: size, memory, priorities; and what stays of them: nothing."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from mauve_msgs.msg import ReconfigurationStep
from mauve_msgs.srv import ListComponents, Reconfigure, ReplaceCore, Stop
from mauve_rt.control.requests import Code

NODE = "/robot_1/executor"
MB = 1_000_000
REQUESTS = 500
ROOM_MB = 30  # of the 500 that were sent; the middleware and the allocator keep some
COUNTER = (
    "{shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm, %s}"
)


def resident_mb(process_id: int) -> float:
    lines = Path(f"/proc/{process_id}/status").read_text("ascii").splitlines()
    return next(float(line.split()[1]) for line in lines if line.startswith("VmRSS")) / 1000


def reconfigure(graph: Any, *steps: tuple[str, str, str], **fields: Any) -> Any:
    asked = [ReconfigurationStep(kind=kind, target=target, value=value) for kind, target, value in steps]
    return graph.ask(Reconfigure, f"{NODE}/reconfigure", steps=asked, **fields)


def names(graph: Any) -> set[str]:
    reply = graph.ask(ListComponents, f"{NODE}/list_components")
    return {part.name for part in (*reply.components, *reply.resources)}


def test_refused_requests_of_a_megabyte_leave_nothing(executor: Any, graph: Any) -> None:
    def refuse(number: int) -> None:
        core = f"{number:06}" + "x" * MB
        reply = graph.ask(ReplaceCore, f"{NODE}/replace_core", component="counter", core=core)
        assert (reply.success, reply.code) == (False, Code.INVALID)
        assert len(reply.message) < 1000

    for number in range(30):  # buffers of the middleware grow to the size of a request once
        refuse(number)
    before_mb = resident_mb(executor.process.pid)
    for number in range(REQUESTS):
        refuse(number)
    assert resident_mb(executor.process.pid) - before_mb < ROOM_MB


@pytest.mark.usefixtures("executor")
def test_a_large_request_by_its_id_is_answered_as_the_first_time(graph: Any) -> None:
    fields = {"component": "counter", "core": "y" * MB, "request_id": "the same"}
    first = graph.ask(ReplaceCore, f"{NODE}/replace_core", **fields)
    again = graph.ask(ReplaceCore, f"{NODE}/replace_core", **fields)
    assert first == again
    expected = "the request is too large: expected at most 262,144 bytes, found 1,000,"
    assert first.message.startswith(expected)
    assert first.message.endswith("or start the executor with a larger max_request_bytes")
    other = graph.ask(ReplaceCore, f"{NODE}/replace_core", **{**fields, "core": "y" * (MB - 1) + "z"})
    assert other.code == Code.REQUEST_ID_REUSED
    assert len(other.message) < 1000


@pytest.mark.usefixtures("executor")
def test_memory_and_priority_that_requests_may_take(graph: Any) -> None:
    before = names(graph)
    ring = "{{kind: ring_buffer, type: {}, capacity: {}}}"
    for kind, value, words in (
        ("add_resource", ring.format("std_msgs/msg/String", 1_000_000), "max_requested_bytes"),
        ("add_resource", ring.format("std_msgs/msg/Float64", 1_000_000).replace("}", ", max_bytes: 8}"), ""),
        ("add_component", COUNTER % "stack_bytes: 1073741824", "max_requested_bytes"),
        ("add_component", COUNTER % "trace_records: 1048576, stack_bytes: 30000000", "max_requested_bytes"),
        ("add_component", COUNTER % "priority: 81", "max_requested_priority"),
        ("add_component", COUNTER % "priority: 80", ""),
    ):
        for dry_run in (True, False):
            reply = reconfigure(graph, (kind, "late", value), dry_run=dry_run)
            assert reply.success == (not words), reply.message
            assert words in reply.message
        if words:
            assert (reply.code, names(graph)) == (Code.INVALID, before)
        else:
            assert reconfigure(graph, (kind.replace("add", "remove"), "late", "")).success


@pytest.mark.usefixtures("executor")
def test_memory_counts_until_it_is_removed(graph: Any) -> None:
    half = "{kind: ring_buffer, type: std_msgs/msg/String, capacity: 700}"  # of 65,536 bytes
    assert reconfigure(graph, ("add_resource", "first", half)).success
    refused = reconfigure(graph, ("add_resource", "second", half))
    assert refused.message.startswith(
        "'second' needs more memory than requests may take: expected at most 21,"
    )
    both = [("remove_resource", "first", ""), ("add_resource", "second", half)]
    assert reconfigure(graph, *both).success


def test_limits_are_parameters(start_executor: Callable[..., Any], architecture: Path, graph: Any) -> None:
    arguments = ("-p", f"architecture:={architecture}", "-p", "max_request_bytes:=100")
    start_executor(*arguments, "-p", "max_requested_bytes:=1000", "-p", "max_requested_priority:=10")
    reply = reconfigure(graph, ("add_component", "late", COUNTER % "priority: 11"))
    assert "expected at most 100 bytes, found 1" in reply.message
    short = "{kind: ring_buffer, type: std_msgs/msg/Float64, capacity: 1"
    refused = reconfigure(graph, ("add_resource", "a", short + "000}"), request_id="1")
    assert "expected at most 1,000 bytes, found 8,000" in refused.message
    assert reconfigure(graph, ("add_resource", "a", short + "00}"), request_id="2").success


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("max_request_bytes:=0", "max_request_bytes: expected a whole number of at least 1, found 0"),
        ("max_requested_priority:=99", "expected a whole number of at least 1 and at most 98, found 99"),
        ("max_requested_bytes:=many", "max_requested_bytes"),
    ],
)
def test_bad_limits_start_nothing(
    start_executor: Callable[..., Any], architecture: Path, setting: str, words: str
) -> None:
    executor = start_executor("-p", f"architecture:={architecture}", "-p", setting)
    assert executor.wait() == 2
    assert words in executor.output


@pytest.mark.usefixtures("executor")
def test_a_hundred_long_steps_are_refused_and_thousands_of_wrong_keys_told_in_short(graph: Any) -> None:
    cpus = COUNTER % f"cpus: [{', '.join(['0'] * 6000)}]"
    steps = [("add_component", f"late{number}", cpus) for number in range(100)]
    reply = reconfigure(graph, *steps, dry_run=True)
    assert (reply.success, "max_request_bytes" in reply.message) == (False, True)
    wrong = COUNTER % ", ".join(f"k{number}: 0" for number in range(1500))
    reply = reconfigure(graph, ("add_component", "late", wrong), dry_run=True)
    assert reply.message.endswith("; and 1,490 more")
    assert len(reply.message) < 4001
    assert graph.ask(Stop, f"{NODE}/stop", component="sleepy").success
