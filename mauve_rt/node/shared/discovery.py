"""How far ROS discovery reaches: this machine, unless the environment says otherwise."""

import os

_RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
_BEYOND = ("SUBNET", "SYSTEM_DEFAULT")


def limit_discovery() -> str:
    """Stay on this machine unless the environment says how far to reach; returns what to tell, or nothing.

    For each of our programs, at its start: `rclpy.init` reads what this sets, and no thread may be there that
    reads the environment meanwhile. rcl takes an empty value for none, and ROS_LOCALHOST_ONLY=1 is above all
    others to it.
    """
    if os.environ.get("ROS_LOCALHOST_ONLY") == "1":
        return ""
    chosen = not os.environ.get(_RANGE)
    if chosen:
        os.environ[_RANGE] = "LOCALHOST"
    reach = os.environ[_RANGE]
    peers = os.environ.get("ROS_STATIC_PEERS") if reach != "OFF" else None
    if reach in _BEYOND or peers:
        where = f"{_RANGE}={reach}" + (f", ROS_STATIC_PEERS={peers}" if peers else "")
        return f"discovery beyond this machine ({where}): without DDS Security anyone there can reconfigure"
    return f"discovery on this machine only; {_RANGE} can widen it" if chosen else ""


def stays_on_this_machine() -> bool:
    """Whether the environment keeps discovery to this machine, and to nothing else."""
    is_local = os.environ.get(_RANGE) == "LOCALHOST" or os.environ.get("ROS_LOCALHOST_ONLY") == "1"
    return is_local and not (os.environ.get("ROS_STATIC_PEERS") or os.environ.get("ROS_DISCOVERY_SERVER"))
