"""Programs that stay on this machine bind their UDP sockets to its loopback interface, 127.0.0.1.

The range LOCALHOST alone does not: rmw_fastrtps asks nobody elsewhere then, but listens on every address and
answers anyone who asks. A white list of Fast DDS binds the sockets, and only a profile can give it. With the
range LOCALHOST rmw_fastrtps adds a transport without the white list to every profile. So the range becomes
SYSTEM_DEFAULT, and the profile `local.xml` does all that LOCALHOST does. Nodes of this machine that reach
further still find the program: it announces itself to the ports of 127.0.0.1, where they listen, too.
"""

import os
import re
import socket
import struct
from pathlib import Path
from typing import Any, NamedTuple

from mauve_rt.node.shared.discovery import (
    LOCALHOST_ONLY,
    OPEN_PROFILE,
    OPEN_UDP_PROFILE,
    PROFILE,
    PROFILES,
    RANGE,
    UDP_PROFILE,
    has_open_profile,
    has_own_profile,
    is_off,
    limit_discovery,
    opened_by,
    stays_on_this_machine,
)
from mauve_rt.node.shared.shared_memory import shared_memory_problem

_OTHER_PROFILES, _TRANSPORTS = "FASTDDS_DEFAULT_PROFILES_FILE", "FASTDDS_BUILTIN_TRANSPORTS"
_FILE_HERE = Path("DEFAULT_FASTRTPS_PROFILES.xml")  # which Fast DDS reads from the current folder
_MIDDLEWARE, _FAST_DDS = "RMW_IMPLEMENTATION", "rmw_fastrtps"
_SELF = Path("/proc/self")
_IPV4_DIGITS = 8
_SECURED = ("true", "Enforce")
_WAITING = "a network interface that stands still can hold up every topic, also on this machine: {}"
_UDP, _NON_BLOCKING = r"<type>\s*UDPv[46]\s*</type>", r"<non_blocking_send>\s*true\s*</non_blocking_send>"


class LoopbackError(Exception):
    """A program that stays on this machine cannot bind its sockets to loopback; says what to set."""


class Reach(NamedTuple):
    """How far a program reaches, as its sockets have it, and who reaches it."""

    text: str
    access: str

    def log(self, logger: Any) -> None:
        """Write it to the log of a node."""
        logger.info(self.text)
        if waits := waiting_transport():
            logger.warning(_WAITING.format(waits))


def keep_to_this_machine() -> None:
    """Stay on this machine, bound to loopback, unless the environment says how far to reach.

    Once, at the start of a program, before its first ROS context; for every context after it, and for the
    children of this process, too. No thread may be there that reads the environment while this runs.

    Raises:
        LoopbackError: the middleware cannot be bound so.
    """
    limit_discovery()
    set_environment(loopback_environment() or open_environment())


def loopback_environment(*, shared_memory: bool = True) -> dict[str, str | None]:
    """The variables that bind to loopback (None: to be removed); none where the program reaches further.

    A profile of the user's own is left alone: `reach` refuses one that binds other addresses.

    Raises:
        LoopbackError: the middleware cannot be bound so.
    """
    if not (stays_on_this_machine() or is_off()):
        return {}
    middleware = os.environ.get(_MIDDLEWARE) or _FAST_DDS
    if not middleware.startswith(_FAST_DDS):
        if is_off():
            return {}
        raise LoopbackError(
            f"{_MIDDLEWARE}={middleware} cannot be bound to loopback from here, so other machines could "
            f"reconfigure in spite of {RANGE}=LOCALHOST. Set {_MIDDLEWARE}=rmw_fastrtps_cpp, or "
            f"{RANGE}=SUBNET to let other machines in."
        )
    if users_profile():
        return {}
    by_udp = not shared_memory or os.environ.get(_TRANSPORTS) == "UDPv4" or shared_memory_problem()
    profile: dict[str, str | None] = {PROFILES: str(UDP_PROFILE if by_udp else PROFILE)}
    return profile if is_off() else profile | {RANGE: "SYSTEM_DEFAULT", LOCALHOST_ONLY: None}


def open_environment() -> dict[str, str | None]:
    """The variables with which a program that reaches further does not wait for a network interface.

    None where they cannot be had: with another middleware, with transports or a profile of the user's own,
    and with the range LOCALHOST, where rmw_fastrtps adds a transport of its own.
    """
    is_fast_dds = (os.environ.get(_MIDDLEWARE) or _FAST_DDS).startswith(_FAST_DDS)
    transports = os.environ.get(_TRANSPORTS) or ""
    reaches = os.environ.get(RANGE) in ("SUBNET", "SYSTEM_DEFAULT") and not stays_on_this_machine()
    if not is_fast_dds or not reaches or users_profile() or transports not in ("", "UDPv4"):
        return {}
    return {PROFILES: str(OPEN_UDP_PROFILE if transports or shared_memory_problem() else OPEN_PROFILE)}


def waiting_transport() -> str:
    """Why a send may wait for a network interface that stands still; "" where it does not."""
    if has_own_profile() or has_open_profile():
        return ""
    profile = users_profile()
    if not profile:
        remedy = f"; set {RANGE}=SUBNET" if os.environ.get(RANGE) == "LOCALHOST" else ""
        return "" if is_off() else f"the transports of this program are not the project's{remedy}"
    file = profile.partition("=")[2] or profile
    try:
        text = Path(file).read_text("utf-8", errors="replace")
    except OSError:
        text = ""
    udp, ready = (len(re.findall(pattern, text)) for pattern in (_UDP, _NON_BLOCKING))
    if udp and udp == ready:
        return ""
    return f"{profile} has no <non_blocking_send>true</non_blocking_send> for each UDP transport"


def users_profile() -> str:
    """The user's own profile of Fast DDS, by what sets it; "" where there is none."""
    for name in (PROFILES, _OTHER_PROFILES):
        if os.environ.get(name) and not (name == PROFILES and (has_own_profile() or has_open_profile())):
            return f"{name}={os.environ[name]}"
    return str(_FILE_HERE.absolute()) if _FILE_HERE.exists() else ""


def set_environment(variables: dict[str, str | None]) -> None:
    """Set variables of the environment, and remove those that are None."""
    for name, value in variables.items():
        if value is None:
            os.environ.pop(name, None)
        else:
            os.environ[name] = value


def udp_sockets(process: Path = _SELF) -> dict[str, str]:
    """The addresses that the UDP sockets of a process are bound to, by inode; none where /proc is missing."""
    return {row[9]: _address(row[1].partition(":")[0]) for row in _udp_rows(process)}


def udp_backlog(process: Path = _SELF) -> int:
    """What the UDP sockets of a process have sent and the network interface has not, in bytes of memory."""
    return sum(int(row[4].partition(":")[0], 16) for row in _udp_rows(process))


def _udp_rows(process: Path) -> list[list[str]]:
    """The lines of the kernel's tables about the sockets that a process holds, in words."""
    try:
        held = {_target(link) for link in (process / "fd").iterdir()}
        tables = [process / "net" / name for name in ("udp", "udp6")]
        lines = [line for table in tables if table.exists() for line in table.read_text("ascii").splitlines()]
    except OSError:
        return []
    rows = [line.split() for line in lines]  # a heading has no socket of ours
    return [row for row in rows if f"socket:[{row[9]}]" in held]


def reach(before: dict[str, str]) -> Reach:
    """How far the program reaches by the sockets that it has, but for those it had before its node.

    Raises:
        LoopbackError: they are to be bound to loopback and are not, by whatever profile.
    """
    now = udp_sockets()
    addresses = sorted({now[inode] for inode in now.keys() - before.keys()})
    bound = f"UDP bound to {', '.join(addresses) or 'no address'}"
    if addresses and all(address.startswith("127.") for address in addresses):
        return Reach(f"on this machine only: {bound}; {RANGE}=SUBNET lets other machines in", _access(""))
    if has_own_profile() and addresses:
        raise LoopbackError(
            f"{bound} in spite of {PROFILES}={os.environ[PROFILES]}; is this file readable XML?"
        )
    opened = opened_by()
    if opened:
        text = f"discovery beyond this machine ({opened}): without DDS Security anyone there can reconfigure"
        return Reach(f"{text}; {bound}", _access(opened))
    profile = users_profile()
    if profile and addresses:
        raise LoopbackError(
            f"not on this machine only: {bound}, as {profile} takes the place of the project's profile, so "
            f"other machines could reconfigure. Set {RANGE}=SUBNET to let them in, unset the profile, or "
            f"set {RANGE}=SYSTEM_DEFAULT and give it the transports of share/mauve_rt/dds/local.xml."
        )
    return Reach(f"discovery stays on this machine; {bound}", _access(""))


def _access(opened: str) -> str:
    if (os.environ.get("ROS_SECURITY_ENABLE"), os.environ.get("ROS_SECURITY_STRATEGY")) == _SECURED:
        return "who has a certificate and permissions of its DDS Security"
    others = f", and every machine that reaches it ({opened})" if opened else ""
    return f"every account of this machine{others}"


def _target(link: Path) -> str:
    try:
        return str(link.readlink())
    except OSError:  # closed since
        return ""


def _address(digits: str) -> str:
    if len(digits) == _IPV4_DIGITS:
        return socket.inet_ntop(socket.AF_INET, struct.pack("=I", int(digits, 16)))
    words = [int(word, 16) for word in re.findall("." * _IPV4_DIGITS, digits)]
    return socket.inet_ntop(socket.AF_INET6, struct.pack("=4I", *words))
