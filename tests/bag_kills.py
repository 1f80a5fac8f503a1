"""A process that records and is killed inside of a write."""

import contextlib
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

from mauve_rt.native_program import native_program

KEEPER = native_program("bag_keeper")
TEXT = "mauve_test_msgs/msg/Text"
PATIENCE_S = 100.0


RECORDING = f"""
import random
import sys
from pathlib import Path
from mauve_rt.trace.bag.disk import KeptDisk
from mauve_rt.trace.bag.writer import BagWriter
disk = KeptDisk(Path(sys.argv[1]), on_error=print)
bag = BagWriter(Path(sys.argv[2]), disk=disk, compression=sys.argv[5])
size, split_every = int(sys.argv[3]), int(sys.argv[4])
bag.add_topic("/words", "{TEXT}")
text = random.Random(1).randbytes(size).hex()[: size - 1].encode()  # becomes half of it when compressed
message = bytes([0, 1, 0, 0]) + size.to_bytes(4, "little") + text + bytes(1)
print(disk._process, flush=True)
for number in range(10**9):
    bag.write("/words", number, message)
    bag.flush()
    if number % split_every == split_every - 1:
        bag.split()
    print(number, flush=True)
"""


def until(condition: Callable[[], bool], what: str) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline, f"gave up waiting for: {what}"
        time.sleep(0.002)


def has_ended(process: int) -> bool:
    with contextlib.suppress(OSError):
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    return True


def kill_in_a_write(
    bag: Path, *, size: int, split_every: int, at: int, compression: str = "none"
) -> list[str]:
    """Kill a process as soon as its file grows again; what it had said."""
    words = [sys.executable, "-c", RECORDING, KEEPER, bag, str(size), str(split_every), compression]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as child:
        keeper = int(child.stdout.readline())
        for _ in range(at):
            child.stdout.readline()
        bytes_before = sum(file.stat().st_size for file in bag.glob("*.mcap"))
        while sum(file.stat().st_size for file in bag.glob("*.mcap")) == bytes_before:
            assert child.poll() is None, "it ended by itself"
        child.kill()
        said = child.stdout.readlines()
    until(lambda: has_ended(keeper), "the keeper's end")
    return said
