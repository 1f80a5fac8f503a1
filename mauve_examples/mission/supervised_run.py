"""Simulates a mission that had no supervisors once more, with them."""

from collections.abc import Callable
from dataclasses import replace

from mauve_examples.mission.architecture import World
from mauve_examples.mission.demo_errors import MissionError
from mauve_examples.mission.demo_options import Options
from mauve_examples.mission.demo_simulated import SimulatedMission
from mauve_examples.mission.evidence import read_robot, replay_coverage
from mauve_examples.mission.progress import MissionPicture, PlainProgress, Progress
from mauve_examples.mission.supervised import Supervised
from mauve_rt.trace import TraceError

FOLDER = "with_supervisors"


def simulate_supervised(
    options: Options, world: World, *, progress: Progress, interrupted: Callable[[], bool]
) -> Supervised | None:
    """Simulate the mission anew, with supervisors, into a folder of its own; None where it cannot be."""
    progress.say("Simulating the same mission with supervisors, to compare ...")
    again = replace(options, supervisor=True, simulated_time=True, out=options.out / FOLDER)
    mission = SimulatedMission(again, world, progress=_Silent(progress), interrupted=interrupted)
    try:
        mission.run()
        if interrupted():
            return None
        facts = mission.facts()
        evidence = [read_robot(again.out / "bag" / robot, robot, facts) for robot in facts.robots]
    except (MissionError, TraceError) as error:
        progress.say(f"It could not be simulated: {error}")
        return None
    return Supervised(facts, replay_coverage(facts, world.area, evidence))


class _Silent(PlainProgress):
    """Says nothing of how the mission goes: nobody is to take it for the one that was asked for."""

    def __init__(self, progress: Progress) -> None:
        self._progress = progress

    def say(self, text: str) -> None:
        """Nothing."""

    def show(self, picture: MissionPicture) -> None:
        """Nothing."""
