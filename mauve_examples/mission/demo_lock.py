"""One mission at a time on a ROS domain of this machine."""

import os
import socket

from mauve_examples.mission.demo_errors import BadInputError


class MissionLock:
    """Held as long as this object or a process that inherited `fd` lives, and gone with the last of them.

    It is a socket in Linux' abstract namespace: no file is left behind, whoever dies and however.
    """

    def __init__(self) -> None:
        """Take the lock of the ROS domain.

        Raises:
            BadInputError: a mission is running, or a process of one is still there.
        """
        self._domain = os.environ.get("ROS_DOMAIN_ID") or "0"
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            self._socket.bind(f"\0mauve-mission-{self._domain}")
        except OSError:
            self._socket.close()
            raise busy(f"ROS domain {self._domain}") from None

    @property
    def fd(self) -> int:
        """To be inherited by the mission's processes."""
        return self._socket.fileno()

    def release(self) -> None:
        """Let the next mission begin, once no process has it any more."""
        self._socket.close()


def busy(where: str) -> BadInputError:
    """The error that tells what to do."""
    return BadInputError(
        f"another mission is running ({where}): wait for its end, or set another ROS_DOMAIN_ID"
    )
