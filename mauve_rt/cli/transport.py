"""How `mauve` reaches executors of every account on this machine: by UDP, and how it finds them at once.

On one machine Fast DDS prefers shared memory, whose files nobody but their owner may write (mode 0644).
An ordinary user's node and root's discover each other by UDP, and then neither hears a word of the other.
Who has UDP alone is spoken to by UDP. On this machine only, that is by the profile `local_udp.xml`.

A participant first announces itself to each port that its profile names, and listens only then. An answer
that comes before is lost: with the 32 ports of the profile, about every second one (measured). So the first
participant announces itself to those ports only that participants of this machine have.
"""

import os
import pwd
import re
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from tempfile import NamedTemporaryFile

from rclpy.utilities import get_rmw_implementation_identifier

from mauve_rt.cli.rtps_ports import UDP_TABLE, discovery_ports, discovery_sockets
from mauve_rt.errors import ParameterError
from mauve_rt.node.shared.discovery import PROFILES, UDP_PROFILE
from mauve_rt.node.shared.domain import domain
from mauve_rt.node.shared.loopback import (
    LoopbackError,
    loopback_environment,
    set_environment,
    users_profile,
)

_TRANSPORTS = "FASTDDS_BUILTIN_TRANSPORTS"
_MEMORY = Path("/dev/shm")  # noqa: S108 - not ours: Fast DDS's
_FIRST_PORT, _DOMAIN_PORTS, _MAX_PARTICIPANTS = 7411, 250, 120  # of data by unicast, in RTPS


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


@contextmanager
def announced_to_those_present() -> Iterator[None]:
    """Inside of by_udp(): the first participant of this process announces itself to those that there are."""
    is_local = os.environ.get(PROFILES) == str(UDP_PROFILE) and UDP_TABLE.exists()
    with ExitStack() as stack:
        if is_local and (path := stack.enter_context(_written(profile_for_those_present(domain())))):
            os.environ[PROFILES] = path
            stack.callback(os.environ.__setitem__, PROFILES, str(UDP_PROFILE))  # for children, too
        yield


@contextmanager
def _written(text: str) -> Iterator[str]:
    """The path of a temporary file with this text; "" where no file can be written."""
    with ExitStack() as stack:
        path = ""
        with suppress(OSError):
            file = stack.enter_context(NamedTemporaryFile(mode="w", prefix="mauve_", suffix=".xml"))
            file.write(text)
            file.flush()
            path = file.name
        yield path


def profile_for_those_present(domain: int) -> str:
    """The profile `local_udp.xml` with as few ports as reach each participant of this machine in a domain."""
    ports = discovery_ports(domain)
    count = max((ports.index(socket.port) + 1 for socket in discovery_sockets(domain)), default=1)
    text = UDP_PROFILE.read_text(encoding="utf-8")
    return re.sub("(<maxInitialPeersRange>)[0-9]+", rf"\g<1>{count}", text)


def accounts_in_the_way(domain: int) -> list[str]:
    """Other accounts whose processes in a ROS domain have shared memory that this one may not use."""
    first = _FIRST_PORT + _DOMAIN_PORTS * domain
    locks = (_MEMORY / f"sem.fastrtps_port{first + 2 * number}_mutex" for number in range(_MAX_PARTICIPANTS))
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
