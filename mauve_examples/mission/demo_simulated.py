"""One mission in simulated time: robots, radio and supervisors on one thread, as fast as it goes."""

import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, TypeVar

from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Bool

from mauve_examples.mission.architecture import World, write_setups
from mauve_examples.mission.demo_errors import MissionError
from mauve_examples.mission.demo_mission import Mission
from mauve_examples.mission.demo_options import Options
from mauve_examples.mission.facts import SimulationFacts
from mauve_examples.mission.medium import Medium
from mauve_examples.mission.progress import Progress
from mauve_rt.api import Simulation
from mauve_rt.errors import MauveError
from mauve_rt.simulation.executor import SimulatedExecutor
from mauve_rt.simulation.supervisor import SimulatedSupervisor
from mauve_rt.simulation.topics import Sample, SimulatedTopics
from mauve_rt.trace import TraceError

T = TypeVar("T")
MS, S = 1_000_000, 1_000_000_000
CARRY_PERIOD_NS = 10 * MS  # topics and radio
STATE_PERIOD_NS = 100 * MS
RECORD_PERIOD_NS = 500 * MS
FLUSH_PERIOD_NS = 10 * S
STEP_NS = 50 * MS
LINK = "/radio/link"
_LINK_QOS = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
_RADIO_QOS = QoSProfile(depth=50)


class SimulatedMission(Mission):
    """A mission in simulated time. Equal options and maps give equal traces."""

    def __init__(
        self, options: Options, world: World, *, progress: Progress, interrupted: Callable[[], bool]
    ) -> None:
        super().__init__(options, world, progress=progress, interrupted=interrupted)
        self._time = Simulation()
        self._topics = SimulatedTopics()
        self._medium = Medium(options.names, drop_share=options.drop_share, seed=options.seed)
        self._executors: dict[str, SimulatedExecutor] = {}
        self._supervisors: list[SimulatedSupervisor] = []
        self._wall_s = 0.0

    def _now_ns(self) -> int:
        return self._time.now_ns()

    def _simulation(self) -> SimulationFacts:
        virtual_s = (self._ended_ns - self._started_ns) / 1e9
        return SimulationFacts(
            virtual_s=virtual_s, wall_s=self._wall_s, speed_up=virtual_s / max(self._wall_s, 1e-9)
        )

    def run(self) -> None:
        """Run the mission to its end.

        Raises:
            MissionError: the mission could not be started.
        """
        self._progress.say(f"Simulating {self._in_words()}.")
        try:
            self._set_up()
            self._started_ns = self._time.now_ns()
            began_s = time.perf_counter()
            try:
                self._play()
            finally:
                self._ended_ns = self._time.now_ns()
                _each(self._supervisors, SimulatedSupervisor.close)
                _each(list(self._executors.values()), SimulatedExecutor.close)
                self._wall_s = time.perf_counter() - began_s
        except (MauveError, TraceError) as error:
            raise MissionError(str(error)) from error
        finally:
            self._time.shutdown()
        run = self._simulation()
        speed = f"{run['speed_up']:.1f} times as fast as real time"
        self._progress.say(f"Simulated {run['virtual_s']:.1f} s in {run['wall_s']:.1f} s: {speed}.")

    def _set_up(self) -> None:
        options = self._options
        setups = write_setups(self._world, options.out, seed=options.seed, supervisor=options.supervisor)
        for setup in setups:
            bag = options.out / "bag" / setup.name
            executor = SimulatedExecutor(
                self._time,
                self._topics,
                setup.architecture,
                bag,
                complain=self.trouble.append,
                rules=setup.rules,
            )
            self._executors[setup.name] = executor
            executor.record_topic(LINK)
            if setup.rules is not None:
                supervisor = SimulatedSupervisor(self._time, self._topics, executor, setup.rules)
                executor.record_topic(supervisor.decisions)
                self._supervisors.append(supervisor)
            self._watch(setup.name)
        self._topics.listen(LINK, lambda sample: self.story.on_link(sample.message().data))

    def _watch(self, robot: str) -> None:
        def to(hook: Callable[[str, Any], None]) -> Callable[[Sample], None]:
            return lambda sample: hook(robot, sample.message())

        listen = self._topics.listen
        listen(f"/{robot}/map_updates", to(self.coverage.update))
        listen(f"/{robot}/executor/state", to(self.story.on_state))
        listen(f"/{robot}/executor/events", to(self.story.on_event))
        for node in ("executor", "supervisor"):
            listen(f"/{robot}/{node}/decisions", to(self.story.on_decision))
        listen(f"/{robot}/done", lambda sample: self.story.on_done(robot, sample.message().data))
        listen(f"/{robot}/radio/out", lambda sample: self._send(robot, sample))

    def _send(self, sender: str, sample: Sample) -> None:
        for robot in self._medium.receivers(sender):
            heard = sample._replace(topic=f"/{robot}/radio/in", time_ns=self._time.now_ns(), qos=_RADIO_QOS)
            self._topics.publish(heard)

    def _set_link(self, *, up: bool) -> None:
        self._medium.link_up = up
        now_ns = self._time.now_ns()
        self._topics.say(LINK, "std_msgs/msg/Bool", Bool(data=up), time_ns=now_ns, qos=_LINK_QOS)

    def _play(self) -> None:
        simulated, executors = self._time, list(self._executors.values())
        first_ns = self._started_ns + CARRY_PERIOD_NS
        for at_s, up in self._link_changes():
            simulated.at(self._started_ns + round(at_s * S), partial(self._set_link, up=up))
        self._set_link(up=True)
        for executor in executors:
            executor.activate()
        simulated.every(first_ns, CARRY_PERIOD_NS, lambda: _each(executors, SimulatedExecutor.carry))
        simulated.every(first_ns, STATE_PERIOD_NS, lambda: _each(executors, SimulatedExecutor.refresh))
        simulated.every(first_ns, RECORD_PERIOD_NS, lambda: _each(executors, SimulatedExecutor.record))
        simulated.every(first_ns, FLUSH_PERIOD_NS, lambda: _each(executors, SimulatedExecutor.flush))
        until_ns = self._started_ns + round(self._options.duration_s * S)
        last_change_s = max([at_s for at_s, _ in self._link_changes()], default=0.0)
        while not self._interrupted() and simulated.now_ns() < until_ns:
            simulated.run_until(min(simulated.now_ns() + STEP_NS, until_ns))
            self._show()
            if self.time_s() >= last_change_s and self.story.link_up and self._all_done():
                break
        if self._interrupted():
            self.trouble.append(f"interrupted at {self.time_s():.1f} s")
        for robot, executor in self._executors.items():
            self._take_components(robot, executor.components())
        self._show(now=True)


def _each(those: Sequence[T], do: Callable[[T], None]) -> None:
    for one in those:
        do(one)
