"""Bags begun and ended while the executor runs, by service; and what is refused."""

import json
import os
import resource
import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bag_kills import has_ended
from bag_rules import assert_rosbag2_reads
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from mcap.reader import make_reader
from preloaded import shared_library
from rclpy.qos import QoSProfile, ReliabilityPolicy
from ros_processes import ExecutorProcess
from rosbags.highlevel import AnyReader
from std_msgs.msg import Float64, UInt8MultiArray, UInt64

import mauve_rt.trace
from mauve_msgs.msg import ReconfigurationStep, ReplyCode
from mauve_msgs.srv import Reconfigure, ReplaceCore, StartRecording, StopRecording, WriteSnapshot
from mauve_rt.trace.bag.repair import examine_bag
from mauve_rt.trace.reading.check import check_bag
from mauve_rt.trace.reading.reconfigurations import reconfigurations
from mauve_rt.trace.reading.statistics import component_statistics
from mauve_rt.trace.recording.ledger import LEDGER, ledger_of

EXECUTOR = "/robot_1/executor"
Starter = Callable[..., ExecutorProcess]
ROOM = 60_000  # bytes: the definitions of messages take a half, then come records
MORE = 4_000  # bytes: room for some more of them


@pytest.fixture
def executor(architecture: Path, start_executor: Starter, graph: Any, tmp_path: Path) -> ExecutorProcess:
    made = start_executor("-p", f"architecture:={architecture}", "-p", f"bags:={tmp_path}")
    counts = graph.hear(Float64, "/robot_1/count")
    graph.spin_until(lambda: len(counts) > 2, "the components to run")
    return made


def start(graph: Any, **fields: Any) -> Any:
    return graph.ask(StartRecording, f"{EXECUTOR}/start_recording", **fields)


def stop(graph: Any) -> Any:
    return graph.ask(StopRecording, f"{EXECUTOR}/stop_recording")


def snapshot(graph: Any, **fields: Any) -> Any:
    return graph.ask(WriteSnapshot, f"{EXECUTOR}/write_snapshot", **fields)


def topics_of(bag: Path) -> dict[str, int]:
    with AnyReader([bag]) as reader:
        return {connection.topic: connection.msgcount for connection in reader.connections}


def test_a_bag_begun_and_ended_while_the_executor_runs(executor: ExecutorProcess, graph: Any, tmp_path: Path):
    voice = graph.node.create_publisher(Float64, "/robot_1/talk", 10)
    replies: list[Any] = []

    def started() -> bool:  # once the executor has discovered the publisher, and so the type
        replies.append(start(graph, bag="first", topics=["talk"], cause="to see"))
        return bool(replies[-1].success)

    graph.spin_until(started, "a recording")
    assert replies[-1].bag == str(tmp_path / "first")
    graph.spin_until(lambda: voice.get_subscription_count() > 0, "the recorder's subscription")
    events = graph.hear_events(EXECUTOR)
    again = start(graph, bag="other")
    assert (again.success, again.code) == (False, ReplyCode.ALREADY_RUNNING)
    for number in range(3):
        voice.publish(Float64(data=float(number)))
    swapped = graph.ask(
        ReplaceCore, f"{EXECUTOR}/replace_core", component="counter", core="executor_tests/Backwards"
    )
    assert swapped.success, swapped.message
    graph.spin_until(lambda: any("Backwards" in event.request for event in events), "the event")
    running = mauve_rt.trace.open(tmp_path / "first")  # while it is written
    assert running.architecture
    reply = stop(graph)
    assert reply.success, reply.message
    assert examine_bag(tmp_path / "first").is_finished
    assert_rosbag2_reads(tmp_path / "first")
    trace = mauve_rt.trace.open(tmp_path / "first")
    assert trace.lost == 0
    found = {component.name: component for component in trace.architecture}
    assert found["counter"].core == "executor_tests/Backwards"
    assert ("count", "write", "count") in [(p.name, p.kind, p.resource) for p in found["counter"].ports]
    (swap,) = reconfigurations(trace)
    assert (swap.missed_releases, swap.phase_nominal_ns) == (0, 0)  # the grid is older than the bag
    statistics = component_statistics(trace, "counter")
    assert statistics.phase_error.count == statistics.releases > 0
    topics = topics_of(tmp_path / "first")
    assert topics["/robot_1/talk"] > 0
    assert topics["/robot_1/count"] > 0
    assert topics[f"{EXECUTOR}/events"] >= 1
    assert {message.msg.request for message in trace.messages(f"{EXECUTOR}/events")} >= {
        "start_recording first talk",
        "replace_core counter executor_tests/Backwards",
    }


def children_of(executor: ExecutorProcess) -> list[int]:
    """The processes that the executor has started and that have not been waited for."""
    threads = Path(f"/proc/{executor.process.pid}/task").glob("*/children")
    return [int(child) for file in threads for child in file.read_text("utf-8").split()]


def test_a_keeper_writes_the_bag(executor: ExecutorProcess, graph: Any, tmp_path: Path):
    def keepers() -> list[str]:
        names = [Path(f"/proc/{child}/comm").read_text("utf-8").strip() for child in children_of(executor)]
        return [name for name in names if name]

    assert keepers() == []
    assert start(graph, bag="kept").success
    assert keepers() == ["bag_keeper"]
    assert stop(graph).success
    assert keepers() == []
    assert not [finding for finding in check_bag(tmp_path / "kept") if finding.is_wrong]
    assert "tear the bag" not in executor.output, "it never fell back on its own writes"


def test_a_bag_of_limited_size_keeps_the_newest_files(
    architecture: Path, start_executor: Starter, graph: Any, tmp_path: Path
):
    bag = tmp_path / "bag"
    settings = ("bag_split_bytes:=20000", "bag_max_size_bytes:=60000", f"bag:={bag}")
    arguments = [word for setting in settings for word in ("-p", setting)]
    executor = start_executor("-p", f"architecture:={architecture}", *arguments)
    counts = graph.hear(Float64, "/robot_1/count")
    graph.spin_until(lambda: len(counts) > 2, "the components to run")
    newest = lambda: max((int(file.stem.split("_")[1]) for file in bag.glob("*.mcap")), default=0)  # noqa: E731
    graph.spin_until(lambda: newest() > 5 and not (bag / "bag_0.mcap").exists(), "deletions")
    executor.end(signal.SIGTERM)
    (deleted,) = mauve_rt.trace.open(bag).deleted
    assert deleted.files > 2
    assert deleted.records > 0
    assert not [finding for finding in check_bag(bag) if finding.kind != "note"]
    assert_rosbag2_reads(bag)


def test_a_bag_is_compressed_on_request(executor: ExecutorProcess, graph: Any, tmp_path: Path):
    assert start(graph, bag="bag", compression="zstd").success
    counts = graph.hear(Float64, "/robot_1/count")
    graph.spin_until(lambda: len(counts) > 20, "counts")
    assert stop(graph).success
    assert_rosbag2_reads(tmp_path / "bag")
    with (tmp_path / "bag" / "bag_0.mcap").open("rb") as stream:
        assert "zstd" in {chunk.compression for chunk in make_reader(stream).get_summary().chunk_indexes}
    assert check_bag(tmp_path / "bag") == []


def test_limits_that_do_not_fit_are_refused(architecture: Path, start_executor: Starter, tmp_path: Path):
    settings = ("bag_split_bytes:=20000", "bag_max_size_bytes:=30000", f"bag:={tmp_path / 'bag'}")
    arguments = [word for setting in settings for word in ("-p", setting)]
    executor = start_executor("-p", f"architecture:={architecture}", *arguments)
    executor.await_output(
        "parameter bag_max_size_bytes: expected at least twice the size of a file, 40,000 bytes"
    )
    assert not (tmp_path / "bag").exists()


def test_one_bag_after_the_other(executor: ExecutorProcess, graph: Any):
    bags = []
    for _ in range(2):
        reply = start(graph, bag=f"bags/number_{len(bags)}")
        assert reply.success, reply.message
        bags.append(Path(reply.bag))
        counts = graph.hear(Float64, "/robot_1/count")
        graph.spin_until(lambda: len(counts) > 5, "counts")  # noqa: B023 - called at once
        assert stop(graph).success
    for bag in bags:
        assert_rosbag2_reads(bag)
        trace = mauve_rt.trace.open(bag)
        assert trace.lost == 0
        assert component_statistics(trace, "counter").releases > 3
        assert topics_of(bag)["/robot_1/count"] > 3
    assert start(graph).bag.startswith(str(bags[0].parents[1] / "mauve_20"))


REFUSED = [
    ({"bag": "../outside"}, "INVALID", "expected a folder below"),
    ({"bag": "/outside"}, "INVALID", "expected a folder below"),
    ({"bag": "."}, "INVALID", "expected a folder below"),
    ({"bag": "x" * 2000}, "INVALID", "no text longer than"),
    ({"bag": "x" * 500}, "PREPARE_FAILED", "cannot be created (File name too long)"),
    ({"bag": "there"}, "PREPARE_FAILED", "exists already"),
    ({"topics": ["nobody_knows"]}, "INVALID", "used by nobody now; give its type"),
    ({"topics": ["talk:std_msgs/msg/Flaot64"]}, "INVALID", "found 'talk:std_msgs/msg/Flaot64'"),
    ({"topics": ["talk:std_msgs/msg/Float64:wrong"]}, "INVALID", "found 'talk:std_msgs/msg/Float64:wrong'"),
    (
        {"topics": ["count:std_msgs/msg/String"]},
        "INVALID",
        "as std_msgs/msg/Float64, found std_msgs/msg/String",
    ),
    (
        {"topics": [f"{EXECUTOR}/decisions:std_msgs/msg/String"]},
        "INVALID",
        "used as mauve_msgs/msg/SupervisorDecision, found std_msgs/msg/String",
    ),
    (
        {"topics": ["x:std_msgs/msg/String", "x:std_msgs/msg/Bool"]},
        "INVALID",
        "/robot_1/x to record: named twice",
    ),
    ({"topics": ["a b"]}, "INVALID", "'a b'"),
    ({"topics": [""]}, "INVALID", "expected a name, found ''"),
    ({"topics": ["camera/*"]}, "INVALID", "expected /NAME, /NAME:package/msg/Type of an installed message"),
    ({"topics": ["/camera/*:std_msgs/msg/Imgae"]}, "INVALID", "found '/camera/*:std_msgs/msg/Imgae'"),
    ({"topics": ["/camera/*:std_msgs/msg/Float64:wrong"]}, "INVALID", "pattern of topics to record"),
    (
        {"topic_regexes": ["("]},
        "INVALID",
        "expected a regular expression, found '(': missing ), unterminated subpattern at position 0",
    ),
    ({"split_s": 0.1}, "INVALID", "bad split_s: expected 0 (the default) or 1 to 1e+06 s, found 0.1"),
    ({"split_s": float("nan")}, "INVALID", "bad split_s"),
    ({"split_bytes": 5}, "INVALID", "bad split_bytes"),
    ({"compression": "lz4"}, "INVALID", "bad compression: expected none or zstd, found 'lz4'"),
    ({"max_size_bytes": 399_999}, "INVALID", "bad max_size_bytes: expected 0 (no limit) or at least 400,000"),
    (
        {"split_bytes": 200_000, "max_size_bytes": 399_999},
        "INVALID",
        "expected at least twice the size of a file, 400,000 bytes, found 399,999",
    ),
    ({"expected_revision": 1000}, "WRONG_REVISION", "expected 1000"),
]


def test_what_is_refused_starts_nothing(executor: ExecutorProcess, graph: Any, tmp_path: Path):
    (tmp_path / "there").mkdir()
    for fields, code, message in REFUSED:
        reply = start(graph, **{"bag": "new", **fields})
        assert not reply.success, fields
        assert reply.code == getattr(ReplyCode, code), reply.message
        assert message in reply.message
        assert not (tmp_path / "new").exists()
    stopped = stop(graph)
    assert (stopped.success, stopped.code) == (False, ReplyCode.NOT_RUNNING)


def test_a_full_disk_ends_the_recording_with_a_diagnostic(
    executor: ExecutorProcess, graph: Any, tmp_path: Path
):
    assert start(graph, bag="bag").success
    (file,) = (tmp_path / "bag").glob("*.mcap")
    graph.spin_until(lambda: file.stat().st_size > ROOM, "records on the disk")
    _, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    limit = file.stat().st_size + MORE
    (keeper,) = children_of(executor)  # it writes the file
    for process in (executor.process.pid, keeper):
        resource.prlimit(process, resource.RLIMIT_FSIZE, (limit, hard))
    told: list[Any] = graph.hear(DiagnosticArray, "/diagnostics")

    def failed() -> bool:
        statuses = [status for array in told for status in array.status if "recording" in status.name]
        return any(
            one.level == DiagnosticStatus.ERROR and "File too large" in one.message for one in statuses
        )

    graph.spin_until(failed, "the diagnostic")
    counts = graph.hear(Float64, "/robot_1/count")
    graph.spin_until(lambda: len(counts) > 5, "counts of an executor that goes on")
    reply = stop(graph)
    assert reply.success
    assert "it had ended by itself: recording stopped" in reply.message
    (told,) = [finding for finding in check_bag(tmp_path / "bag") if "ended by itself" in finding.text]
    assert told.is_loss
    assert "File too large" in told.text
    assert examine_bag(tmp_path / "bag").is_finished
    assert_rosbag2_reads(tmp_path / "bag")
    assert len(mauve_rt.trace.open(tmp_path / "bag").of("counter")) > 0


def test_a_recording_pauses_where_the_setting_says_so(
    architecture: Path, start_executor: Starter, graph: Any, tmp_path: Path
):
    arguments = ("-p", f"architecture:={architecture}", "-p", f"bags:={tmp_path}")
    executor = start_executor(*arguments, "-p", "bag_waits_for_room:=true")
    counts = graph.hear(Float64, "/robot_1/count")
    graph.spin_until(lambda: len(counts) > 2, "the components to run")
    assert start(graph, bag="bag").success
    (file,) = (tmp_path / "bag").glob("*.mcap")
    graph.spin_until(lambda: file.stat().st_size > ROOM, "records on the disk")
    _, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    (keeper,) = children_of(executor)
    resource.prlimit(keeper, resource.RLIMIT_FSIZE, (file.stat().st_size + MORE, hard))
    told = "recording paused until the disk has room again"
    graph.spin_until(lambda: told in executor.output, "the pause")
    graph.spin_until(lambda: "recording goes on after" in executor.output, "the recording to go on")
    reply = stop(graph)
    assert reply.success, reply.message
    assert "dropped" in reply.message
    findings = check_bag(tmp_path / "bag")
    assert any("the recording paused for" in finding.text and finding.is_loss for finding in findings)
    assert not [finding for finding in findings if finding.is_damage]
    assert_rosbag2_reads(tmp_path / "bag")


def counts_of(bag: Path) -> list[float]:
    return [message.msg.data for message in mauve_rt.trace.open(bag).messages("/robot_1/count")]


def test_a_disk_that_hangs_at_a_stop_harms_no_later_recording(
    executor: ExecutorProcess, graph: Any, tmp_path: Path
):
    assert start(graph, bag="slow").success
    counts = graph.hear(Float64, "/robot_1/count")
    graph.spin_until(lambda: len(counts) > 5, "counts for the first bag")
    (keeper,) = children_of(executor)
    os.kill(keeper, signal.SIGSTOP)
    try:
        reply = stop(graph)
        assert (reply.success, reply.code) == (False, ReplyCode.TIMEOUT)
        assert f"{tmp_path / 'slow'} is not complete" in reply.message
        assert reply.bag == str(tmp_path / "slow")
        assert start(graph, bag="next").success
        counts = graph.hear(Float64, "/robot_1/count")
        graph.spin_until(lambda: len(counts) > 5, "counts while the first disk hangs")
    finally:
        os.kill(keeper, signal.SIGCONT)
    graph.spin_until(lambda: keeper not in children_of(executor) or has_ended(keeper), "the first bag's end")
    counts = graph.hear(Float64, "/robot_1/count")
    graph.spin_until(lambda: len(counts) > 5, "counts after the first bag's end")
    assert stop(graph).success
    for name in ("slow", "next"):
        assert check_bag(tmp_path / name) == []
    assert counts_of(tmp_path / "next")[-1] >= counts[-1].data
    numbers = counts_of(tmp_path / "next")
    assert len(numbers) == abs(numbers[-1] - numbers[0]) + 1, "none is missing in between"


HANGING_MKDIR = r"""
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

int mkdir(const char* path, mode_t mode) {
  int (*next)(const char*, mode_t) = (int (*)(const char*, mode_t))dlsym(RTLD_NEXT, "mkdir");
  if (strstr(path, "hanging") != NULL) {
    int (*begun)(const char*, mode_t) = next;
    begun(getenv("MKDIR_HANGS"), 0777);
    while (access(getenv("MKDIR_GOES_ON"), F_OK) != 0) usleep(10000);
  }
  return next(path, mode);
}
"""


def test_no_request_waits_for_a_disk_on_which_a_bag_is_made(
    architecture: Path, start_executor: Starter, graph: Any, tmp_path: Path
):
    hangs, goes_on = tmp_path / "hangs", tmp_path / "goes_on"
    preloaded = shared_library(tmp_path / "mkdir.c", HANGING_MKDIR)
    environment = {"LD_PRELOAD": preloaded, "MKDIR_HANGS": str(hangs), "MKDIR_GOES_ON": str(goes_on)}
    executor = start_executor(
        "-p", f"architecture:={architecture}", "-p", f"bags:={tmp_path}", environment=environment
    )
    counts = graph.hear(Float64, "/robot_1/count")
    graph.spin_until(lambda: len(counts) > 2, "the components to run")
    client = graph.node.create_client(StartRecording, f"{EXECUTOR}/start_recording")
    graph.spin_until(client.service_is_ready, "the service")
    for bag in ("hanging_1", "hanging_2"):
        is_called_off = bag == "hanging_2"
        answer = client.call_async(StartRecording.Request(bag=bag))
        graph.spin_until(hangs.exists, "the disk to hang")
        core = "executor_tests/Counter" if is_called_off else "executor_tests/Backwards"
        reply = graph.ask(ReplaceCore, f"{EXECUTOR}/replace_core", component="counter", core=core)
        assert reply.success, reply.message
        again = start(graph, bag="other")
        assert (again.success, again.code) == (False, ReplyCode.ALREADY_RUNNING)
        assert "its disk has not answered yet" in again.message
        if is_called_off:
            assert stop(graph).code == ReplyCode.NOT_RUNNING
        assert not answer.done()
        goes_on.touch()
        graph.spin_until(answer.done, "the answer of the disk")
        if is_called_off:
            assert answer.result().code == ReplyCode.PREPARE_FAILED
            assert "a stop called its recording off" in answer.result().message
            assert stop(graph).code == ReplyCode.NOT_RUNNING
        else:
            assert answer.result().success, answer.result().message
            assert stop(graph).success
        hangs.rmdir()
        goes_on.unlink()
        assert examine_bag(tmp_path / bag).is_finished
    assert "Traceback" not in executor.output


def test_the_last_seconds_are_written_on_request(executor: ExecutorProcess, graph: Any, tmp_path: Path):
    voice = graph.node.create_publisher(Float64, "/robot_1/talk", 10)
    reply = start(graph, snapshot_s=1.5, topics=["/robot_1/talk:std_msgs/msg/Float64"])
    assert reply.success, reply.message
    assert f"the last 1.5 s, 268,435,456 bytes at most; snapshots are created in {tmp_path}" in reply.message
    graph.spin_until(lambda: voice.get_subscription_count() > 0, "the recorder's subscription")
    begin_s = time.monotonic()
    graph.spin_until(lambda: time.monotonic() - begin_s > 2.0, "more than the window")
    events = graph.hear_events(EXECUTOR)
    first = snapshot(graph, bag="first", cause="it shook")
    assert first.success, first.message
    assert first.bag == str(tmp_path / "first")
    assert f"messages are in {tmp_path / 'first'}: snapshot of " in first.message
    again = snapshot(graph, bag="first")
    assert (again.success, again.code) == (False, ReplyCode.PREPARE_FAILED)
    assert "exists already" in again.message
    outside = snapshot(graph, bag="../elsewhere")
    assert (outside.success, outside.code) == (False, ReplyCode.INVALID)
    by_time: list[Any] = []

    def has_message() -> bool:
        voice.publish(Float64(data=7.0))
        by_time.append(snapshot(graph))
        assert by_time[-1].success, by_time[-1].message
        return "/robot_1/talk" in topics_of(Path(by_time[-1].bag))

    graph.spin_until(has_message, "a message of another node in a snapshot")
    assert Path(by_time[-1].bag).name.startswith("snapshot_2")
    graph.spin_until(lambda: any("write_snapshot first" in each.request for each in events), "the event")
    stopped = stop(graph)
    assert stopped.success, stopped.message
    assert "the recording into memory has ended" in stopped.message
    assert len(list(tmp_path.glob("*/metadata.yaml"))) == 1 + len(by_time)
    assert snapshot(graph).code == ReplyCode.NOT_RUNNING
    for bag in (tmp_path / "first", Path(by_time[-1].bag)):
        assert not [finding for finding in check_bag(bag) if finding.kind != "note"]
        assert_rosbag2_reads(bag)
        trace = mauve_rt.trace.open(bag)
        assert trace.lost == 0
        assert {one.name for one in trace.architecture} >= {"counter"}
        held_ns = np.ptp(trace.of("counter")["time_ns"])
        assert held_ns > 1e9
    numbers = counts_of(tmp_path / "first")
    assert len(numbers) == abs(numbers[-1] - numbers[0]) + 1, "none is missing in between"
    assert start(graph, bag="bag").success
    refused = snapshot(graph)
    assert (refused.success, refused.code) == (False, ReplyCode.NOT_RUNNING)
    assert "the recording writes a bag" in refused.message
    assert stop(graph).success


def test_snapshots_by_the_parameters_of_the_executor(
    architecture: Path, start_executor: Starter, graph: Any, tmp_path: Path
):
    folder = tmp_path / "kept"
    settings = ("bag_snapshot_s:=60.0", "bag_snapshot_bytes:=100000", f"bag:={folder}")
    arguments = [word for setting in settings for word in ("-p", setting)]
    executor = start_executor("-p", f"architecture:={architecture}", *arguments)
    counts = graph.hear(Float64, "/robot_1/count")
    graph.spin_until(lambda: len(counts) > 2, "the components to run")
    replies: list[Any] = []

    def is_short() -> bool:
        replies.append(snapshot(graph))
        return "holds no more of 60 s" in str(replies[-1].message)

    graph.spin_until(is_short, "a full memory")
    assert replies[-1].success
    assert Path(replies[-1].bag).parent == folder
    assert sum(file.stat().st_size for file in Path(replies[-1].bag).glob("*.mcap")) < 400_000
    texts = [finding.text for finding in check_bag(Path(replies[-1].bag))]
    assert [text for text in texts if "snapshot_bytes, 100,000" in text]
    executor.end(signal.SIGTERM)
    assert "Traceback" not in executor.output


def test_a_disk_that_hangs_at_a_snapshot_holds_up_its_reply_only(
    architecture: Path, start_executor: Starter, graph: Any, tmp_path: Path
):
    hangs, goes_on = tmp_path / "hangs", tmp_path / "goes_on"
    preloaded = shared_library(tmp_path / "mkdir.c", HANGING_MKDIR)
    environment = {"LD_PRELOAD": preloaded, "MKDIR_HANGS": str(hangs), "MKDIR_GOES_ON": str(goes_on)}
    start_executor("-p", f"architecture:={architecture}", "-p", f"bags:={tmp_path}", environment=environment)
    counts = graph.hear(Float64, "/robot_1/count")
    graph.spin_until(lambda: len(counts) > 2, "the components to run")
    assert start(graph, snapshot_s=5.0).success
    client = graph.node.create_client(WriteSnapshot, f"{EXECUTOR}/write_snapshot")
    graph.spin_until(client.service_is_ready, "the service")
    answer = client.call_async(WriteSnapshot.Request(bag="hanging"))
    graph.spin_until(hangs.exists, "the disk to hang")
    reply = graph.ask(
        ReplaceCore, f"{EXECUTOR}/replace_core", component="counter", core="executor_tests/Backwards"
    )
    assert reply.success, reply.message
    busy = snapshot(graph, bag="other")
    assert (busy.success, busy.code) == (False, ReplyCode.ALREADY_RUNNING)
    graph.spin_until(answer.done, "the reply")
    assert answer.result().code == ReplyCode.TIMEOUT
    assert "is still being written after 2 s" in answer.result().message
    goes_on.touch()
    bag = tmp_path / "hanging"
    graph.spin_until(lambda: snapshot(graph, bag="other").success, "the end of the first snapshot")
    assert not [finding for finding in check_bag(bag) if finding.kind != "note"]
    assert stop(graph).success


def test_each_message_is_recorded_once(executor: ExecutorProcess, graph: Any, tmp_path: Path):
    voice = graph.node.create_publisher(Float64, "/robot_1/talk", 10)
    named = ["talk:std_msgs/msg/Float64", "/robot_1/talk:std_msgs/msg/Float64", "count", f"{EXECUTOR}/events"]
    reply = start(graph, bag="bag", topics=named)
    assert reply.success, reply.message
    graph.spin_until(lambda: voice.get_subscription_count() == 1, "one subscription")
    counts = graph.hear(Float64, "/robot_1/count")
    for number in range(20):
        voice.publish(Float64(data=float(number)))
    graph.spin_until(lambda: len(counts) > 20, "counts")
    assert stop(graph).success
    trace = mauve_rt.trace.open(tmp_path / "bag")
    heard = {
        topic: [message.msg.data for message in trace.messages(topic)]
        for topic in ("/robot_1/talk", "/robot_1/count")
    }
    assert heard["/robot_1/talk"] == [float(number) for number in range(20)]
    assert len(heard["/robot_1/count"]) == len({*heard["/robot_1/count"]}) > 10
    (note,) = check_bag(tmp_path / "bag")
    assert (note.kind, note.text.partition(":")[0]) == ("note", "/robot_1/talk"), "nothing of the executor"
    assert "no gap between the first and the last message of each writer" in note.text
    ledger = json.loads(examine_bag(tmp_path / "bag").custom_data[LEDGER])
    others = {"lost_before": 0, "numbered": True, "deleted": 0}
    assert ledger["/robot_1/talk"] == {"received": 20, "lost": 0, "repeated": 0, **others}
    assert ledger["/robot_1/count"]["numbered"] is None
    with (tmp_path / "bag" / "bag_0.mcap").open("rb") as stream:
        (told,) = make_reader(stream).iter_metadata()
    assert json.loads(told.metadata[LEDGER]) == ledger, "the file by itself tells it, too"


def numbers_of(bag: Path, topic: str) -> list[int]:
    return [int(message.msg.data) for message in mauve_rt.trace.open(bag).messages(topic)]


def test_a_burst_of_others_is_in_the_bag_or_counted(
    executor: ExecutorProcess, graph: Any, tmp_path: Path
) -> None:
    assert start(graph, bag="bag", topics=["/burst:std_msgs/msg/UInt64"]).success
    voice = graph.voice(UInt64, "/burst", QoSProfile(depth=1000))
    for number in range(3000):
        voice.publish(UInt64(data=number))
        time.sleep(0.001)
    assert stop(graph).success
    numbers = numbers_of(tmp_path / "bag", "/burst")
    entry = ledger_of(examine_bag(tmp_path / "bag").custom_data)["/burst"]
    assert (entry.lost, entry.numbered) == (0, True)
    assert entry.received == len(numbers)
    assert entry.received + entry.lost_before == numbers[-1] - numbers[0] + 1
    kinds = {finding.kind for finding in check_bag(tmp_path / "bag") if "/burst" in finding.text}
    assert kinds == {"loss" if entry.lost_before else "note"}
    assert_rosbag2_reads(tmp_path / "bag")


def test_a_topic_to_which_a_resource_is_bound_later_is_recorded_once(
    executor: ExecutorProcess, graph: Any, tmp_path: Path
) -> None:
    assert start(graph, bag="bag", topics=["/later:std_msgs/msg/Float64:reliable"]).success
    voice = graph.voice(Float64, "/later")
    voice.publish(Float64(data=0.0))
    graph.spin_until(voice.wait_for_all_acked, "the message to arrive")
    text = "{kind: shared_data, type: std_msgs/msg/Float64, topic: {name: /later, direction: subscribe}}"
    step = ReconfigurationStep(kind="add_resource", target="later", value=text)
    added = graph.ask(Reconfigure, f"{EXECUTOR}/reconfigure", steps=[step])
    assert added.success, added.message
    graph.spin_until(lambda: voice.get_subscription_count() == 2, "the subscription of the resource")
    time.sleep(1.0)  # flushes: from the first one on the recorder ignores the topic
    for number in range(1, 11):
        voice.publish(Float64(data=float(number)))
    graph.spin_until(voice.wait_for_all_acked, "the messages to arrive")
    assert stop(graph).success
    assert numbers_of(tmp_path / "bag", "/later") == [*range(11)]
    entry = ledger_of(examine_bag(tmp_path / "bag").custom_data)["/later"]
    assert (entry.received, entry.lost) == (11, 0)


def test_messages_beyond_the_queue_of_the_recorder_are_lost_and_counted(
    architecture: Path, start_executor: Starter, graph: Any, tmp_path: Path
) -> None:
    words = (f"architecture:={architecture}", f"bags:={tmp_path}", "record_queue_bytes:=1000000")
    start_executor(*(word for given in words for word in ("-p", given)))
    topic = "/large:std_msgs/msg/UInt8MultiArray:reliable"
    reply = start(graph, bag="bag", topics=[topic])
    assert reply.success, reply.message
    voice = graph.voice(UInt8MultiArray, "/large")
    voice.publish(UInt8MultiArray(data=bytes(2_000_000)))
    graph.spin_until(voice.wait_for_all_acked, "the message to arrive")
    reply = stop(graph)
    assert "; 1 were dropped" in reply.message
    entry = ledger_of(examine_bag(tmp_path / "bag").custom_data)["/large"]
    assert (entry.received, entry.lost, entry.lost_before) == (1, 1, 0)
    losses = [finding.text for finding in check_bag(tmp_path / "bag") if finding.is_loss]
    assert losses == ["topic /large: 1 of 1 messages that came are not in the bag"]


def test_messages_lost_before_the_recorder_are_reported_everywhere(
    executor: ExecutorProcess, graph: Any, tmp_path: Path
) -> None:
    reply = start(graph, bag="bag", topics=["/burst:std_msgs/msg/UInt8MultiArray"])
    assert reply.success, reply.message
    told: list[Any] = graph.hear(DiagnosticArray, "/diagnostics")
    quality = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
    voice = graph.voice(UInt8MultiArray, "/burst", quality)

    def values(name: str) -> list[str]:
        statuses = [one for array in told for one in array.status if one.name.endswith("recording")]
        return [value.value for one in statuses for value in one.values if value.key == name]

    def received() -> bool:
        voice.publish(UInt8MultiArray(data=bytes(1000)))
        return int((values("received[/burst]") or ["0"])[-1]) > 0

    graph.spin_until(received, "a first message")
    executor.process.send_signal(signal.SIGSTOP)
    for _ in range(5000):  # more than the middleware keeps of a process that does not run
        voice.publish(UInt8MultiArray(data=bytes(1000)))
    executor.process.send_signal(signal.SIGCONT)

    def lost() -> bool:
        voice.publish(UInt8MultiArray(data=bytes(1000)))
        return int(values("lost_before[/burst]")[-1]) > 0

    graph.spin_until(lost, "the loss on /diagnostics")
    words = "messages of other nodes lost before the recorder received them since the last status"
    assert any(words in status.message for array in told for status in array.status)
    assert "of other nodes were lost before they came here" in stop(graph).message
    losses = [finding.text for finding in check_bag(tmp_path / "bag") if finding.is_loss]
    assert any(text.startswith("topic /burst: ") and "lost before the recorder" in text for text in losses)


@pytest.mark.parametrize("fields", [{"topics": ["/camera/*"]}, {"topic_regexes": ["^/camera/"]}])
def test_topics_by_pattern_are_recorded_also_those_that_appear_later(
    executor: ExecutorProcess, graph: Any, tmp_path: Path, fields: dict[str, list[str]]
) -> None:
    graph.node.create_publisher(UInt64, "/elsewhere", 10)
    left = graph.node.create_publisher(UInt64, "/camera/left", 100)
    reply = start(graph, bag="bag", **fields)
    assert reply.success, reply.message
    told: list[Any] = graph.hear(DiagnosticArray, "/diagnostics")

    def received(topic: str) -> int:
        key = f"received[{topic}]"
        all_values = [value for array in told for one in array.status for value in one.values]
        return max((int(value.value) for value in all_values if value.key == key), default=0)

    def is_received(voice: Any, topic: str) -> bool:
        voice.publish(UInt64(data=1))
        return received(topic) > 2

    graph.spin_until(lambda: is_received(left, "/camera/left"), "a topic that was there")
    right = graph.node.create_publisher(UInt64, "/camera/right/raw", 100)
    graph.spin_until(lambda: is_received(right, "/camera/right/raw"), "a topic that appeared later")
    before = received("/camera/left")
    graph.spin_until(lambda: is_received(left, "/camera/left") and received("/camera/left") > before, "both")
    assert stop(graph).success
    topics = topics_of(tmp_path / "bag")
    assert topics["/camera/left"] > 2
    assert topics["/camera/right/raw"] > 2
    assert "/elsewhere" not in topics
    assert {finding.kind for finding in check_bag(tmp_path / "bag")} == {"note"}
    ledger = ledger_of(examine_bag(tmp_path / "bag").custom_data)
    assert ledger["/camera/right/raw"].received == topics["/camera/right/raw"]


def test_a_pattern_takes_nothing_twice(executor: ExecutorProcess, graph: Any, tmp_path: Path) -> None:
    assert start(graph, bag="bag", topics=["/*"], topic_regexes=["."]).success
    counts = graph.hear(Float64, "/robot_1/count")
    graph.spin_until(lambda: len(counts) > 20, "counts")
    assert stop(graph).success
    trace = mauve_rt.trace.open(tmp_path / "bag")
    numbers = [message.msg.data for message in trace.messages("/robot_1/count")]
    assert len(numbers) == len(set(numbers)) > 10
    ledger = ledger_of(examine_bag(tmp_path / "bag").custom_data)
    others = {topic for topic, entry in ledger.items() if entry.numbered is not None}
    assert "/robot_1/count" not in others
    assert not [topic for topic in others if topic.startswith((f"{EXECUTOR}/state", f"{EXECUTOR}/trace"))]
    assert not [finding for finding in check_bag(tmp_path / "bag") if finding.kind != "note"]


def test_another_type_on_a_topic_to_record_is_told(executor: ExecutorProcess, graph: Any):
    assert start(graph, bag="bag", topics=["later:std_msgs/msg/String"]).success
    graph.node.create_publisher(Float64, "/robot_1/later", 10)
    said = "topic /robot_1/later to record: other nodes use std_msgs/msg/Float64 on it, and none of that is"
    graph.spin_until(lambda: said in executor.output, "the warning")
    assert stop(graph).success


@pytest.fixture
def trap(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the module that leaves a trace when it is imported leave it as `imported`."""
    monkeypatch.setenv("EXECUTOR_TESTS_TRAP", str(tmp_path / "imported"))


@pytest.mark.parametrize(
    "type_name",
    ["executor_tests_trap/msg/X", "../executor_tests_trap/msg/X", "executor_tests_trap.msg/msg/X", "X" * 900],
)
@pytest.mark.usefixtures("trap", "executor")
def test_a_type_that_no_package_lists_is_refused_and_not_imported(
    graph: Any, tmp_path: Path, type_name: str
) -> None:
    reply = start(graph, bag="first", topics=[f"/x:{type_name}"])
    assert (reply.success, reply.code) == (False, ReplyCode.INVALID)
    assert "of an installed message" in reply.message
    resource_text = f"{{kind: shared_data, type: {type_name}, topic: {{name: x, direction: publish}}}}"
    step = ReconfigurationStep(kind="add_resource", target="x", value=resource_text)
    added = graph.ask(Reconfigure, f"{EXECUTOR}/reconfigure", steps=[step])
    assert (added.success, added.code) == (False, ReplyCode.INVALID)
    assert not (tmp_path / "imported").exists()
    assert not (tmp_path / "first").exists()
