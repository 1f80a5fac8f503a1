"""One mission from its first process to its last: start, wait until all have met, run the timeline, end."""

import json
import os
import time
from collections.abc import Callable

from mauve_examples.mission.architecture import World, write_setups
from mauve_examples.mission.cable import RobotCable
from mauve_examples.mission.demo_errors import MissionError
from mauve_examples.mission.demo_lock import MissionLock, busy
from mauve_examples.mission.demo_mission import Mission
from mauve_examples.mission.demo_monitor import Hooks, MissionMonitor
from mauve_examples.mission.demo_options import Options
from mauve_examples.mission.hints import sourcing
from mauve_examples.mission.processes import Processes
from mauve_examples.mission.progress import Progress

READY_TIMEOUT_S = 60.0  # five processes load; one that ends is noticed at once
LOOK_AROUND_S = 0.5
MEETING_S = 3.5  # by then each machine has announced itself to the others once more, whatever was lost before
STEP_S = 0.05
LAST_WORDS_S = 0.2
PATIENCE_S = 10.0
HURRIED_PATIENCE_S = 2.5
RECORDED = ("supervisor/decisions:mauve_msgs/msg/SupervisorDecision", "/radio/link:std_msgs/msg/Bool")
LOOK_IN = "All have met. To look into a robot from another terminal:"
LIST = "mauve list /robot_1/executor"
NO_REALTIME = "Real-time rights are missing: what the robots do may come late. More about it at the end."


class MissionRun(Mission):
    """A mission of processes in real time."""

    def __init__(
        self,
        options: Options,
        world: World,
        *,
        progress: Progress,
        interrupted: Callable[[], bool],
        cable: RobotCable | None = None,
    ) -> None:
        """`cable`: the robots are on machines of their own; without it a radio is between them."""
        super().__init__(options, world, progress=progress, interrupted=interrupted)
        self._cable = cable
        self._log = options.out / "log"
        self._processes: Processes | None = None

    def _now_ns(self) -> int:
        return time.monotonic_ns()

    def _stamp_ns(self) -> int:
        return time.time_ns()

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
        monitor = MissionMonitor(self._options.names, hooks, cable=self._cable)
        try:
            self._refuse_company(monitor)
            self._progress.say(f"Starting {self._in_words()}.")
            self._processes = Processes(self._log, inherited=[lock.fd])
            nodes = self._start_processes(self._processes)
            self._wait_until_ready(monitor, self._processes, nodes)
            if not self._interrupted():
                self._progress.say(self._look_in())
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

    # ---- before

    def _refuse_company(self, monitor: MissionMonitor) -> None:
        monitor.spin(LOOK_AROUND_S)
        there = monitor.node_counts()
        for node in ("/radio", *(f"/{name}/executor" for name in self._options.names)):
            if node in there:
                raise busy(f"node {node} is there")

    def _start_processes(self, processes: Processes) -> list[str]:
        """Start everything; returns the nodes that will be there."""
        options = self._options
        nodes = [self._start_between(processes)]
        setups = write_setups(
            self._world,
            options.out,
            seed=options.seed,
            supervisor=options.supervisor,
            hosts=self._cable is not None,
        )
        for setup in setups:
            wrapper = self._cable.wrapper(setup.name) if self._cable is not None else ()
            bag = self._options.out / "bag" / setup.name
            parameters = {
                "architecture": str(setup.architecture),
                "bag": str(bag),
                "autostart": "false",
                "record_topics": json.dumps(RECORDED),
                **({"rules": str(setup.rules)} if setup.rules is not None else {}),
            }
            arguments = ros_arguments(parameters)
            executor = "mauve_rt.node.executor.main"
            processes.start(f"{setup.name}_executor", executor, *arguments, wrapper=wrapper)
            nodes.append(f"/{setup.name}/executor")
            if setup.rules is not None:
                arguments = ["-r", f"__ns:=/{setup.name}"]
                arguments = [*ros_arguments({"rules": str(setup.rules)}), *arguments]
                supervisor = "mauve_rt.node.supervisor.main"
                processes.start(f"{setup.name}_supervisor", supervisor, *arguments, wrapper=wrapper)
                nodes.append(f"/{setup.name}/supervisor")
        return nodes

    def _start_between(self, processes: Processes) -> str:
        """Start what is between the robots; returns its node: the radio, or the world that both are in."""
        options = self._options
        parameters = {"robots": f"[{','.join(options.names)}]"}
        if self._cable is not None:
            processes.start("world", "mauve_examples.mission.world", *ros_arguments(parameters))
            return "/world"
        parameters |= {"drop_share": f"{float(options.drop_share)!r}", "seed": str(options.seed)}
        processes.start("radio", "mauve_examples.mission.radio", *ros_arguments(parameters))
        return "/radio"

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
        if self._cable is not None:
            monitor.spin(MEETING_S)
        doubled = [node for node, count in monitor.node_counts().items() if node in nodes and count > 1]
        if doubled:
            raise MissionError(str(busy(f"node {doubled[0]} is there twice")))

    def _look_in(self) -> str:
        if self._cable is None:
            return f"{LOOK_IN} {' && '.join([*sourcing(), LIST])}"
        enter = f"sudo nsenter --target {os.getpid()} --net bash"
        reach = "export ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET"
        return f"{LOOK_IN} {enter}, then {' && '.join([*sourcing(), reach, LIST])}"

    # ---- during

    def _play(self, monitor: MissionMonitor, processes: Processes) -> None:
        options = self._options
        changes = self._link_changes()
        monitor.ask_components(lambda robot, answer: self._take_components(robot, answer.components))
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
        monitor.ask_components(lambda robot, answer: self._take_components(robot, answer.components))
        monitor.spin(LAST_WORDS_S)
        self._show(now=True)

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
