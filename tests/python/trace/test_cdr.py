"""The recorder's hand-made CDR equals what the ROS serializers make of the same messages."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from mauve_rt.trace import TraceError
from mauve_rt.trace.format.cdr import Batch, decode_batch, encode_batch, encode_names
from mauve_rt.trace.format.records import RECORD

MESSAGES = Path(__file__).parents[3] / "mauve_msgs" / "msg"
STORE = get_typestore(Stores.EMPTY)
for _name in ("TraceRecord", "TraceBatch", "TraceNames"):
    STORE.register(get_types_from_msg((MESSAGES / f"{_name}.msg").read_text(), f"mauve_msgs/msg/{_name}"))

INT64 = st.integers(-(2**63), 2**63 - 1)
UINT64 = st.integers(0, 2**64 - 1)
ROWS = st.tuples(
    UINT64,
    INT64,
    INT64,
    INT64,
    INT64,
    st.integers(0, 2**32 - 1),
    st.integers(1, 16),
    st.integers(0, 2**16 - 1),
)
WORDS = st.lists(st.text(st.characters(blacklist_characters="\0", blacklist_categories=("Cs",))), max_size=5)


@st.composite
def batches(draw: st.DrawFn):
    counters = st.lists(UINT64, max_size=5)
    records = np.array(draw(st.lists(ROWS, max_size=5)), dtype=RECORD).tobytes()
    return Batch(draw(INT64), draw(INT64), draw(counters), draw(counters), records)


def as_dicts(batch: Batch):
    return [{key: row[key].item() for key in RECORD.names} for row in np.frombuffer(batch.records, RECORD)]


def by_rosbags(batch: Batch):
    record = STORE.types["mauve_msgs/msg/TraceRecord"]
    message = STORE.types["mauve_msgs/msg/TraceBatch"](
        batch.monotonic_ns,
        batch.realtime_ns,
        np.array(batch.written, np.uint64),
        np.array(batch.dropped, np.uint64),
        [record(**row) for row in as_dicts(batch)],
    )
    return bytes(STORE.serialize_cdr(message, "mauve_msgs/msg/TraceBatch"))


@given(batches())
def test_a_batch_is_what_rosbags_makes_of_it(batch: Batch):
    assert encode_batch(batch) == by_rosbags(batch)


@given(WORDS, WORDS)
def test_names_are_what_rosbags_makes_of_them(components: list[str], names: list[str]):
    message = STORE.types["mauve_msgs/msg/TraceNames"](components, names)
    expected = bytes(STORE.serialize_cdr(message, "mauve_msgs/msg/TraceNames"))
    assert encode_names(components, names) == expected


@given(batches())
def test_rclpy_and_we_read_each_others_batches(batch: Batch):
    serialization = pytest.importorskip("rclpy.serialization")
    messages = pytest.importorskip("mauve_msgs.msg")
    message = messages.TraceBatch(
        monotonic_ns=batch.monotonic_ns,
        realtime_ns=batch.realtime_ns,
        written=list(batch.written),
        dropped=list(batch.dropped),
        records=[messages.TraceRecord(**row) for row in as_dicts(batch)],
    )
    assert serialization.deserialize_message(encode_batch(batch), messages.TraceBatch) == message
    # Not the same bytes: what rclpy leaves in the gaps between aligned values is not defined.
    decoded = decode_batch(serialization.serialize_message(message))
    assert (*decoded[:2], list(decoded.written), list(decoded.dropped), bytes(decoded.records)) == batch


@given(WORDS, WORDS)
def test_rclpy_reads_our_names(components: list[str], names: list[str]):
    serialization = pytest.importorskip("rclpy.serialization")
    messages = pytest.importorskip("mauve_msgs.msg")
    encoded = encode_names(components, names)
    message = messages.TraceNames(components=components, names=names)
    assert serialization.deserialize_message(encoded, messages.TraceNames) == message


@given(batches())
def test_decoding_undoes_encoding(batch: Batch):
    decoded = decode_batch(encode_batch(batch))
    assert decoded[:2] == batch[:2]
    assert list(decoded.written) == list(batch.written)
    assert list(decoded.dropped) == list(batch.dropped)
    assert bytes(decoded.records) == batch.records


@given(batches(), st.data())
def test_a_truncated_batch_is_refused(batch: Batch, data: st.DataObject):
    encoded = encode_batch(batch)
    with pytest.raises(TraceError, match=r"truncated|encapsulation"):
        decode_batch(encoded[: data.draw(st.integers(0, len(encoded) - 1))])


def test_half_a_record_is_refused():
    with pytest.raises(TraceError, match="multiple of 48 bytes of records, found 47"):
        encode_batch(Batch(0, 0, [], [], bytes(47)))
