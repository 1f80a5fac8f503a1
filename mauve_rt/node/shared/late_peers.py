"""Static peers whose names get an address after the start: this program announces itself to them.

A DDS participant takes its peers when it is made. So this module relays: it receives one announcement of its
own node's participant, which Fast DDS sends to the participants' ports of this machine, and sends it on to
the peers' ports. RTPS asks for no more: an announcement says how to reach its participant, and the peer
answers there.
"""

import os
import socket
import threading
import time
from collections.abc import Sequence
from typing import Any

from rclpy.node import Node

from mauve_rt.node.shared.discovery import RANGE
from mauve_rt.node.shared.network_interfaces import usable_addresses
from mauve_rt.node.shared.static_peers import address_of
from mauve_rt.node.shared.watch import Watch

_PERIOD_S = 3.0  # as Fast DDS repeats its announcements
_RECEIVE_S = 4.0  # in which one comes
_CLOSE_S = 0.6
_CAPTURES = 2  # after a change of interfaces, which the participant may take up a moment later
_FIRST_PORT, _DOMAIN_PORTS = 7410, 250  # of discovery by unicast, in RTPS
_PARTICIPANTS = {"LOCALHOST": 32}  # of a machine, to whose ports Fast DDS announces, by discovery range
_USUAL_PARTICIPANTS = 4
_HEADER_BYTES, _PREFIX = 20, slice(8, 20)  # of an RTPS message; whose participant sent it
_MAX_BYTES = 65536


class LatePeers:
    """Resolves names on a thread of its own until all have an address; announces to these until closed.

    | member     | written by                       | read by    |
    | ---------- | -------------------------------- | ---------- |
    | `_ending`  | close()                          | the thread |
    | the rest   | the constructor, then the thread | the thread |
    """

    def __init__(self, node: Node, watch: Watch, names: Sequence[str]) -> None:
        """Begin, if there are names without an address."""
        self._ending = threading.Event()
        self._thread: threading.Thread | None = None
        if not names:
            return
        self._node, self._names = node, list(names)
        self._addresses: list[str] = []
        self._first_port = _FIRST_PORT + _DOMAIN_PORTS * int(node.context.get_domain_id())
        self._announcement = b""
        self._captures_left = _CAPTURES
        self._usable = usable_addresses()
        self._thread = watch.thread("late peers", self._step, ending=self._ending)
        self._thread.start()

    def close(self) -> None:
        """Before the node is destroyed. A name server that does not answer is not waited for."""
        self._ending.set()
        if self._thread is not None:
            self._thread.join(_CLOSE_S)

    def _step(self) -> None:
        for name in list(self._names):
            if address := address_of(name):
                self._names.remove(name)
                self._addresses.append(address)
                if self._ending.is_set():
                    return
                self._node.get_logger().info(f"static peer {name} has an address now: {address}")
        usable = usable_addresses()
        if usable != self._usable:
            self._usable, self._captures_left = usable, _CAPTURES
        if self._addresses and self._captures_left:
            self._announcement = self._own_announcement() or self._announcement
            self._captures_left -= bool(self._announcement)
        if self._announcement:
            self._announce()
        self._ending.wait(_PERIOD_S)

    def _own_announcement(self) -> bytes:
        """The next announcement of this node's participant; empty where none comes."""
        prefixes = self._own_prefixes()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
            if not self._bind(receiver):
                return b""
            receiver.settimeout(_RECEIVE_S / 10)
            until_s = time.monotonic() + _RECEIVE_S
            while time.monotonic() < until_s and not self._ending.is_set():
                try:
                    message = receiver.recv(_MAX_BYTES)
                except TimeoutError:
                    continue
                if len(message) > _HEADER_BYTES and message[_PREFIX] in prefixes:
                    return message
        return b""

    def _bind(self, receiver: socket.socket) -> bool:
        """Take the port of a participant that is not there; False where all of them are."""
        for number in reversed(range(_PARTICIPANTS.get(os.environ.get(RANGE, ""), _USUAL_PARTICIPANTS))):
            try:
                receiver.bind(("127.0.0.1", self._first_port + 2 * number))
            except OSError:
                continue
            return True
        return False

    def _own_prefixes(self) -> set[bytes]:
        found: list[Any] = self._node.get_publishers_info_by_topic("/rosout")
        ours = (self._node.get_name(), self._node.get_namespace())
        return {
            bytes(each.endpoint_gid[:12]) for each in found if (each.node_name, each.node_namespace) == ours
        }

    def _announce(self) -> None:
        for address in self._addresses:
            family = socket.AF_INET6 if ":" in address else socket.AF_INET
            with socket.socket(family, socket.SOCK_DGRAM) as sender:
                for number in range(_PARTICIPANTS["LOCALHOST"]):
                    try:
                        sender.sendto(self._announcement, (address, self._first_port + 2 * number))
                    except OSError:  # no way there at the moment
                        break
