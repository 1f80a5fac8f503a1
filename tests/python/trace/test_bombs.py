"""Small files that claim to be large: every verb ends, in little memory, with one line or a good result."""

import re
import struct
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import zstandard
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    MessageIndex,
    Schema,
)
from synthetic_traces import record_small_bag

from mauve_rt.trace.bag.mcap_file import MAGIC
from mauve_rt.trace.bag.mcap_library import serialized
from mauve_rt.trace.bag.mcap_scan import McapScan
from mauve_rt.trace.errors import TraceError
from mauve_rt.trace.format.cdr import encode_names
from mauve_rt.trace.format.mcap_records import HEAD
from mauve_rt.trace.reading.reader import open_trace

ADDRESS_SPACE = 2 << 30
NAMES = "mauve_msgs/msg/TraceNames"
# Imports by a good bag what all verbs need. Then a child runs the verbs for each bag, in so many addresses.
VERBS = """
import contextlib, os, resource, sys, traceback
from mauve_rt.cli.main import main

def run_verbs(bag):
    for words in (["trace", "info"], ["trace", "check"], ["trace", "stats"], ["trace", "repair"], ["report"],
                  ["trace", "export", "--format", "csv"]):
        if words[-1] in ("csv", "report"):
            words += ["--out", f"{bag}.{words[-1]}.html"]
        words.insert(2 if words[0] == "trace" else 1, bag)
        print("VERB", words[:2], main(words), flush=True)

def run_child(bag, size):
    resource.setrlimit(resource.RLIMIT_AS, (size, size))
    for number, name in ((1, "out"), (2, "err")):
        os.dup2(os.open(f"{bag}.{name}", os.O_WRONLY | os.O_CREAT | os.O_TRUNC), number)
    try:
        run_verbs(bag)
    except BaseException:
        traceback.print_exc()
        os._exit(1)
    os._exit(0)

size, good = int(sys.argv[1]), sys.argv[2]
with contextlib.redirect_stdout(sys.stderr):
    run_verbs(good)
for line in sys.stdin:
    child = os.fork() or run_child(line.rstrip(), size)
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
"""


@pytest.fixture(scope="module")
def verbs(tmp_path_factory: pytest.TempPathFactory) -> Iterator[subprocess.Popen[str]]:
    """The process that runs all verbs."""
    good = tmp_path_factory.mktemp("good") / "bag"
    record_small_bag(good)
    command = [sys.executable, "-c", VERBS, str(ADDRESS_SPACE), str(good)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        yield process
        process.communicate()


def run(verbs: subprocess.Popen[str], bag: Path) -> tuple[list[int], str]:
    """The exit status of every verb, and what they wrote to stderr, in 2 GB of addresses."""
    assert verbs.stdin is not None
    assert verbs.stdout is not None
    print(bag, file=verbs.stdin, flush=True)
    status = verbs.stdout.readline()
    output, errors = (Path(f"{bag}.{name}").read_text("utf-8") for name in ("out", "err"))
    assert "Traceback" not in errors, errors
    assert status == "0\n", errors
    told = [line for line in output.splitlines() if line.startswith("VERB")]
    assert len(told) == 6
    return [int(line.rsplit(" ", 1)[1]) for line in told], errors


def zstd_zeros(size: int) -> bytes:
    """A frame that stands for so many zeros: blocks of 128 KB in 4 bytes each."""
    block = 1 << 17
    count = size // block
    blocks = [
        (block << 3 | 1 << 1 | (number == count - 1)).to_bytes(3, "little") + b"\0" for number in range(count)
    ]
    return b"\x28\xb5\x2f\xfd\xc0\x38" + struct.pack("<Q", count * block) + b"".join(blocks)


def packed(data: bytes) -> Chunk:
    return chunk(zstandard.ZstdCompressor().compress(data), len(data))


def chunk(data: bytes, size: int, compression: str = "zstd") -> Chunk:
    return Chunk(compression, data, 0, 0, 0, size)


def topic(definition: bytes = b"string[] components\nstring[] names\n") -> list[McapRecord]:
    return [
        Schema(id=1, name=NAMES, encoding="ros2msg", data=definition),
        Channel(id=1, schema_id=1, topic="/trace", message_encoding="cdr", metadata={}),
    ]


def said(data: bytes) -> Chunk:
    return chunk(message_bytes(data), len(message_bytes(data)), "")


def message_bytes(data: bytes) -> bytes:
    body = struct.pack("<HIQQ", 1, 0, 0, 0) + data
    return HEAD.pack(Opcode.MESSAGE, len(body)) + body


def claims_more_than_it_says() -> Iterator[McapRecord]:
    yield chunk(zstd_zeros(4_200_000_000), 100)


def unpacks_to_gigabytes() -> Iterator[McapRecord]:
    yield chunk(zstd_zeros(4_200_000_000), 4_200_000_000 >> 17 << 17)


def claims_an_exabyte() -> Iterator[McapRecord]:
    yield chunk(zstd_zeros(1 << 20), 1 << 60)


def claims_an_exabyte_in_lz4() -> Iterator[McapRecord]:
    yield chunk(b"\x04\x22\x4d\x18" + bytes(100), 1 << 60, "lz4")


def claims_an_exabyte_as_it_is() -> Iterator[McapRecord]:
    yield chunk(bytes(100), 1 << 60, "")


def many_chunks() -> Iterator[McapRecord]:
    for _ in range(30):
        yield chunk(zstd_zeros(1 << 27), 1 << 27)


def many_messages() -> Iterator[McapRecord]:
    yield from topic()
    yield packed(message_bytes(b"") * 4_000_000)


def many_other_records() -> Iterator[McapRecord]:
    yield packed(HEAD.pack(0x7F, 0) * 20_000_000)


def a_large_schema() -> Iterator[McapRecord]:
    yield packed(serialized(Schema(1, bytes(200_000_000), "ros2msg", "a/msg/B")))


def many_schemas() -> Iterator[McapRecord]:
    for number in range(1, 12):
        yield packed(serialized(Schema(number, bytes(10_000_000), "ros2msg", "a/msg/B")))


def an_index_inside_a_chunk() -> Iterator[McapRecord]:
    body = struct.pack("<HI", 1, 160_000_000) + bytes(160_000_000)
    yield packed(HEAD.pack(Opcode.MESSAGE_INDEX, len(body)) + body)


def a_long_sequence() -> Iterator[McapRecord]:
    yield from topic()
    yield said(b"\0\1\0\0" + b"\xff" * 8)


def endless_elements() -> Iterator[McapRecord]:
    definition = (
        b"Nothing[] components\nstring[] names\n" + b"=" * 80 + b"\nMSG: mauve_msgs/Nothing\nuint8[0] none\n"
    )
    yield from topic(definition)
    yield said(b"\0\1\0\0" + b"\xff" * 8)


def a_type_of_itself() -> Iterator[McapRecord]:
    yield from topic(b"TraceNames[] components\nstring[] names\n")
    yield said(encode_names(["a"], ["b"]))


def a_field_named_class() -> Iterator[McapRecord]:
    yield from topic(b"string[] class\nstring[] class\n")
    yield said(encode_names(["a"], ["b"]))


def a_huge_array() -> Iterator[McapRecord]:
    yield from topic(b"string[1000000000] components\n")
    yield said(encode_names(["a"], ["b"]))


def many_fields() -> Iterator[McapRecord]:
    yield from topic(b"".join(b"string a%d\n" % number for number in range(10_000)))
    yield said(encode_names(["a"], ["b"]))


def blank_lines() -> Iterator[McapRecord]:
    yield packed(serialized(*topic(b"\n" * 5_000_000)))
    yield said(encode_names(["a"], ["b"]))


def an_array_of_less_than_nothing() -> Iterator[McapRecord]:
    yield from topic(b"uint8[-1] components\nstring[] names\n")
    yield said(encode_names(["a"], ["b"]))


def other_fields() -> Iterator[McapRecord]:
    yield from topic(b"string[] parts\nstring[] words\n")
    yield said(encode_names(["a"], ["b"]))


def an_unknown_type() -> Iterator[McapRecord]:
    yield from topic(b"Other[] components\nstring[] names\n")
    yield said(encode_names(["a"], ["b"]))


def a_message_of_an_unknown_channel() -> Iterator[McapRecord]:
    yield said(b"\0\1\0\0")


def one_chunk_indexed_often() -> Iterator[McapRecord]:
    yield from topic()
    yield said(encode_names(["a"], ["b"]))
    yield MessageIndex(1, [(0, 0)] * 1000)


MAKERS = [
    claims_more_than_it_says,
    unpacks_to_gigabytes,
    claims_an_exabyte,
    claims_an_exabyte_in_lz4,
    claims_an_exabyte_as_it_is,
    many_chunks,
    many_messages,
    many_other_records,
    a_large_schema,
    many_schemas,
    an_index_inside_a_chunk,
    a_long_sequence,
    endless_elements,
    a_type_of_itself,
    a_field_named_class,
    a_huge_array,
    many_fields,
    blank_lines,
    an_array_of_less_than_nothing,
    other_fields,
    an_unknown_type,
    a_message_of_an_unknown_channel,
    one_chunk_indexed_often,
]


def file_of(*records: McapRecord) -> bytes:
    data = MAGIC + serialized(Header("ros2", "a bomb"), *records, DataEnd(0))
    index = ChunkIndex(100, len(MAGIC) + 30, "", 1 << 60, 0, 0, {}, 0, 1 << 60)
    return data + serialized(*[index] * 1000, Footer(len(data), 0, 0)) + MAGIC


@pytest.mark.parametrize("make", MAKERS, ids=lambda make: make.__name__)
def test_a_bomb_of_a_file(
    verbs: subprocess.Popen[str], tmp_path: Path, make: Callable[[], Iterator[McapRecord]]
):
    bag = tmp_path / "bag"
    bag.mkdir()
    content = file_of(*make())
    assert len(content) < 400_000
    (bag / "bag_0.mcap").write_bytes(content)
    statuses, errors = run(verbs, bag)
    assert set(statuses) <= {0, 1, 2}
    assert 2 in statuses  # there is no trace in it
    assert all(line.startswith("mauve: ") for line in errors.splitlines()), errors


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (endless_elements, "an array of no elements"),
        (a_type_of_itself, "is defined by itself"),
        (
            a_field_named_class,
            "the definition cannot be read (Type 'mauve_msgs/msg/TraceNames' has conflicting",
        ),
        (a_long_sequence, "Invalid sequence length 4294967295 at offset 4"),
        (a_huge_array, "the definition has 1,000,000,001 fields, expected at most 2,000"),
        (many_fields, "the definition has 10,000 fields, expected at most 2,000"),
        (blank_lines, "the definition has 5,000,000 characters, expected at most 262,144"),
        (an_array_of_less_than_nothing, "an array of no elements"),
        (other_fields, "its messages are no mauve_msgs/msg/TraceNames ("),
        (an_unknown_type, "the definition does not tell the type mauve_msgs/msg/Other"),
    ],
)
def test_what_its_definitions_make_of_a_message_is_told(
    tmp_path: Path, make: Callable[[], Iterator[McapRecord]], words: str
):
    (tmp_path / "bag_0.mcap").write_bytes(file_of(*make()))
    with pytest.raises(TraceError, match=re.escape(words)):
        open_trace(tmp_path)


def test_what_would_be_too_much_is_not_cut_off_by_a_repair(verbs: subprocess.Popen[str], tmp_path: Path):
    bag = tmp_path / "bag_0.mcap"
    bag.write_bytes(content := file_of(*unpacks_to_gigabytes()))
    statuses, errors = run(verbs, bag)
    assert statuses == [2] * 6
    assert errors.count("it is not read, for so little can be made to take all memory") == 6
    assert bag.read_bytes() == content


def test_an_attachment_of_terabytes_is_passed_over(tmp_path: Path):
    begin = MAGIC + serialized(Header("ros2", "a hole")) + HEAD.pack(Opcode.ATTACHMENT, size := 1 << 40)
    bag = tmp_path / "bag_0.mcap"
    bag.write_bytes(begin)
    try:
        with bag.open("r+b") as file:
            file.seek(len(begin) + size)
            file.write(serialized(*topic(), said(encode_names(["a"], [])), DataEnd(0)))
    except OSError:
        pytest.skip("the file system takes no sparse files")
    with McapScan(bag) as scan:
        assert [channel.topic for channel, _ in scan.messages()] == ["/trace"]


ALIASES = "a0: &a0 [x, x]\n" + "".join(f"a{n}: &a{n} [*a{n - 1}, *a{n - 1}]\n" for n in range(1, 60))


@pytest.mark.parametrize(
    "metadata",
    [
        ALIASES.encode() + b"rosbag2_bagfile_information: {relative_file_paths: *a59}\n",
        b"[" * 1_000_000,
        b"rosbag2_bagfile_information: {relative_file_paths: 5, custom_data: [], message_count: {}}\n",
        b"rosbag2_bagfile_information: {relative_file_paths: [\xff]}\n",
        b"\0" * 100,
        "rosbag2_bagfile_information: {}\n".encode("utf-16"),
        b"",
    ],
    ids=["aliases", "deep", "types", "ff", "nul", "utf16", "empty"],
)
def test_a_bomb_of_metadata(verbs: subprocess.Popen[str], tmp_path: Path, metadata: bytes):
    bag = tmp_path / "bag"
    record_small_bag(bag)
    (bag / "metadata.yaml").write_bytes(metadata)
    statuses, errors = run(verbs, bag)
    assert statuses == [0, 1, 0, 0, 0, 0], errors
