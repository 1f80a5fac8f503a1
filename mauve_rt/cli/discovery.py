"""Discovery as a node with little time sees it: who is there, and when all of them are known.

Fast DDS answers a new participant once, at its first word. That answer is often lost: the new one listens
only when it has spoken to every port it knows. Then it hears of the other by that one's announcement, every
3 s. Who is in a hurry speaks anew, by one more participant. And who is on this machine can be counted, for
every participant has a port of those that RTPS defines.
"""

import os
import resource
import time
from collections import Counter
from typing import NamedTuple

import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from mauve_rt.cli.transport import by_fast_dds
from mauve_rt.node.shared.announcement import first_participant
from mauve_rt.node.shared.log_folder import NO_LOG_FILES
from mauve_rt.node.shared.loopback import udp_sockets
from mauve_rt.node.shared.rtps_ports import UDP_TABLE, discovery_sockets

ANNOUNCED_S = 3.5  # by then every participant has told of itself, to whomever missed it before
_SPOKEN_S = 0.2  # after which one more participant speaks: an answer comes within 0.11 s
_MAX_SPEAKERS = 8
_FILES_OF_PROCESS, _FILES_OF_SPEAKER = 24, 10  # that are open, with some to spare
_SETTLED_S = 0.15  # endpoints come in a few packets at once
_KEY_BYTES = 12  # of an endpoint's global id: its participant's part


class Participant(NamedTuple):
    """A DDS participant of ours: a context has one as soon as it has a node."""

    context: Context
    node: Node
    executor: SingleThreadedExecutor


class Discovery:
    """Our participants, and what they know together. For one thread."""

    def __init__(self, *, is_local: bool) -> None:
        """`is_local`: it reaches the participants of this machine, by its ports, and nobody else."""
        self.participants: list[Participant] = []
        self._most_speakers = _most_speakers()
        self._spoken_s = 0.0
        self._seen: object = None
        self._seen_s = time.monotonic()
        with first_participant():
            self._speak()
        self._can_count = is_local and by_fast_dds() and UDP_TABLE.exists()

    @property
    def domain(self) -> int:
        """The ROS domain."""
        return int(self.participants[0].context.get_domain_id())

    def offered(self) -> dict[str, list[str]]:
        """The services that are offered, and their types, as any of ours knows."""
        return {
            name: types
            for participant in self.participants
            for name, types in participant.node.get_service_names_and_types()
            if participant.node.count_services(name)  # clients have such names too
        }

    def nodes(self) -> Counter[str]:
        """The full name of each node that any of ours knows, with the number of nodes that have it."""
        nodes: Counter[str] = Counter()
        for participant in self.participants:
            pairs = participant.node.get_node_names_and_namespaces()
            nodes |= Counter(f"{namespace.rstrip('/')}/{name}" for name, namespace in pairs)
        return nodes

    def is_complete(self) -> bool:
        """Whether every participant is known, with all it has; False where they cannot be counted."""
        now = time.monotonic()
        known, nodes = self._known(), self.nodes()
        services = [participant.node.get_service_names_and_types() for participant in self.participants]
        seen = (known, nodes, services)
        if seen != self._seen:
            self._seen, self._seen_s = seen, now
        is_all = len(known) >= self._count() and nodes.total() >= len(known)  # each has a node at least
        return self._can_count and is_all and now - self._seen_s >= _SETTLED_S

    def hurry(self) -> None:
        """Speak anew, when it is time and somebody is there whom we do not know."""
        is_due = time.monotonic() >= self._spoken_s + _SPOKEN_S
        if is_due and len(self.participants) < self._most_speakers and len(self._known()) < self._count():
            self._speak()

    def other_sockets(self) -> frozenset[str]:
        """The discovery sockets of other processes, by inode; none where participants cannot be counted."""
        found = discovery_sockets(self.domain) if self._can_count else []
        return frozenset(socket.inode for socket in found) - udp_sockets().keys()

    def close(self) -> None:
        """Leave the graph."""
        while self.participants:
            context, node, executor = self.participants.pop()
            executor.shutdown(timeout_sec=0)
            node.destroy_node()
            context.try_shutdown()

    def _speak(self) -> None:
        context = Context()
        rclpy.init(context=context, args=list(NO_LOG_FILES))  # a short life: nothing to look up later
        name = f"mauve_{os.getpid()}" + (f"_{len(self.participants)}" if self.participants else "")
        node = Node(name, context=context, enable_rosout=False, start_parameter_services=False)
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(node)
        self.participants.append(Participant(context, node, executor))
        self._spoken_s = time.monotonic()

    def _known(self) -> frozenset[bytes]:
        """The participants known to any of ours, ours among them: each ROS one writes this topic."""
        topic = "ros_discovery_info"
        writers = [
            writer
            for participant in self.participants
            for writer in participant.node.get_publishers_info_by_topic(topic, no_mangle=True)
        ]
        return frozenset(bytes(writer.endpoint_gid[:_KEY_BYTES]) for writer in writers)

    def _count(self) -> int:
        """How many participants this machine has in our domain."""
        return len({socket.port for socket in discovery_sockets(self.domain)}) if self._can_count else 0


def _most_speakers() -> int:
    """As many as the process may open files for, and one at least."""
    limit, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    if limit == resource.RLIM_INFINITY:
        return _MAX_SPEAKERS
    return max(1, min(_MAX_SPEAKERS, (limit - _FILES_OF_PROCESS) // _FILES_OF_SPEAKER))
