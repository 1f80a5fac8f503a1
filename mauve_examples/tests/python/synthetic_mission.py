"""A mission that never was: bags whose every figure is known, to work on reports without robots."""

import math
from collections import deque
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from mauve_examples.mission.facts import ComponentFacts, MissionArea, MissionFacts, RealtimeFacts
from mauve_rt.trace.format.definitions import find_definition
from mauve_rt.trace.format.records import Kind, ReconfigurationPhase
from mauve_rt.trace.recording.recorder import Recorder
from mauve_rt.trace.recording.synthetic import SyntheticSource

S, MS, US = 1_000_000_000, 1_000_000, 1_000
EPOCH_NS = 100 * S
PERIODS_NS = {
    "robot": 10 * MS,
    "control": 20 * MS,
    "guidance": 100 * MS,
    "mapping": 100 * MS,
    "exploration": 500 * MS,
}
STATES = {
    "robot": {"move": 60 * US, "scan": 350 * US},
    "control": {"control": 40 * US},
    "guidance": {"idle": 12 * US, "following": 80 * US},
    "mapping": {"integrate": 3 * MS},
    "exploration": {"decide": 6 * MS, "announce": 300 * US},
}
REASONS = {"do": "peer silent for 1.0 s", "undo": "peers heard again for 3.0 s"}  # by decision
BLACKOUT_NS, PREPARE_NS, SILENCE_S, WAKEUP_NS = 41 * US, 213 * US, 1.02, 23 * US
PEERS, ALONE = "mauve_examples/Exploration", "mauve_examples/LocalExploration"


def office(width: int = 240, height: int = 160) -> MissionArea:
    """Eight rooms along a corridor; 0.1 m per cell."""
    cells = np.zeros((height, width), np.int8)
    cells[[0, -1], :] = 100
    cells[:, [0, -1]] = 100
    low, high = height * 2 // 5, height * 3 // 5
    cells[[low, high], :] = 100
    for room in range(1, 4):
        cells[:low, room * width // 4] = 100
        cells[high:, room * width // 4] = 100
    for room in range(4):
        door = room * width // 4 + width // 8
        cells[[low, high], door - 5 : door + 5] = 0
    cells[height // 2 - 3 : height // 2 + 3, width // 2 - 3 : width // 2 + 3] = 100
    return MissionArea(
        cells=cells, reachable=cells == 0, resolution_m=0.1, origin_x_m=-width / 20, origin_y_m=-height / 20
    )


_SIGHT_CELLS = 40


class Messages:
    """Serialized messages, from the definitions in the sources."""

    def __init__(self) -> None:
        self._store = get_typestore(Stores.EMPTY)

    def cdr(self, name: str, **fields: Any) -> bytes:
        """Return a message of the type package/msg/Name, serialized."""
        return bytes(self._store.serialize_cdr(self.make(name, **fields), name))

    def make(self, name: str, **fields: Any) -> Any:
        """Return a message as rosbags has it."""
        if name not in self._store.types:
            self._store.register(get_types_from_msg(find_definition(name).text, name))
        return self._store.types[name](**fields)


@dataclass
class Explorer:
    """A robot that walks to the nearest cell it does not know; sees what is within 4 m of walking."""

    area: MissionArea
    cell: tuple[int, int]
    known: Any = None
    path: list[tuple[int, int]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.known = np.zeros(self.area.cells.shape, np.bool_)

    def step(self, cells: int) -> None:
        """Walk so many cells, then look around."""
        for _ in range(cells):
            if not self.path:
                self.path = self._search(known_too=True)
            if self.path:
                self.cell = self.path.pop()
        self._search(known_too=False)

    def _search(self, *, known_too: bool) -> list[tuple[int, int]]:
        """Breadth first: the way to the nearest unknown cell, or look around."""
        came: dict[tuple[int, int], tuple[int, int] | None] = {self.cell: None}
        queue = deque([(self.cell, 0)])
        while queue:
            here, far = queue.popleft()
            if not known_too:
                row, column = here
                self.known[max(row - 1, 0) : row + 2, max(column - 1, 0) : column + 2] = True
            elif not self.known[here]:
                way = []
                at: tuple[int, int] | None = here
                while at is not None and came[at] is not None:
                    way.append(at)
                    at = came[at]
                return way
            for row, column in ((0, 1), (1, 0), (0, -1), (-1, 0)):
                there = (here[0] + row, here[1] + column)
                free = self.area.cells[there] == 0
                if free and there not in came and (known_too or far < _SIGHT_CELLS):
                    came[there] = here
                    queue.append((there, far + 1))
        return []


@dataclass
class FakeRobot:
    """Writes the bag of one robot."""

    name: str
    area: MissionArea
    messages: Messages
    explorer: Explorer
    source: SyntheticSource = field(default_factory=lambda: SyntheticSource(list(PERIODS_NS)))
    sent: list[tuple[str, str, bytes, int]] = field(default_factory=list)
    core: str = PEERS
    revisions: Any = None

    def explore(self, start_s: float, end_s: float) -> None:
        """Walk at 1.2 m/s; pose at 10 Hz, map updates at 2 Hz."""
        for tick in range(round(start_s * 10), round(end_s * 10)):
            now_ns = EPOCH_NS + tick * 100 * MS
            before = self.explorer.known.copy()
            self.explorer.step(1 + tick % 5 // 4 if tick % 5 else 2)
            row, column = self.explorer.cell
            x = self.area.origin_x_m + (column + 0.5) * 0.1
            y = self.area.origin_y_m + (row + 0.5) * 0.1
            pose = self.messages.cdr("geometry_msgs/msg/Pose2D", x=x, y=y, theta=0.0)
            self.sent.append((f"/{self.name}/pose", "geometry_msgs/msg/Pose2D", pose, now_ns))
            self._update_map(before, now_ns)

    def _update_map(self, before: Any, now_ns: int) -> None:
        changed = np.argwhere(before != self.explorer.known) // 16
        tiles = []
        for row, column in np.unique(changed, axis=0):
            window = (slice(row * 16, row * 16 + 16), slice(column * 16, column * 16 + 16))
            cells = np.full((16, 16), -1, np.int8)
            part = np.where(self.explorer.known[window], self.area.cells[window], -1)
            cells[: part.shape[0], : part.shape[1]] = part
            tiles.append(
                self.messages.make(
                    "mauve_msgs/msg/MapTile",
                    column=int(column),
                    row=int(row),
                    revision=1,
                    cells=cells.reshape(-1),
                )
            )
        height, width = self.area.cells.shape
        for at in range(0, len(tiles), 64):
            update = self.messages.cdr(
                "mauve_msgs/msg/MapUpdate",
                stamp_ns=now_ns,
                resolution=0.1,
                origin_x=self.area.origin_x_m,
                origin_y=self.area.origin_y_m,
                columns=math.ceil(width / 16),
                rows=math.ceil(height / 16),
                tiles=tiles[at : at + 64],
            )
            self.sent.append((f"/{self.name}/map_updates", "mauve_msgs/msg/MapUpdate", update, now_ns))

    def run(self, duration_s: float, swaps: dict[float, str]) -> None:
        """Write the trace of all components, with a swap of exploration at these times."""
        random = np.random.default_rng(1)
        for component, period_ns in PERIODS_NS.items():
            self.source.add(component, Kind.DEPLOYMENT, EPOCH_NS - 20 * MS, a=EPOCH_NS, c=period_ns)
            self.source.add(component, Kind.START, EPOCH_NS - 20 * MS, a=EPOCH_NS)
            pending = dict(swaps) if component == "exploration" else {}
            for instant in range(EPOCH_NS, EPOCH_NS + round(duration_s * S), period_ns):
                states = {
                    state: int(took * random.uniform(0.7, 1.3)) for state, took in STATES[component].items()
                }
                self.source.cycle(component, instant, states=states, wait_ns=period_ns, wakeup_ns=WAKEUP_NS)
                for at_s in [at_s for at_s in pending if EPOCH_NS + at_s * S < instant + period_ns]:
                    self._swap(EPOCH_NS + round(at_s * S), instant + period_ns, pending.pop(at_s))

    def _swap(self, parked_ns: int, pending_ns: int, core: str) -> None:
        self._decide("do" if core == ALONE else "undo", parked_ns - 3 * MS)
        add = self.source.add
        armed_ns = parked_ns + BLACKOUT_NS
        add("exploration", Kind.PARKED, parked_ns, name="wait", a=pending_ns)
        what = f"replace_core {core}"
        adopt, take = ReconfigurationPhase
        for phase, took_ns, end_ns, instant_ns in (
            (adopt, 18 * US, 24 * US, 0),
            (take, 6 * US, 33 * US, parked_ns),
        ):
            time_ns = parked_ns + end_ns
            add("exploration", Kind.RECONFIGURATION, time_ns, name=what, a=phase, b=took_ns, c=instant_ns)
        add("exploration", Kind.ARMED, armed_ns, name="wait", a=pending_ns, b=1)
        step = self.messages.make(
            "mauve_msgs/msg/StepReport",
            step=f"replace_core {core}",
            component="exploration",
            prepare_ns=PREPARE_NS,
            blackout_ns=BLACKOUT_NS,
            missed_releases=0,
            phase_nominal_ns=0,
            phase_actual_ns=WAKEUP_NS,
            from_core=self.core,
            to_core=core,
            remark="",
            instant_ns=parked_ns,
            release_ns=pending_ns,
            taken=[],
            left=[],
            outputs=[],
        )
        event = self.messages.cdr(
            "mauve_msgs/msg/ReconfigurationEvent",
            stamp=self.messages.make("builtin_interfaces/msg/Time", sec=0, nanosec=0),
            instance_id="1",
            revision=2,
            requested_by=f"/{self.name}/supervisor",
            request_id="1",
            request=f"replace_core exploration {core}",
            cause=f"link_lost: {REASONS['do' if core == ALONE else 'undo']}",
            success=True,
            code=0,
            message="",
            from_core=self.core,
            to_core=core,
            report=[step],
        )
        self.core = core
        topic = f"/{self.name}/executor/events"
        self.sent.append((topic, "mauve_msgs/msg/ReconfigurationEvent", event, pending_ns + 2 * MS))

    def _decide(self, decision: str, time_ns: int) -> None:
        message = self.messages.cdr(
            "mauve_msgs/msg/SupervisorDecision",
            stamp=self.messages.make("builtin_interfaces/msg/Time", sec=0, nanosec=0),
            rule="link_lost",
            decision=decision,
            reason=REASONS[decision],
            silence_s=SILENCE_S if decision == "do" else 0.04,
            revision=1,
            message="",
            act=decision,
            measured=SILENCE_S,
            took_s=-1.0,
            bound_s=-1.0,
        )
        topic = f"/{self.name}/supervisor/decisions"
        self.sent.append((topic, "mauve_msgs/msg/SupervisorDecision", message, time_ns))

    def record(self, directory: Path) -> None:
        """Write the bag."""
        recorder = Recorder(self.source, directory, node_name=f"/{self.name}/executor")
        recorder.start()
        for topic, type_name, data, time_ns in self.sent:
            recorder.record(topic, type_name, data, monotonic_ns=time_ns)
        recorder.stop()


def make_mission(directory: Path, area: MissionArea, times_s: tuple[float, float, float]) -> MissionFacts:
    """Bags of two robots that lose their link, swap 1 s later, and swap back 3 s after its return."""
    loss_s, back_s, duration_s = times_s
    messages = Messages()
    height, width = area.cells.shape
    corners = {"robot_1": (height // 2, 8), "robot_2": (height // 2, width - 9)}
    for robot, cell in corners.items():
        fake = FakeRobot(robot, area, messages, Explorer(area, cell))
        fake.explore(0, loss_s + 0.4)
        fake.explore(loss_s + 1.6, duration_s)
        late_s = 0.011 if robot == "robot_1" else 0.203
        fake.run(duration_s, {loss_s + 1 + late_s: ALONE, back_s + 3 + late_s: PEERS})
        fake.record(directory / "bag" / robot)

    def scheduled(index: int) -> ComponentFacts:
        return ComponentFacts(policy="SCHED_FIFO", priority=80 - 10 * index, cpus=[1])

    centre = {
        robot: (area.origin_x_m + (cell[1] + 0.5) * 0.1, area.origin_y_m + (cell[0] + 0.5) * 0.1, 0.0)
        for robot, cell in corners.items()
    }
    return MissionFacts(
        map_path=Path("office.yaml"),
        radius_m=0.2,
        starts=centre,
        started_ns=EPOCH_NS,
        ended_ns=EPOCH_NS + round(duration_s * S),
        link_down_ns=[(EPOCH_NS + round(loss_s * S), EPOCH_NS + round(back_s * S))],
        link_loss_s=loss_s,
        link_back_s=back_s,
        components={
            robot: {name: scheduled(index) for index, name in enumerate(PERIODS_NS)} for robot in corners
        },
        realtime=RealtimeFacts(granted=True, missing=[]),
    )
