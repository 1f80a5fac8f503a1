"""Network interfaces that come up while a node runs.

Fast DDS uses those that were up when its participant was made. A node that starts while the cable is out, or
the robot out of its radio's reach, would hear nobody beyond this machine for the rest of its life, and
announce no address. Fast DDS looks for interfaces anew when a participant is given its quality of service
again, the same as before. It has no C function for that: it is called by the names of its C++ functions,
which say what they take. Where those are missing, and with other middlewares, nothing is done.
"""

import ctypes
import fcntl
import os
import select
import socket
import struct
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from rclpy.node import Node

from mauve_rt.node.shared.discovery import stays_on_this_machine
from mauve_rt.node.shared.watch import Watch

_LINK, _IPV4_ADDRESS = 0x1, 0x10  # groups of linux/rtnetlink.h
_GET_FLAGS, _GET_ADDRESS = 0x8913, 0x8915  # of linux/sockios.h
_RUNNING, _NAME_BYTES = 0x40, 16  # of linux/if.h
_SETTLED_S = 0.2  # an interface that comes up tells so several times
_MAX_BYTES = 65536
_MIDDLEWARE = "librmw_fastrtps_cpp.so"
_GET_PARTICIPANT = "_ZN16rmw_fastrtps_cpp22get_domain_participantEP10rmw_node_s"
_GET_QOS = "_ZNK8eprosima7fastdds3dds17DomainParticipant7get_qosEv"
_SET_QOS = "_ZNK8eprosima7fastdds3dds17DomainParticipant7set_qosERKNS1_20DomainParticipantQosE"


class NetworkInterfaces:
    """Has a node's participant use what comes up, on a thread of its own, until it is closed.

    One that it has used before is left alone when it is back: there is nothing to look for, and while peers
    meet again Fast DDS had better not be disturbed (one of them may never be heard then).

    | member    | written by                           | read by                           |
    | --------- | ------------------------------------ | --------------------------------- |
    | `_ending` | close()                              | the thread, between any two waits |
    | `_used`   | the constructor, then the thread     | the thread                        |
    | the rest  | the constructor                      | the thread                        |
    """

    def __init__(self, node: Node, watch: Watch, *, before: frozenset[str]) -> None:
        """Begin, if discovery reaches beyond this machine.

        Args:
            node: has a participant of DDS.
            watch: tells of what goes wrong.
            before: what usable_addresses() said before that was made.
        """
        self._ending = threading.Event()
        self._thread: threading.Thread | None = None
        look_anew = None if stays_on_this_machine() else _fast_dds(node)
        if look_anew is None:
            return
        self._look_anew = look_anew
        self._used = before
        try:
            self._kernel = socket.socket(socket.AF_NETLINK, socket.SOCK_RAW, socket.NETLINK_ROUTE)
            self._kernel.bind((0, _LINK | _IPV4_ADDRESS))
        except OSError as error:  # a sandbox that has no rtnetlink: then as it was before
            watch.tell("watching network interfaces", error)
            return
        self._kernel.setblocking(False)
        self._ended, self._end = os.pipe()
        self._thread = watch.thread("network interfaces", self._step, ending=self._ending)
        self._thread.start()

    def close(self) -> None:
        """Before the node is destroyed."""
        if self._thread is None:
            return
        self._ending.set()
        os.close(self._end)
        self._thread.join()
        self._thread = None
        os.close(self._ended)
        self._kernel.close()

    def _step(self) -> None:
        usable = usable_addresses()
        if usable - self._used and not self._ending.is_set():
            self._look_anew()
        self._used |= usable
        if self._changes(None):
            while self._changes(_SETTLED_S):
                pass

    def _changes(self, timeout_s: float | None) -> bool:
        """Whether the kernel tells of a change within that time; False, too, when it is to end."""
        ready, _, _ = select.select([self._kernel.fileno(), self._ended], [], [], timeout_s)
        if self._kernel.fileno() not in ready or self._ended in ready:
            return False
        with suppress(OSError):  # more than the buffer holds is a change, too
            self._kernel.recv(_MAX_BYTES)
        return True


def usable_addresses() -> frozenset[str]:
    """The IPv4 addresses, and their interfaces, of those that are up and have a carrier."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
        found = (_address(any_socket, name) for _, name in socket.if_nameindex())
        return frozenset(address for address in found if address)


def _address(any_socket: socket.socket, name: str) -> str:
    request = struct.pack("256s", name.encode()[:15])
    try:
        (flags,) = struct.unpack_from("H", fcntl.ioctl(any_socket, _GET_FLAGS, request), _NAME_BYTES)
        answer = fcntl.ioctl(any_socket, _GET_ADDRESS, request)
    except OSError:  # it has none, or is gone
        return ""
    return f"{name} {socket.inet_ntoa(answer[20:24])}" if flags & _RUNNING else ""


def _fast_dds(node: Node) -> Callable[[], Any] | None:
    """What has Fast DDS look for interfaces anew; None: another middleware, or another Fast DDS."""
    try:
        middleware = ctypes.CDLL(_MIDDLEWARE, os.RTLD_NOLOAD | os.RTLD_NOW)
        rcl = ctypes.CDLL("librcl.so", os.RTLD_NOLOAD | os.RTLD_NOW)
        get_participant, get_qos, set_qos = (
            _function(middleware, name) for name in (_GET_PARTICIPANT, _GET_QOS, _SET_QOS)
        )
        get_handle = _function(rcl, "rcl_node_get_rmw_handle")
    except (OSError, AttributeError):
        return None
    handle = get_handle(ctypes.c_void_p(node.handle.pointer))
    participant = ctypes.c_void_p(get_participant(ctypes.c_void_p(handle)))  # none of another middleware's
    if not participant:
        return None
    return lambda: set_qos(participant, ctypes.c_void_p(get_qos(participant)))


def _function(library: ctypes.CDLL, name: str) -> Any:
    function = getattr(library, name)
    function.restype = ctypes.c_void_p
    return function
