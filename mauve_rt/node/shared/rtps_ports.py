"""UDP ports of the DDS participants on this machine, as RTPS defines them, and the sockets bound to them."""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

MAX_PARTICIPANTS = 120  # of a domain
UDP_TABLE = Path("/proc/net/udp")
_BASE_PORT, _FIRST_PORT, _DOMAIN_PORTS = 7400, 7410, 250  # the first port is of discovery by unicast
_LAST_DOMAIN = 101  # ports of higher domains are given to sockets of any program, too
_ADDRESS, _INODE = 1, 9  # columns


class DiscoverySocket(NamedTuple):
    """A UDP socket at which a participant receives discovery messages."""

    port: int
    inode: str


def discovery_ports(domain: int, participants: int) -> range:
    """The ports of so many participants of a domain, by their numbers; the next port is that of its data."""
    first = _FIRST_PORT + _DOMAIN_PORTS * domain
    return range(first, first + 2 * participants, 2)


def discovery_sockets(domain: int) -> list[DiscoverySocket]:
    """The discovery sockets of every participant on this machine in a ROS domain.

    Raises:
        OSError: the system has no table of UDP sockets.
    """
    ports = discovery_ports(domain, MAX_PARTICIPANTS)
    return [each for each in _sockets(UDP_TABLE) if each.port in ports]


def participants_by_domain(table: Path = UDP_TABLE) -> dict[int, int]:
    """The number of participants on this machine in each ROS domain up to 101 that has any.

    Raises:
        OSError: the system has no table of UDP sockets.
    """
    ports: dict[int, set[int]] = {}
    for port in {each.port for each in _sockets(table)}:
        domain = (port - _BASE_PORT) // _DOMAIN_PORTS
        if 0 <= domain <= _LAST_DOMAIN and port in discovery_ports(domain, MAX_PARTICIPANTS):
            ports.setdefault(domain, set()).add(port)
    return {domain: len(ports[domain]) for domain in sorted(ports)}


def _sockets(table: Path) -> Iterator[DiscoverySocket]:
    for line in table.read_text("ascii").splitlines()[1:]:
        row = line.split()
        if len(row) > _INODE:
            yield DiscoverySocket(int(row[_ADDRESS].rpartition(":")[2], 16), row[_INODE])
