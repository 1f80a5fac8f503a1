"""The recorder: what it is given is in the bag, on one time base; nothing it meets harms the executor."""

import json
import resource
import shutil
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml
from waiting import wait_until

from mauve_rt.trace import TraceError
from mauve_rt.trace.bag.recorded import Split, TopicQos
from mauve_rt.trace.bag.repair import examine_bag
from mauve_rt.trace.format.records import Kind
from mauve_rt.trace.reading.check import check_bag
from mauve_rt.trace.reading.reader import open_trace
from mauve_rt.trace.recording.ledger import LEDGER, Entry
from mauve_rt.trace.recording.recorder import DROPPED_MESSAGES, Recorder
from mauve_rt.trace.recording.synthetic import SyntheticSource
from mauve_rt.trace.recording.trace_bag import TraceBag

NODE = "/robot_1/executor"
TEXT = "mauve_test_msgs/msg/Text"
HELLO = b"\0\1\0\0\6\0\0\0hello\0"


@pytest.fixture(autouse=True)
def installed_messages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    share = tmp_path / "prefix" / "share"
    shutil.copytree(Path(__file__).parents[3] / "mauve_msgs" / "msg", share / "mauve_msgs" / "msg")
    (share / "mauve_test_msgs" / "msg").mkdir(parents=True)
    (share / "mauve_test_msgs" / "msg" / "Text.msg").write_text("string data\n")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "prefix"))


@pytest.fixture
def source() -> SyntheticSource:
    return SyntheticSource(["control", "guidance"])


@pytest.fixture
def errors() -> list[str]:
    return []


@pytest.fixture
def recorder(tmp_path: Path, source: SyntheticSource, errors: list[str]) -> Iterator[Recorder]:
    made = Recorder(
        source,
        tmp_path / "bag",
        node_name=NODE,
        flush_period_s=0.02,
        queue_bytes=10_000,
        on_error=errors.append,
    )
    yield made
    made.stop()


def records_in(directory: Path, component: str) -> int:
    """How many of a component are in the bag; 0 as well while a flush is under way."""
    try:
        return len(open_trace(directory).records.get(component, ()))
    except TraceError:
        return 0


def custom_data(directory: Path) -> dict[str, str]:
    told = yaml.safe_load((directory / "metadata.yaml").read_text())
    return told["rosbag2_bagfile_information"]["custom_data"]


def test_records_and_words_are_in_the_bag(recorder: Recorder, source: SyntheticSource):
    recorder.start()
    source.cycle("control", 1000, states={"update": 5}, wait_ns=20)
    wait_until(lambda: records_in(recorder.directory, "control") == 4)
    source.cycle("guidance", 2000, states={"planning": 7}, wait_ns=100)
    recorder.stop()
    trace = open_trace(recorder.directory)
    assert trace.components == ("control", "guidance")
    assert [Kind(kind).name for kind in trace.of("guidance")["kind"]] == [
        "RELEASE", "STATE_BEGIN", "STATE_END", "WAIT",
    ]  # fmt: skip
    (begin,) = trace.of("guidance", Kind.STATE_BEGIN)
    assert trace.name(begin["name"]) == "planning"
    assert trace.lost == 0


def test_messages_lie_on_the_time_base_of_the_records(recorder: Recorder, source: SyntheticSource):
    source.now_ns = 5_000_000
    recorder.start()
    assert recorder.record("/robot_1/words", TEXT, HELLO, monotonic_ns=4_999_000)
    recorder.stop()
    (message,) = open_trace(recorder.directory).messages()
    assert (message.topic, message.msg.data) == ("/robot_1/words", "hello")
    assert message.monotonic_ns == 4_999_000, "its own time"
    at_the_flush_ns = 5_000_000 + source.realtime_offset_ns  # which may have been before it
    assert message.log_time_ns in (4_999_000 + source.realtime_offset_ns, at_the_flush_ns)


def test_messages_from_many_threads_all_arrive(recorder: Recorder):
    recorder.start()

    def send(topic: str) -> None:
        for number in range(50):
            recorder.record(topic, TEXT, HELLO, monotonic_ns=number)

    threads = [threading.Thread(target=send, args=(f"/robot_1/words_{index}",)) for index in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    recorder.stop()
    found = [message.topic for message in open_trace(recorder.directory).messages()]
    assert len(found) + recorder.dropped_messages == 200
    assert len(set(found)) == 4


def test_what_exceeds_the_queue_is_dropped_and_counted(tmp_path: Path, source: SyntheticSource):
    recorder = Recorder(source, tmp_path / "bag", node_name=NODE, flush_period_s=60, queue_bytes=40)
    recorder.start()
    wait_until(lambda: recorder.message_count)  # the first flush is immediate
    taken = [recorder.record("/w", TEXT, HELLO, monotonic_ns=0) for _ in range(5)]
    recorder.stop()
    assert taken == [True, True, False, False, False]
    assert recorder.dropped_messages == 3
    assert len(list(open_trace(recorder.directory).messages())) == 2
    assert custom_data(recorder.directory)[DROPPED_MESSAGES] == "3"


def test_a_type_that_is_not_installed_is_told_once_and_the_rest_is_recorded(
    recorder: Recorder, errors: list[str]
):
    recorder.start()
    for _ in range(3):
        recorder.record("/w", "far/msg/Away", HELLO, monotonic_ns=0)
        recorder.record("/robot_1/words", TEXT, HELLO, monotonic_ns=0)
    recorder.stop()
    assert len(errors) == 1
    assert "topic /w is not recorded: message type 'far/msg/Away'" in errors[0]
    assert recorder.dropped_messages == 3
    assert len(list(open_trace(recorder.directory).messages())) == 3


def test_a_full_disk_ends_the_recording_and_says_so_once(
    recorder: Recorder, source: SyntheticSource, errors: list[str]
):
    recorder.start()
    source.cycle("control", 1000, states={}, wait_ns=20)
    wait_until(lambda: records_in(recorder.directory, "control") == 2)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    [file] = recorder.directory.glob("*.mcap")
    resource.setrlimit(resource.RLIMIT_FSIZE, (file.stat().st_size + 4096, hard))
    try:
        for number in range(300):
            source.cycle("control", 2000 + 20 * number, states={}, wait_ns=20)
        wait_until(lambda: not recorder.recording)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert not recorder.record("/robot_1/words", TEXT, HELLO, monotonic_ns=0)
    recorder.stop()
    assert len(errors) == 1
    assert "recording stopped: bag file" in errors[0]
    assert "File too large" in errors[0]
    assert len(open_trace(recorder.directory).records["control"]) >= 2


@pytest.mark.parametrize("is_replaced", [False, True])
def test_a_file_that_was_deleted_ends_the_recording_and_is_not_counted(
    recorder: Recorder, source: SyntheticSource, errors: list[str], *, is_replaced: bool
):
    """The system goes on taking what is written to it, which nothing will ever show."""
    recorder.start()
    source.cycle("control", 1000, states={}, wait_ns=20)
    wait_until(lambda: records_in(recorder.directory, "control") == 2)
    [file] = recorder.directory.glob("*.mcap")
    file.unlink()
    if is_replaced:
        file.touch()
    source.cycle("control", 2000, states={}, wait_ns=20)
    wait_until(lambda: not recorder.recording)
    recorder.stop()
    [error] = errors
    assert f"recording stopped: bag file {file}: deleted or replaced while it was recorded" in error
    assert recorder.message_count == 0


def test_a_fault_of_the_source_ends_the_recording_only(
    recorder: Recorder, source: SyntheticSource, errors: list[str], monkeypatch: pytest.MonkeyPatch
):
    recorder.start()

    def broken() -> None:
        raise RuntimeError("no deployer")

    monkeypatch.setattr(source, "drain_trace", broken)
    wait_until(lambda: errors)
    assert errors == ["recording stopped: no deployer"]
    assert not recorder.recording
    open_trace(recorder.directory)


def test_stop_may_come_twice_or_without_a_start(tmp_path: Path, source: SyntheticSource):
    recorder = Recorder(source, tmp_path / "bag", node_name=NODE)
    recorder.stop()
    recorder.stop()
    assert not recorder.recording
    with pytest.raises(TraceError, match="exists already"):
        Recorder(source, tmp_path / "bag", node_name=NODE)


def test_what_latched_topics_said_last_is_in_every_file(tmp_path: Path, source: SyntheticSource) -> None:
    made = Recorder(
        source, tmp_path / "bag", node_name=NODE, flush_period_s=0.02, split=Split(after_s=0, after_bytes=1)
    )
    made.start()
    latched = TopicQos(depth=1, transient_local=True)
    for text in (b"a", b"b", b"a"):
        made.record("/description", TEXT, HELLO + text, monotonic_ns=time.monotonic_ns(), qos=latched)
    made.record("/said_once", TEXT, HELLO, monotonic_ns=time.monotonic_ns())
    wait_until(lambda: len([*(tmp_path / "bag").glob("*.mcap")]) > 3)
    made.stop()
    state = examine_bag(tmp_path / "bag")
    assert state.is_finished
    assert {finding.kind for finding in check_bag(tmp_path / "bag")} == {"note"}
    with_messages = [file for file in state.files if file.counts.messages]
    by_topic = [
        {channel.topic: file.counts.by_channel.get(channel.id, 0) for channel in file.channels}
        for file in with_messages
    ]
    first = next(place for place, counts in enumerate(by_topic) if counts.get("/description"))
    assert by_topic[first]["/description"] == 3
    assert [counts["/description"] for counts in by_topic[first + 1 :]] == [2] * (len(by_topic) - first - 1)
    assert sum(counts.get("/said_once", 0) for counts in by_topic) == 1
    ledger = json.loads(state.custom_data[LEDGER])
    assert Entry(**ledger["/said_once"]) == Entry(received=1)
    assert ledger["/description"]["received"] == 3
    assert ledger["/description"]["repeated"] == 2 * (len(by_topic) - first - 1)


def test_what_is_lost_of_a_topic_is_told(recorder: Recorder, source: SyntheticSource) -> None:
    recorder.start()
    assert recorder.record("/text", TEXT, HELLO, monotonic_ns=time.monotonic_ns())
    assert not recorder.record("/text", TEXT, bytes(20_000), monotonic_ns=time.monotonic_ns())
    recorder.stop()
    found = {finding.kind: finding.text for finding in check_bag(recorder.directory)}
    assert found["loss"] == "topic /text: 1 of 2 messages that came are not in the bag"


def test_check_tells_what_is_known_of_topics_of_other_nodes(tmp_path: Path, source: SyntheticSource) -> None:
    bag = TraceBag(source, tmp_path / "bag", node_name=NODE, on_error=lambda _: None)
    others = {
        "/gaps": Entry(received=0, lost_before=1, numbered=True),
        "/no_gaps": Entry(numbered=True),
        "/reported": Entry(lost_before=2, numbered=False),
        "/unnumbered": Entry(numbered=False),
    }
    bag.write(source.drain_trace(), [], whole=True)
    bag.tell_ledger({"/own": 0}, {}, others)
    bag.close()
    assert open_trace(tmp_path / "bag").ledger == {"/own": Entry(), **others}
    found = [(finding.kind, finding.text) for finding in check_bag(tmp_path / "bag")]
    losses = [text for kind, text in found if kind == "loss"]
    lost = "lost before the recorder received them, by"
    assert losses[0].startswith(f"topic /gaps: 1 message {lost} gaps in the numbers of their writers; 0 came")
    assert losses[1].startswith(f"topic /reported: 2 messages {lost} report of the middleware; 0 came")
    assert len(losses) == 2
    notes = [text for kind, text in found if kind == "note" and text.startswith("/")]
    assert notes[0].startswith("/no_gaps: no gap between the first and the last message of each writer; ")
    assert notes[1].startswith("/reported, /unnumbered: the middleware numbers no messages: ")
