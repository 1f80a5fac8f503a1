"""How `mauve` reaches executors of every account on this machine: by UDP.

On one machine Fast DDS prefers shared memory, whose files nobody but their owner may write (mode 0644).
An ordinary user's node and root's discover each other by UDP, and then neither hears a word of the other.
Who has UDP alone is spoken to by UDP. Where discovery is limited to LOCALHOST, rmw_fastrtps adds shared
memory of its own accord, whatever a profile says: so the range is SYSTEM_DEFAULT, and `local_udp.xml`
says what LOCALHOST would.
"""

import os
import pwd
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rclpy.utilities import get_rmw_implementation_identifier

from mauve_rt.node.shared.discovery import stays_on_this_machine

PROFILE = Path(__file__).parent / "local_udp.xml"
_RANGE, _LOCALHOST_ONLY = "ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_LOCALHOST_ONLY"
_PROFILES, _TRANSPORTS = "FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_BUILTIN_TRANSPORTS"
_CHOSEN = (_PROFILES, "FASTDDS_DEFAULT_PROFILES_FILE", _TRANSPORTS)  # by which users say what they want
_USERS_PROFILES = Path("DEFAULT_FASTRTPS_PROFILES.xml")  # which Fast DDS reads from the current folder
_MEMORY = Path("/dev/shm")  # noqa: S108 - not ours: Fast DDS's
_FIRST_PORT, _DOMAIN_PORTS, _MAX_PARTICIPANTS = 7411, 250, 120  # of data by unicast, in RTPS


def by_fast_dds() -> bool:
    """Whether the ROS middleware is Fast DDS."""
    return get_rmw_implementation_identifier().startswith("rmw_fastrtps")


@contextmanager
def by_udp() -> Iterator[None]:
    """Participants made meanwhile speak UDP alone, if they are Fast DDS's and the user chose nothing else.

    For the first participant of a process, and with it all others: Fast DDS reads profiles once.
    """
    wanted = _wanted()
    before = {name: os.environ.get(name) for name in wanted}
    try:
        _set(wanted)
        yield
    finally:
        _set(before)


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
    if not by_fast_dds() or _USERS_PROFILES.exists() or any(map(os.environ.get, _CHOSEN)):
        return {}
    if stays_on_this_machine():
        return {_RANGE: "SYSTEM_DEFAULT", _LOCALHOST_ONLY: None, _PROFILES: str(PROFILE)}
    return {_TRANSPORTS: "UDPv4"}


def _set(environment: dict[str, str | None]) -> None:
    for name, value in environment.items():
        if value is None:
            os.environ.pop(name, None)
        else:
            os.environ[name] = value


def _account(user_id: int) -> str:
    try:
        return pwd.getpwuid(user_id).pw_name
    except KeyError:
        return str(user_id)
