"""What the air between the robots does to a message, without ROS."""

import random
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass
class Counts:
    """Deliveries: one message to one receiver."""

    forwarded: int = 0
    dropped_link_down: int = 0
    dropped_at_random: int = 0


class Medium:
    """What the air does to a message; equal seeds and equal traffic lose the same messages."""

    def __init__(self, robots: Sequence[str], *, drop_share: float, seed: int) -> None:
        self.robots = list(robots)
        self.drop_share = drop_share
        self.link_up = True
        self.counts = Counts()
        self._random = random.Random(seed)  # noqa: S311 - a simulation, no secret

    def receivers(self, sender: str) -> list[str]:
        """Who gets the next message of `sender`; what the others miss is counted."""
        reached = []
        for robot in self.robots:
            if robot == sender:
                continue
            if not self.link_up:
                self.counts.dropped_link_down += 1
            elif self._random.random() < self.drop_share:
                self.counts.dropped_at_random += 1
            else:
                self.counts.forwarded += 1
                reached.append(robot)
        return reached
