"""One mission from its first process to its last: start, wait until all have met, run the timeline, end."""

import json
import time
from collections.abc import Callable
from typing import Any

from mauve_examples.mission.architecture import World, write_setups
from mauve_examples.mission.coverage import CoverageTracker
from mauve_examples.mission.demo_errors import MissionError
from mauve_examples.mission.demo_lock import MissionLock, busy
from mauve_examples.mission.demo_monitor import Hooks, MissionMonitor
from mauve_examples.mission.demo_options import Options
from mauve_examples.mission.demo_story import MissionStory
from mauve_examples.mission.facts import ComponentFacts, MissionFacts, RealtimeFacts
from mauve_examples.mission.processes import Processes
from mauve_examples.mission.progress import Progress

READY_TIMEOUT_S = 15.0
LOOK_AROUND_S = 0.5
STEP_S = 0.05
SHOW_PERIOD_S = 0.2
LAST_WORDS_S = 0.2
PATIENCE_S = 10.0
HURRIED_PATIENCE_S = 2.5
RECORDED = ("supervisor/decisions:mauve_msgs/msg/SupervisorDecision", "/radio/link:std_msgs/msg/Bool")
LOOK_IN = "To look into a robot from another terminal: mauve list /robot_1/executor"
NO_REALTIME = "Real-time rights are missing: what the robots do may come late. More about it at the end."
USUAL_CORE, LOCAL_CORE = "Exploration", "LocalExploration"


class MissionRun:
    """A mission that can be run once. For one thread."""

    def __init__(
        self, options: Options, world: World, *, progress: Progress, interrupted: Callable[[], bool]
    ) -> None:
        self._options = options
        self._world = world
        self._progress = progress
        self._interrupted = interrupted
        self._log = options.out / "log"
        self._started_ns = 0  # CLOCK_MONOTONIC; 0: not started
        self._ended_ns = 0
        self._next_show_s = 0.0
        self._shown_events = 0
        self._components: dict[str, dict[str, ComponentFacts]] = {}
        self._processes: Processes | None = None
        self.trouble: list[str] = []
        self.coverage = CoverageTracker(world.area, options.names)
        self.story = MissionStory(options.names, clock=self.time_s)

    @property
    def started(self) -> bool:
        """Whether the robots were ever started: then there are bags to report on."""
        return self._started_ns > 0

    def time_s(self) -> float:
        """Mission time, s; negative before the start."""
        return (time.monotonic_ns() - self._started_ns) / 1e9 if self.started else -1.0

    def run(self) -> None:
        """Run the mission to its end, however it ends; no process is left.

        Raises:
            BadInputError: another mission is running; nothing was started.
            MissionError: the mission could not be started.
        """
        hooks = Hooks(
            map_update=self.coverage.update,
            state=self.story.on_state,
            event=self.story.on_event,
            decision=self.story.on_decision,
            done=self.story.on_done,
            link=self.story.on_link,
        )
        lock = MissionLock()
        monitor = MissionMonitor(self._options.names, hooks)
        try:
            self._refuse_company(monitor)
            self._progress.say(f"Starting {self._in_words()}.")
            self._processes = Processes(self._log, inherited=[lock.fd])
            nodes = self._start_processes(self._processes)
            self._wait_until_ready(monitor, self._processes, nodes)
            if not self._interrupted():
                self._progress.say("All have met. " + LOOK_IN)
                if not all(robot.realtime_granted for robot in self.story.robots.values()):
                    self._progress.say(NO_REALTIME)
                self._started_ns = time.monotonic_ns()
                monitor.activate()
                self._play(monitor, self._processes)
        finally:
            self._ended_ns = time.monotonic_ns()
            self._end()
            monitor.close()
            lock.release()

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
        )

    def _in_words(self) -> str:
        number = len(self._options.names)
        robots = f"{number} robots" if number > 1 else "1 robot"
        guard = "" if self._options.supervisor or number == 1 else ", without supervisors"
        return f"{robots}{guard} in {self._options.map_file.name}; results go to {self._options.out}"

    # ---- before

    def _refuse_company(self, monitor: MissionMonitor) -> None:
        monitor.spin(LOOK_AROUND_S)
        there = monitor.node_counts()
        for node in ("/radio", *(f"/{name}/executor" for name in self._options.names)):
            if node in there:
                raise busy(f"node {node} is there")

    def _start_processes(self, processes: Processes) -> list[str]:
        """Start everything; returns the nodes that will be there."""
        nodes = ["/radio"]
        names = ",".join(self._options.names)
        parameters = {
            "robots": f"[{names}]",
            "drop_share": f"{float(self._options.drop_share)!r}",
            "seed": str(self._options.seed),
        }
        processes.start("radio", "mauve_examples.mission.radio", *ros_arguments(parameters))
        options = self._options
        setups = write_setups(self._world, options.out, seed=options.seed, supervisor=options.supervisor)
        for setup in setups:
            bag = self._options.out / "bag" / setup.name
            parameters = {
                "architecture": str(setup.architecture),
                "bag": str(bag),
                "autostart": "false",
                "record_topics": json.dumps(RECORDED),
            }
            processes.start(f"{setup.name}_executor", "mauve_rt.node.executor", *ros_arguments(parameters))
            nodes.append(f"/{setup.name}/executor")
            if setup.rules is not None:
                arguments = ["-r", f"__ns:=/{setup.name}"]
                arguments = [*ros_arguments({"rules": str(setup.rules)}), *arguments]
                processes.start(f"{setup.name}_supervisor", "mauve_rt.node.supervisor", *arguments)
                nodes.append(f"/{setup.name}/supervisor")
        return nodes

    def _wait_until_ready(self, monitor: MissionMonitor, processes: Processes, nodes: list[str]) -> None:
        deadline_s = time.monotonic() + READY_TIMEOUT_S
        while (missing := monitor.missing(nodes)) and not self._interrupted():
            ended = processes.ended()
            if ended is not None:
                raise MissionError(f"{ended.describe()}; logs are in {self._log}")
            if time.monotonic() > deadline_s:
                raise MissionError(
                    f"not ready within {READY_TIMEOUT_S:g} s: {missing}; logs are in {self._log}"
                )
            monitor.spin(STEP_S)
        doubled = [node for node, count in monitor.node_counts().items() if node in nodes and count > 1]
        if doubled:
            raise MissionError(str(busy(f"node {doubled[0]} is there twice")))

    # ---- during

    def _play(self, monitor: MissionMonitor, processes: Processes) -> None:
        options = self._options
        changes = [
            (at_s, up)
            for at_s, up in ((options.link_loss_at_s, False), (options.link_back_at_s, True))
            if at_s is not None
        ]
        monitor.ask_components(self._take_components)
        while not self._interrupted() and self.time_s() < options.duration_s:
            if changes and self.time_s() >= changes[0][0]:
                monitor.set_link(up=changes.pop(0)[1])
            ended = processes.ended()
            if ended is not None:
                self.trouble.append(ended.describe())
                self.story.tell(ended.describe())
                break
            monitor.spin(STEP_S)
            self._show()
            if not changes and self.story.link_up and self._all_done():
                break
        if self._interrupted():
            self.trouble.append(f"interrupted at {self.time_s():.1f} s")
            return
        monitor.ask_components(self._take_components)
        monitor.spin(LAST_WORDS_S)
        self._show(now=True)

    def _take_components(self, robot: str, answer: Any) -> None:
        self._components[robot] = {
            component.name: ComponentFacts(
                policy=component.policy,
                priority=component.priority,
                cpus=[int(cpu) for cpu in component.cpus],
            )
            for component in answer.components
        }

    def _all_done(self) -> bool:
        robots = self.story.robots.values()
        swapped = all({LOCAL_CORE, USUAL_CORE} <= {swap.to_core for swap in robot.swaps} for robot in robots)
        return all(robot.done for robot in robots) and (swapped or not self._options.supervisor)

    def _show(self, *, now: bool = False) -> None:
        if not now and self.time_s() < self._next_show_s and len(self.story.events) == self._shown_events:
            return
        self._next_show_s = self.time_s() + SHOW_PERIOD_S
        self._shown_events = len(self.story.events)
        self._progress.show(
            self.story.picture(
                duration_s=self._options.duration_s,
                explored=self.coverage.shares(),
                together=self.coverage.union(),
            )
        )

    # ---- after

    def _end(self) -> None:
        if self._processes is None:
            return
        killed = self._processes.stop(lambda: HURRIED_PATIENCE_S if self._interrupted() else PATIENCE_S)
        for name in killed:
            self.trouble.append(f"{name} did not end in time and was killed")


def ros_arguments(parameters: dict[str, str]) -> list[str]:
    """Parameters as a ROS command line."""
    arguments = ["--ros-args"]
    for name, value in parameters.items():
        arguments += ["-p", f"{name}:={value}"]
    return arguments
