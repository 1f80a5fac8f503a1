"""A program that carries Ethernet frames between two interfaces, and loses, delays, repeats or swaps some.

    python impaired_cable.py FIRST SECOND

Each line on stdin is a JSON object with what shall differ from a perfect cable: `loss`, `duplicate` and
`swap` are shares of the frames, `delay_s` and `jitter_s` times (a frame takes `delay_s` and up to `jitter_s`
more), `up` false carries nothing. Answers each line with `ok`. In user space: netem may be missing.
"""

import heapq
import json
import random
import select
import socket
import sys
import time
from typing import Any

_ANY_PROTOCOL = 0x0003  # ETH_P_ALL
_OUTGOING = 4  # PACKET_OUTGOING: what this machine sends itself
_IP_AT, _UDP = 14, 17
PERFECT: dict[str, Any] = {
    "loss": 0.0,
    "duplicate": 0.0,
    "swap": 0.0,
    "delay_s": 0.0,
    "jitter_s": 0.0,
    "up": True,
}
_SWAPPED_S = 0.02  # so much later a swapped frame comes


class Cable:
    """Two interfaces and the frames on their way. For one thread."""

    def __init__(self, names: list[str]) -> None:
        """Open both."""
        self.ends = [
            socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(_ANY_PROTOCOL)) for _ in names
        ]
        for end, name in zip(self.ends, names, strict=True):
            end.bind((name, 0))
        self.settings = dict(PERFECT)
        self._random = random.Random(1)  # noqa: S311 - no secret
        self._waiting: list[tuple[float, int, int, bytes]] = []  # due, number, to, frame
        self._number = 0

    def receive(self, index: int) -> None:
        """Take a frame from one end, and decide what becomes of it."""
        frame, about = self.ends[index].recvfrom(65536)
        if about[2] == _OUTGOING or not self.settings["up"] or self._is(self.settings["loss"]):
            return
        frame = _without_checksum(frame)
        for _ in range(2 if self._is(self.settings["duplicate"]) else 1):
            delay_s = self.settings["delay_s"] + self._random.uniform(0, self.settings["jitter_s"])
            if self._is(self.settings["swap"]):
                delay_s += _SWAPPED_S
            self._number += 1
            heapq.heappush(self._waiting, (time.monotonic() + delay_s, self._number, 1 - index, frame))

    def send(self) -> float | None:
        """Send what is due; the seconds until the next frame is, None: there is none."""
        while self._waiting and self._waiting[0][0] <= time.monotonic():
            _, _, to, frame = heapq.heappop(self._waiting)
            self.ends[to].send(frame)
        return max(self._waiting[0][0] - time.monotonic(), 0.0) if self._waiting else None

    def _is(self, share: float) -> bool:
        return share > 0 and self._random.random() < share


def _without_checksum(frame: bytes) -> bytes:
    """Of UDP over IPv4: the sending kernel leaves it to a network card, which is not there; 0 means none."""
    is_udp = frame[12:14] == b"\x08\x00" and frame[_IP_AT + 9] == _UDP
    is_first = is_udp and int.from_bytes(frame[_IP_AT + 6 : _IP_AT + 8]) & 0x1FFF == 0
    if not is_first:
        return frame
    at = _IP_AT + (frame[_IP_AT] & 0x0F) * 4 + 6
    return frame[:at] + b"\0\0" + frame[at + 2 :]


def _say(word: str) -> None:
    sys.stdout.write(f"{word}\n")
    sys.stdout.flush()


def main() -> None:
    """Carry frames until stdin ends."""
    cable = Cable(sys.argv[1:3])
    _say("ready")
    while True:
        ready, _, _ = select.select([*cable.ends, sys.stdin], [], [], cable.send())
        for index, end in enumerate(cable.ends):
            if end in ready:
                cable.receive(index)
        if sys.stdin in ready:
            line = sys.stdin.readline()
            if not line:
                return
            cable.settings = PERFECT | json.loads(line)
            _say("ok")


if __name__ == "__main__":
    main()
