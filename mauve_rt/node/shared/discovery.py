"""How far ROS discovery reaches: this machine, unless the environment says otherwise."""

import filecmp
import os
from pathlib import Path

RANGE, LOCALHOST_ONLY = "ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_LOCALHOST_ONLY"
PROFILES = "FASTRTPS_DEFAULT_PROFILES_FILE"
_PEERS, _SERVER = "ROS_STATIC_PEERS", "ROS_DISCOVERY_SERVER"
_BEYOND = ("SUBNET", "SYSTEM_DEFAULT")
# Profiles of Fast DDS that bind to loopback: with shared memory, and without it.
PROFILE, UDP_PROFILE = (Path(__file__).with_name(name) for name in ("local.xml", "local_udp.xml"))
# Those that reach further, and do not wait for a network interface: the same two.
OPEN_PROFILE, OPEN_UDP_PROFILE = (Path(__file__).with_name(name) for name in ("open.xml", "open_udp.xml"))


def limit_discovery() -> None:
    """Stay on this machine unless the environment says how far to reach; so do the children of this process.

    At the start of a program: `rclpy.init` reads what this sets, and no thread may be there that reads the
    environment while this runs. rcl takes an empty value for none.
    """
    if not _is_localhost_only() and not os.environ.get(RANGE):
        os.environ[RANGE] = "LOCALHOST"


def opened_by() -> str:
    """The settings that let discovery reach beyond this machine; "" where there are none."""
    reach = os.environ.get(RANGE) or "LOCALHOST"
    if has_own_profile():
        return ""
    server = [f"{_SERVER}={os.environ[_SERVER]}"] if os.environ.get(_SERVER) else []
    if _is_localhost_only() or reach == "OFF":
        return ", ".join(server)
    peers = [f"{_PEERS}={os.environ[_PEERS]}"] if os.environ.get(_PEERS) else []
    is_open = reach in _BEYOND or peers or server
    return ", ".join([f"{RANGE}={reach}", *peers, *server]) if is_open else ""


def stays_on_this_machine() -> bool:
    """Whether discovery finds the participants of this machine, and no others."""
    is_local = _is_localhost_only() or os.environ.get(RANGE) == "LOCALHOST" or has_own_profile()
    return is_local and not (is_off() or opened_by())


def is_off() -> bool:
    """Whether discovery finds nobody at all."""
    return os.environ.get(RANGE) == "OFF" and not _is_localhost_only()


def has_own_profile() -> bool:
    """Whether the environment names a profile that binds to loopback, by the user or a parent."""
    return _is_named(PROFILE, UDP_PROFILE)


def has_open_profile() -> bool:
    """Whether it names one of the project's that reach further."""
    return _is_named(OPEN_PROFILE, OPEN_UDP_PROFILE)


def without_shared_memory() -> dict[str, str]:
    """The variables for a child that uses no shared memory; none where the profile is the user's own."""
    for with_memory, without in ((PROFILE, UDP_PROFILE), (OPEN_PROFILE, OPEN_UDP_PROFILE)):
        if _is_named(with_memory):
            return {PROFILES: str(without)}
    return {}


def _is_named(*own: Path) -> bool:
    path = os.environ.get(PROFILES, "")
    return path != "" and any(_is_same(path, each) for each in own)


def _is_localhost_only() -> bool:
    return os.environ.get(LOCALHOST_ONLY) == "1"  # to rcl this one is above all others


def _is_same(path: str, own: Path) -> bool:
    try:
        return filecmp.cmp(path, own, shallow=False)  # the installed one is a copy
    except OSError:
        return False
