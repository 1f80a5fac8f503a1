"""TransformBuffer against scipy's rotations: random trees, times and lookups."""

from itertools import pairwise
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from mauve_msgs.msg import TransformOutcome
from mauve_rt._kernel import TRANSFORM_OUTCOMES
from mauve_rt.api import TransformBuffer

TREES = 10_000
LOOKUPS = 2
TOLERANCE = 1e-12

Pose = tuple[Any, Any]


class Frame:
    """A frame of the oracle: its parent and its transforms by time."""

    def __init__(self, parent: int, times: list[int], positions: Any, turns: Any) -> None:
        self.parent, self.times, self.positions, self.turns = parent, times, positions, turns

    def at(self, time: int) -> Pose | None:
        """Position and rotation at a time; None: outside the interval."""
        if not self.times:  # static
            return self.positions[0], Rotation.from_quat(self.turns[0])
        if not self.times[0] <= time <= self.times[-1]:
            return None
        if time in self.times:
            place = self.times.index(time)
            return self.positions[place], Rotation.from_quat(self.turns[place])
        [place] = [i for i, (a, b) in enumerate(pairwise(self.times)) if a < time < b]
        a, b = self.times[place : place + 2]
        part = (time - a) / (b - a)
        position = self.positions[place] * (1 - part) + self.positions[place + 1] * part
        return position, Slerp([0, 1], Rotation.from_quat(self.turns[place : place + 2]))(part)


def _random_tree(random: np.random.Generator) -> tuple[TransformBuffer, list[Frame | None]]:
    buffer = TransformBuffer(frames=8, history=4)
    frames: list[Frame | None] = [None]
    for child in range(1, int(random.integers(2, 7))):
        parent = int(random.integers(child))
        is_static = random.random() < 0.25
        times = [] if is_static else sorted({int(each) for each in random.integers(1, 1000, 3)})
        count = max(len(times), 1)
        positions = random.normal(size=(count, 3))
        turns = random.normal(size=(count, 4))
        turns /= np.linalg.norm(turns, axis=1, keepdims=True)
        frames.append(Frame(parent, times, positions, turns))
        for time, position, turn in zip(times or [0], positions, turns, strict=True):
            outcome = buffer.set(f"f{parent}", f"f{child}", position, turn, time_ns=time, is_static=is_static)
            assert outcome == "done"
    return buffer, frames


def _above(frames: list[Frame | None], frame: int) -> list[int]:
    chain = [frame]
    while (found := frames[chain[-1]]) is not None:
        chain.append(found.parent)
    return chain


def _to_ancestor(frames: list[Frame | None], chain: list[int], top: int, time: int) -> Pose | None:
    position, turn = np.zeros(3), Rotation.identity()
    for each in chain[: chain.index(top)]:
        frame = frames[each]
        assert frame is not None
        step = frame.at(time)
        if step is None:
            return None
        position, turn = step[1].apply(position) + step[0], step[1] * turn
    return position, turn


def test_random_lookups_are_those_of_scipy():
    random = np.random.default_rng(20261130)
    found = 0
    for _ in range(TREES):
        buffer, frames = _random_tree(random)
        for _ in range(LOOKUPS):
            target, source = (int(each) for each in random.integers(len(frames), size=2))
            time = int(random.integers(1, 1000))
            chains = _above(frames, source), _above(frames, target)
            top = next(each for each in chains[0] if each in chains[1])
            ways = [_to_ancestor(frames, chain, top, time) for chain in chains]
            lookup = buffer.lookup(f"f{target}", f"f{source}", time)
            if ways[0] is None or ways[1] is None:
                assert lookup.outcome in {"before interval", "after interval"}
                assert not lookup.first_ns <= time <= lookup.last_ns
                continue
            assert lookup.outcome == "done"
            turn = ways[1][1].inv() * ways[0][1]
            position = ways[1][1].inv().apply(ways[0][0] - ways[1][0])
            assert np.abs(np.subtract(lookup.translation, position)).max() < TOLERANCE
            ours, theirs = np.array(lookup.rotation), turn.as_quat()
            assert min(np.abs(ours - theirs).max(), np.abs(ours + theirs).max()) < TOLERANCE
            found += 1
    assert found > TREES / 2


def test_the_constants_of_the_message_are_the_outcomes_of_the_kernel():
    constants = {name: getattr(TransformOutcome, name) for name in dir(TransformOutcome) if name.isupper()}
    numbers = {number: name for name, number in constants.items() if isinstance(number, int)}
    words = {number: name.lower().replace("_", " ") for number, name in numbers.items()}
    assert words == TRANSFORM_OUTCOMES
