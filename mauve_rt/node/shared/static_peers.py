"""Names in ROS_STATIC_PEERS that have no address at the start: rmw_fastrtps refuses to start with one.

A robot that boots with the cable out cannot resolve names. A name without an address is left out of
ROS_STATIC_PEERS, and reported.
"""

import ipaddress
import os
import socket

STATIC_PEERS = "ROS_STATIC_PEERS"
_HERE = "127.0.0.1"  # keeps the program open to other machines where no peer is left


def resolve_static_peers() -> tuple[str, ...]:
    """Replace names in ROS_STATIC_PEERS by their addresses where one has none; returns those that have none.

    No thread may be there that reads the environment while this runs.
    """
    peers = [peer for word in os.environ.get(STATIC_PEERS, "").split(";") if (peer := word.strip())]
    addresses = {peer: address_of(peer) for peer in peers}
    unresolved = tuple(peer for peer, address in addresses.items() if not address)
    if unresolved:
        known = [address for address in addresses.values() if address]
        os.environ[STATIC_PEERS] = ";".join([*known, _HERE])
    return unresolved


def unresolved_text(names: tuple[str, ...]) -> str:
    """What to report of names without an address."""
    found = f"{STATIC_PEERS}: no address is found for {', '.join(names)}"
    return f"{found}. Connect the network, or give the address."


def address_of(peer: str) -> str:
    """The address of a peer, IPv4 before IPv6; "" where its name has none."""
    try:
        return str(ipaddress.ip_address(peer))
    except ValueError:
        pass
    try:
        found = socket.getaddrinfo(peer, None, type=socket.SOCK_DGRAM)
    except (OSError, UnicodeError):
        return ""
    families = {family: str(address[0]) for family, _, _, _, address in reversed(found)}
    return families.get(socket.AF_INET) or families.get(socket.AF_INET6, "")
