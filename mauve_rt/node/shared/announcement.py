"""The first DDS participant of a program: its waits, its shared memory, and how it gets every answer.

A participant of Fast DDS announces itself to one port of 127.0.0.1 after another, and receives only then. An
answer that comes before is lost, and the next announcement of the other participant comes up to 3 s later.
Upwards from the first port, as Fast DDS does by itself, about every second answer was lost (measured): the
participants of a machine have the first ports. So these programs announce themselves from the last port to
the first. The ports depend on the ROS domain: a file that exists while Fast DDS reads it gives the order.
"""

import os
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from mauve_rt.node.shared.discovery import PROFILES, has_own_profile
from mauve_rt.node.shared.domain import domain
from mauve_rt.node.shared.rtps_ports import discovery_ports
from mauve_rt.scratch import scratch_folders
from mauve_rt.unfinished import discard

_MEMORY = "/dev/shm/fastrtps_"  # noqa: S108 - Fast DDS's
_PARTICIPANTS = 32  # as the profiles have it
_PEERS = "<locator><udpv4><address>127.0.0.1</address></udpv4></locator>"
_PEER = "<locator><udpv4><address>127.0.0.1</address><port>{}</port></udpv4></locator>"


@contextmanager
def first_participant() -> Iterator[None]:
    """Make the first DDS participant of this process inside of it; the environment is for children as before.

    Other accounts cannot read its files in /dev/shm: they hold the messages. Other accounts cannot use shared
    memory anyway, which they would have to write. The announcement changes only where the program stays on
    this machine by its own profile. No other thread may read the environment meanwhile.

    Fast DDS waits by the monotonic clock: a step of the wall clock holds up no message and no service.
    """
    from mauve_rt._bridge import wait_by_the_monotonic_clock  # noqa: PLC0415 - loads libraries of ROS

    wait_by_the_monotonic_clock()
    with ExitStack() as stack:
        if has_own_profile():
            own = os.environ[PROFILES]
            if path := stack.enter_context(_written(_downwards(Path(own).read_text("utf-8"), domain()))):
                os.environ[PROFILES] = path
                stack.callback(os.environ.__setitem__, PROFILES, own)
        yield
    _close_memory()


def _close_memory() -> None:
    """Fast DDS gives its files mode 0644, whatever the umask is."""
    with suppress(OSError):  # no /proc
        mapped = Path("/proc/self/maps").read_text("utf-8").split()
        for path in {word for word in mapped if word.startswith(_MEMORY)}:
            with suppress(OSError):  # of another account, or gone
                Path(path).chmod(0o600)


def _downwards(profile: str, domain: int) -> str:
    """The profile with the ports of the first participants of a domain as peers, the last of them first."""
    ports = reversed(discovery_ports(domain, _PARTICIPANTS))
    return profile.replace(_PEERS, "".join(map(_PEER.format, ports)))


@contextmanager
def _written(text: str) -> Iterator[str]:
    """The path of a temporary file with this text; "" where no file can be written."""
    name = f"mauve_{os.getpid()}_{os.urandom(8).hex()}.xml"  # cannot be guessed, and is never reused
    path = next((path for folder in scratch_folders() if _is_written(path := folder / name, text)), None)
    try:
        yield str(path or "")
    finally:
        if path is not None:
            discard(path)


def _is_written(path: Path, text: str) -> bool:
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except OSError:
        discard(path)
        return False
    return True
