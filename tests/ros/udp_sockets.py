"""The UDP sockets of a process, as the kernel has them."""

import contextlib
import re
import socket
import struct
from pathlib import Path


def udp_sockets(process_id: int) -> set[tuple[str, int]]:
    """Address and port of all UDP sockets that a process holds; of IPv6 the address in hexadecimal digits."""
    links = []
    for descriptor in Path(f"/proc/{process_id}/fd").iterdir():
        with contextlib.suppress(OSError):  # closed since
            links.append(str(descriptor.readlink()))
    held = {match[1] for link in links if (match := re.match(r"socket:\[(\d+)\]", link))}
    tables = [Path(f"/proc/{process_id}/net/{name}") for name in ("udp", "udp6")]
    lines = [line for table in tables if table.exists() for line in table.read_text("ascii").splitlines()]
    return {_endpoint(row[1]) for row in map(str.split, lines) if row[9] in held}


def _endpoint(text: str) -> tuple[str, int]:
    digits, port = text.split(":")
    is_v4 = len(digits) == 8  # hexadecimal digits of 4 bytes
    address = socket.inet_ntoa(struct.pack("=I", int(digits, 16))) if is_v4 else digits
    return address, int(port, 16)
