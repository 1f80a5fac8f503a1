"""Whether /dev/shm has room: a library that writes into a full one ends the process with SIGBUS."""

import os
import sys
from collections.abc import Sequence
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType

_FOLDER = Path("/dev/shm")  # noqa: S108 - not ours: Fast DDS's and LTTng's
_LEAST_BYTES = 4 << 20  # a participant has a segment of 0.55 MB and ports; Linux takes the pages as they fill
_LEAST_OF_ROS_BYTES = 64 << 10  # LTTng, which rcl loads, reads a page of each of its files
_FILES_OF_ROS = ("lttng-ust-wait-[0-9]", f"lttng-ust-wait-[0-9]-{os.getuid()}")
_ROS = ("rclpy", "mauve_rt._bridge")
_REMEDY = (
    "Delete files there (mauve doctor names those of dead processes), or start the container with "
    "--shm-size=256m."
)


def shared_memory_problem() -> str:
    """Why Fast DDS uses UDP in place of shared memory, and the remedy; "" where there is room.

    Fast DDS itself does without a folder that is missing or read-only.
    """
    if _free_bytes() >= _LEAST_BYTES:
        return ""
    return f"{_found(_LEAST_BYTES)} This run uses UDP instead. {_REMEDY}"


def no_room_for_ros() -> str:
    """Why ROS cannot be loaded at all, and the remedy; "" where it can."""
    if _free_bytes() >= _LEAST_OF_ROS_BYTES or all(map(_has_page, _FILES_OF_ROS)):
        return ""
    return f"{_found(_LEAST_OF_ROS_BYTES)} Libraries of ROS would end this process. {_REMEDY}"


def refuse_ros_without_room() -> None:
    """Have each import of ROS raise a ParameterError where its libraries would end the process."""
    if no_room_for_ros():
        sys.meta_path.insert(0, _NoRos())


class _NoRos:
    """A finder that finds no module, and refuses those of ROS."""

    @staticmethod
    def find_spec(
        name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """As importlib calls it."""
        del path, target
        if name in _ROS:
            from mauve_rt.errors import ParameterError  # noqa: PLC0415 - loads the kernel

            raise ParameterError(no_room_for_ros())
        return None


def _has_page(pattern: str) -> bool:
    """Whether an earlier program of this account had LTTng's file written."""
    return any(file.stat().st_blocks for file in _FOLDER.glob(pattern))


def _found(least: int) -> str:
    least_kib, free_kib = least >> 10, _free_bytes() / 1024
    return f"shared memory {_FOLDER}: expected {least_kib:,} KiB free, found {free_kib:,.0f} KiB."


def _free_bytes() -> float:
    try:
        found = os.statvfs(_FOLDER)
    except OSError:
        return float("inf")
    return float("inf") if found.f_flag & os.ST_RDONLY else found.f_bavail * found.f_frsize
