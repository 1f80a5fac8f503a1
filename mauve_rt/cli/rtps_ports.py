"""UDP ports of the DDS participants on this machine, as RTPS defines them, and the sockets bound to them."""

from pathlib import Path
from typing import NamedTuple

from mauve_rt.node.shared.rtps_ports import discovery_ports

MAX_PARTICIPANTS = 120  # of a domain
UDP_TABLE = Path("/proc/net/udp")
_ADDRESS, _INODE = 1, 9  # columns


class DiscoverySocket(NamedTuple):
    """A UDP socket at which a participant receives discovery messages."""

    port: int
    inode: str


def discovery_sockets(domain: int) -> list[DiscoverySocket]:
    """The discovery sockets of every participant on this machine in a ROS domain.

    Raises:
        OSError: the system has no table of UDP sockets.
    """
    ports = discovery_ports(domain, MAX_PARTICIPANTS)
    rows = [line.split() for line in UDP_TABLE.read_text("ascii").splitlines()[1:]]
    found = [
        DiscoverySocket(int(row[_ADDRESS].rpartition(":")[2], 16), row[_INODE])
        for row in rows
        if len(row) > _INODE
    ]
    return [each for each in found if each.port in ports]
