"""What every mission has, whatever time it runs in: its story, its coverage, its facts, its picture."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from typing import Any

from mauve_examples.mission.architecture import World
from mauve_examples.mission.coverage import CoverageTracker
from mauve_examples.mission.demo_options import Options
from mauve_examples.mission.demo_story import MissionStory
from mauve_examples.mission.facts import ComponentFacts, MissionFacts, RealtimeFacts, SimulationFacts
from mauve_examples.mission.plan import Plan
from mauve_examples.mission.progress import Progress

SHOW_PERIOD_S = 0.2
USUAL_CORE, LOCAL_CORE = "Exploration", "LocalExploration"


class Mission(ABC):
    """A mission that can be run once. For one thread."""

    def __init__(
        self, options: Options, world: World, *, progress: Progress, interrupted: Callable[[], bool]
    ) -> None:
        self._options = options
        self._world = world
        self._progress = progress
        self._interrupted = interrupted
        self._started_ns = 0  # of the mission's clock; 0: not started
        self._ended_ns = 0
        self._next_show_s = 0.0
        self._components: dict[str, dict[str, ComponentFacts]] = {}
        self.trouble: list[str] = []
        self.coverage = CoverageTracker(world.area, options.names)
        self.story = MissionStory(options.names, clock=self.time_s, age_s=self._age_s)

    @abstractmethod
    def run(self) -> None:
        """Run the mission to its end, however it ends."""

    @abstractmethod
    def _now_ns(self) -> int:
        """Ns of the clock that the traces are on."""

    def _stamp_ns(self) -> int:
        """Ns of the clock that stamps messages."""
        return self._now_ns()

    def _age_s(self, stamp: Any) -> float:
        stamp_ns = int(stamp.sec) * 10**9 + int(stamp.nanosec)
        return (self._stamp_ns() - stamp_ns) / 1e9

    def _simulation(self) -> SimulationFacts | None:
        return None

    @property
    def started(self) -> bool:
        """Whether the robots were ever started: then there are bags to report on."""
        return self._started_ns > 0

    def time_s(self) -> float:
        """Mission time, s; negative before the start."""
        return (self._now_ns() - self._started_ns) / 1e9 if self.started else -1.0

    def facts(self) -> MissionFacts:
        """What the report needs to know of a mission that was started."""
        options, start_ns = self._options, self._started_ns
        robots = self.story.robots.values()
        missing = list(dict.fromkeys(line for robot in robots for line in robot.realtime_missing))
        granted = all(robot.realtime_granted for robot in robots)
        gaps = [
            (round(down_s * 1e9), round(up_s * 1e9) if up_s is not None else self._ended_ns - start_ns)
            for down_s, up_s in self.story.link_gaps()
        ]
        return MissionFacts(
            map_path=options.map_file,
            radius_m=self._world.radius_m,
            starts=self._world.starts,
            started_ns=start_ns,
            ended_ns=self._ended_ns,
            link_down_ns=[(start_ns + down_ns, start_ns + up_ns) for down_ns, up_ns in gaps],
            link_loss_s=options.link_loss_at_s,
            link_back_s=options.link_back_at_s,
            supervisor=options.supervisor,
            expected_swaps=options.link_loss_at_s is not None,
            components=self._components,
            realtime=RealtimeFacts(granted=granted, missing=missing),
            faults=self.trouble,
            simulation=self._simulation(),
        )

    def _in_words(self) -> str:
        number = len(self._options.names)
        robots = f"{number} robots" if number > 1 else "1 robot"
        guard = "" if self._options.supervisor or number == 1 else ", without supervisors"
        return f"{robots}{guard} in {self._options.map_file.name}; results go to {self._options.out}"

    def _link_changes(self) -> list[tuple[float, bool]]:
        """When the link changes, as planned, s of mission time, and to what."""
        planned = ((self._options.link_loss_at_s, False), (self._options.link_back_at_s, True))
        return [(at_s, up) for at_s, up in planned if at_s is not None]

    def _take_components(self, robot: str, components: Iterable[Any]) -> None:
        self._components[robot] = {
            component.name: ComponentFacts(
                policy=component.policy,
                priority=component.priority,
                cpus=[int(cpu) for cpu in component.cpus],
            )
            for component in components
        }

    def _all_done(self) -> bool:
        robots = self.story.robots.values()
        swapped = all({LOCAL_CORE, USUAL_CORE} <= {swap.to_core for swap in robot.swaps} for robot in robots)
        return all(robot.done for robot in robots) and (swapped or not self._options.supervisor)

    def _show(self, *, now: bool = False) -> None:
        """Show how it goes; `now`: for the last time."""
        if not now and self.time_s() < self._next_show_s:
            return
        self._next_show_s = self.time_s() + SHOW_PERIOD_S
        names = self._options.names
        self._progress.show(
            self.story.picture(
                duration_s=self._options.duration_s,
                explored=self.coverage.shares(),
                together=self.coverage.union(),
                plan=Plan(self._world.area.cells, {name: self.coverage.explored(name) for name in names}),
                at_the_end=now,
            )
        )
