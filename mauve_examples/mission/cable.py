"""The link of a mission whose two robots are on machines of their own: a cable, no process."""

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from mauve_examples.mission.architecture import heard_from
from mauve_examples.mission.demo_errors import BadInputError
from mauve_examples.mission.demo_options import Options
from mauve_examples.mission.hosts import Hosts, HostsError


class RobotCable:
    """Between two robots; what the demo cuts and mends."""

    def __init__(self, hosts: Hosts, robots: Sequence[str]) -> None:
        """Of machines that have the robots' names."""
        self._hosts = hosts
        self._robots = list(robots)

    def heard_by(self, robot: str) -> str:
        """The topic by which a robot hears the other one."""
        [peer] = (name for name in self._robots if name != robot)
        return heard_from(peer)

    def set_link(self, *, up: bool) -> None:
        """Plug it in, or pull it out."""
        self._hosts.set_link(self._robots[-1], up=up)

    def wrapper(self, robot: str) -> list[str]:
        """What goes before a command line to run it on a robot's machine."""
        return self._hosts.wrapper(robot)


@contextmanager
def open_cable(options: Options) -> Iterator[RobotCable | None]:
    """The cable for as long as the mission lasts, this process in reach of all machines; None: no --hosts.

    Before anything of ROS was made.

    Raises:
        BadInputError: such machines cannot be made here.
    """
    if not options.hosts:
        yield None
        return
    hosts = None
    try:
        hosts = Hosts(options.names)
        hosts.connect_ground()
        os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "SUBNET"  # of these cables, which end here
        yield RobotCable(hosts, options.names)
    except HostsError as error:
        raise BadInputError(f"--hosts: {error}") from None
    finally:
        if hosts is not None:
            hosts.close()
