"""How `mauve` reaches executors of every account on this machine: by UDP.

On one machine Fast DDS prefers shared memory, whose files nobody but their owner may write (mode 0644).
An ordinary user's node and root's discover each other by UDP, and then neither hears a word of the other.
Who has UDP alone is spoken to by UDP. On this machine only, that is by the profile `local_udp.xml`.
"""

import os
import pwd
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rclpy.utilities import get_rmw_implementation_identifier

from mauve_rt.errors import ParameterError
from mauve_rt.node.shared.loopback import (
    LoopbackError,
    loopback_environment,
    set_environment,
    users_profile,
)
from mauve_rt.node.shared.rtps_ports import MAX_PARTICIPANTS, discovery_ports

_TRANSPORTS = "FASTDDS_BUILTIN_TRANSPORTS"
_MEMORY = Path("/dev/shm")  # noqa: S108 - not ours: Fast DDS's


def by_fast_dds() -> bool:
    """Whether the ROS middleware is Fast DDS."""
    return get_rmw_implementation_identifier().startswith("rmw_fastrtps")


@contextmanager
def by_udp() -> Iterator[None]:
    """Participants made in it speak UDP alone, if they are Fast DDS's and the user chose nothing else.

    On this machine only, they are bound to loopback. For the first participant of a process, and with it all
    others: Fast DDS reads profiles once.

    Raises:
        ParameterError: the middleware cannot be bound to loopback.
    """
    wanted = _wanted()
    before = {name: os.environ.get(name) for name in wanted}
    try:
        set_environment(wanted)
        yield
    finally:
        set_environment(before)


def accounts_in_the_way(domain: int) -> list[str]:
    """Other accounts whose processes in a ROS domain have shared memory that this one may not use."""
    ports = (port + 1 for port in discovery_ports(domain, MAX_PARTICIPANTS))  # of their data
    locks = (_MEMORY / f"sem.fastrtps_port{port}_mutex" for port in ports)
    owners = {
        lock.stat().st_uid for lock in locks if lock.exists() and not os.access(lock, os.R_OK | os.W_OK)
    }
    return sorted(map(_account, owners))


def _wanted() -> dict[str, str | None]:
    """What to have in the environment, and what not."""
    try:
        bound = loopback_environment(shared_memory=False)
    except LoopbackError as error:
        raise ParameterError(str(error)) from None
    if bound:
        return bound
    chose = not by_fast_dds() or users_profile() or os.environ.get(_TRANSPORTS)
    return {} if chose else {_TRANSPORTS: "UDPv4"}


def _account(user_id: int) -> str:
    try:
        return pwd.getpwuid(user_id).pw_name
    except KeyError:
        return str(user_id)
