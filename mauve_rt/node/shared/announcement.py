"""The first announcement of a program that stays on this machine, so that no answer to it is lost.

A participant of Fast DDS announces itself to one port of 127.0.0.1 after another, and receives only then. An
answer that comes before is lost, and the next announcement of the other participant comes up to 3 s later.
Upwards from the first port, as Fast DDS does by itself, about every second answer was lost (measured): the
participants of a machine have the first ports. So these programs announce themselves from the last port to
the first. The ports depend on the ROS domain: a file that exists while Fast DDS reads it gives the order.
"""

import os
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from mauve_rt.node.shared.discovery import PROFILES, has_own_profile
from mauve_rt.node.shared.domain import domain
from mauve_rt.node.shared.rtps_ports import discovery_ports

_PARTICIPANTS = 32  # as the profiles have it
_PEERS = "<locator><udpv4><address>127.0.0.1</address></udpv4></locator>"
_PEER = "<locator><udpv4><address>127.0.0.1</address><port>{}</port></udpv4></locator>"


@contextmanager
def first_participant() -> Iterator[None]:
    """Make the first DDS participant of this process inside of it; the environment is for children as before.

    Where the program reaches further, or the user has a profile, this changes nothing. No other thread may
    read the environment as it begins or ends.
    """
    with ExitStack() as stack:
        if has_own_profile():
            own = os.environ[PROFILES]
            if path := stack.enter_context(_written(_downwards(Path(own).read_text("utf-8"), domain()))):
                os.environ[PROFILES] = path
                stack.callback(os.environ.__setitem__, PROFILES, own)
        yield


def _downwards(profile: str, domain: int) -> str:
    """The profile with the ports of the first participants of a domain as peers, the last of them first."""
    ports = reversed(discovery_ports(domain, _PARTICIPANTS))
    return profile.replace(_PEERS, "".join(map(_PEER.format, ports)))


@contextmanager
def _written(text: str) -> Iterator[str]:
    """The path of a temporary file with this text; "" where no file can be written."""
    folder = os.environ.get("TMPDIR") or "/tmp"  # noqa: S108 - the name cannot be guessed, and is never reused
    path = Path(folder, f"mauve_{os.getpid()}_{os.urandom(8).hex()}.xml")
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except OSError:
        path.unlink(missing_ok=True)
        yield ""
        return
    try:
        yield str(path)
    finally:
        path.unlink(missing_ok=True)
