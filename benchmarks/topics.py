"""What topics cost: messages of a 1 kHz component beside those of a bare rcl publisher, and of rclpy.

Every side publishes the same messages on the same topics to the same subscriber, a bare rcl program, in turn.
"""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import native
import numpy as np
import numpy.typing as npt
from executor_process import ExecutorProcess
from native import BenchmarkError
from processes import Processes
from ratios import percentile
from rows import Row, alone, compared
from scope import Scope
from settings import Settings
from talkers import Talkers, plugin_prefix

from mauve_rt.cli.client import connected

MANY = 20
_RATE_HZ = 1000
_SETTLE_S = 0.2  # left out on all sides: starts, and caches that are cold
_HERE = Path(__file__).parent
_NAMESPACE = "/bench_topics"
_RCLPY = "rclpy node with a timer each"

Messages = npt.NDArray[np.int64]
"""Rows of topic, number, instant sent, instant taken."""
Releases = npt.NDArray[np.int64]
"""Rows of nominal and actual instant."""
_TOPIC, _NUMBER, _SENT, _TAKEN = range(4)


class Window(NamedTuple):
    """When a side was measured, and the CPU time that its process used meanwhile."""

    begin_ns: int
    end_ns: int
    cpu_ns: int

    @property
    def cpu_percent(self) -> float:
        """Of one CPU."""
        return 100 * self.cpu_ns / (self.end_ns - self.begin_ns)


@dataclass(frozen=True)
class Side:
    """A process that publishes between start and stop."""

    pid: int
    start: Callable[[], None]
    stop: Callable[[], None]

    def measured(self, duration_s: float) -> Window:
        """Publish for a while."""
        self.start()
        time.sleep(_SETTLE_S)
        cpu_ns, begin_ns = process_cpu_ns(self.pid), time.monotonic_ns()
        time.sleep(duration_s)
        cpu_ns, end_ns = process_cpu_ns(self.pid) - cpu_ns, time.monotonic_ns()
        self.stop()
        return Window(begin_ns, end_ns, cpu_ns)


def process_cpu_ns(pid: int) -> int:
    """CPU time of a process so far, its ended threads included: its clock, as of clock_getcpuclockid(3)."""
    return time.clock_gettime_ns(~pid << 3 | 2)


def latencies_ns(messages: Messages, window: Window) -> list[float]:
    """From the instant sent to the instant taken, of what was sent in the window."""
    chosen = _sent_in(messages, window)
    found: list[float] = (chosen[:, _TAKEN] - chosen[:, _SENT]).astype(np.float64).tolist()
    return found


def lost_percent(messages: Messages, window: Window, topics: int) -> float:
    """Of the messages due in the window, a thousand a second and topic, those that never arrived."""
    due = topics * _RATE_HZ * (window.end_ns - window.begin_ns) / 1e9
    return max(0.0, 100 * (1 - len(_sent_in(messages, window)) / due))


def lost_on_the_way(messages: Messages, window: Window) -> int:
    """Messages that were written in the window and never arrived: gaps in the numbers of a topic."""
    chosen = _sent_in(messages, window)
    numbers = [chosen[chosen[:, _TOPIC] == topic, _NUMBER] for topic in np.unique(chosen[:, _TOPIC])]
    return sum(int(of_topic.max() - of_topic.min() + 1) - len(of_topic) for of_topic in numbers)


def _sent_in(messages: Messages, window: Window) -> Messages:
    return messages[(messages[:, _SENT] >= window.begin_ns) & (messages[:, _SENT] < window.end_ns)]


class Stage(Scope):
    """A context: subscriber, publishers and executors on the same topics, none of which publishes yet."""

    def __init__(self, settings: Settings, *, topics: int) -> None:
        self._settings = settings
        self._topics = topics
        super().__init__()
        self._executors: list[tuple[ExecutorProcess, Talkers]] = []
        self._publishers = 0
        self._releases = round(_RATE_HZ * (settings.topics_s + 5) * (settings.rounds + 1))  # room enough

    def _enter(self, stack: ExitStack) -> None:
        self._processes = stack.enter_context(Processes())
        self._plugins = plugin_prefix(self._processes.folder)
        self._client = stack.enter_context(connected())

    def executor(self, name: str, *, bound: bool = True, sent_anywhere: bool = True) -> Side:
        """An executor with one component that writes to all topics, or to resources bound to none.

        Its messages are sent on any CPU, as where the file says nothing, or, as those of the bare publisher,
        on the component's.
        """
        talkers = Talkers(
            self._processes.folder / f"{name}.yaml",
            topics=self._topics,
            bound=_NAMESPACE if bound else "",
            priority=self._settings.priority,
            cpu=self._settings.cpu,
            releases=self._releases,
            sent_anywhere=sent_anywhere,
        )
        process = ExecutorProcess(self._processes, talkers.architecture, name=name, plugins=self._plugins)
        self._executors.append((process, talkers))
        self._publishers += bound
        (component,) = talkers.names
        process.stop(self._client, component)
        return Side(
            process.pid,
            lambda: process.start(self._client, component),
            lambda: process.stop(self._client, component),
        )

    def bare(self) -> Sequence[Side]:
        """A bare rcl publisher of all topics; the same process when its loop publishes nothing."""
        place = ("--priority", str(self._settings.priority), "--cpu", str(self._settings.cpu))
        records = ("--releases", str(2 * self._releases), "--file", str(self._processes.folder / "bare"))
        words = ("publish", *self._named(), *place, *records)
        return self._told("bare", "rcl_program.py", *words, starts=("start", "idle"))

    def rclpy(self) -> Side:
        """A node of rclpy that publishes all topics."""
        (side,) = self._told("rclpy", "rclpy_publisher.py", _NAMESPACE, str(self._topics))
        return side

    def subscribe(self) -> None:
        """Start the subscriber; returns when it knows all publishers."""
        s = self._settings
        seconds = (s.topics_s + 5 * _SETTLE_S) * s.rounds * self._publishers
        capacity = round(_RATE_HZ * self._topics * seconds)
        self._taken = self._processes.folder / "taken"
        self._processes.spawn(
            "subscriber",
            *(str(_HERE / "rcl_program.py"), "subscribe", *self._named(), "--file", str(self._taken)),
            *("--publishers", str(self._publishers), "--capacity", str(capacity)),
        )
        self._processes.await_output("subscriber", "ready")

    def messages(self) -> Messages:
        """All that the subscriber took; it takes no more."""
        self._processes.tell("subscriber", "write")
        self._processes.await_output("subscriber", "written")
        return np.fromfile(self._taken, np.int64).reshape(-1, 4)

    def bare_releases(self) -> Releases:
        """Of the bare publisher's loop."""
        self._processes.tell("bare", "write")
        self._processes.await_output("bare", "written")
        return np.fromfile(self._processes.folder / "bare", np.int64).reshape(-1, 2)

    def releases(self) -> list[Releases]:
        """Of the components, in the order of their executors, which end by it."""
        for process, _ in self._executors:
            process.end()
        return [talkers.releases()[0][1:] for _, talkers in self._executors]

    def _named(self) -> Sequence[str]:
        return "--namespace", _NAMESPACE, "--topics", str(self._topics)

    def _told(
        self, name: str, program: str, *words: str, starts: tuple[str, ...] = ("start",)
    ) -> Sequence[Side]:
        pid = self._processes.spawn(name, str(_HERE / program), *words)
        self._processes.await_output(name, "ready")
        self._publishers += 1

        def teller(line: str) -> Callable[[], None]:
            return lambda: self._processes.tell(name, line)

        return [Side(pid, teller(start), teller("stop")) for start in starts]


def topic_rows(settings: Settings) -> Iterator[Row]:
    """Latency of one topic's messages; then what many topics cost."""
    yield from _latency_rows(settings)
    yield from _load_rows(settings)


def _latency_rows(settings: Settings) -> Iterator[Row]:
    """One topic: rounds of the executor's component and of the bare publisher."""
    with Stage(settings, topics=1) as stage:
        sides = (stage.executor("executor"), stage.bare()[0], stage.executor("pinned", sent_anywhere=False))
        rounds = _rounds(stage, settings, sides)
        messages = stage.messages()
    what = "a Point from a 1 kHz component's write to another process's subscription"
    for percent in (50, 99):
        latencies = [[_latency_us(messages, window, percent) for window in found] for found in rounds]
        beside = "bare rcl publisher, same subscriber"
        anywhere = [(anywhere, bare) for anywhere, bare, _ in latencies]
        yield compared(f"{what}, p{percent}", anywhere, unit="us", beside=beside, ratio_limit=1.2)
        here = [(here, bare) for _, bare, here in latencies]
        yield compared(f"the same, sent on the component's CPU, p{percent}", here, unit="us", beside=beside)


def _load_rows(settings: Settings) -> Iterator[Row]:
    """Twenty topics, all rounds interleaved.

    The executor, the bare publisher, rclpy; an executor whose resources are bound to no topic, and the bare
    publisher's loop when it publishes nothing.
    """
    with Stage(settings, topics=MANY) as stage:
        bare, idle = stage.bare()
        sides = (stage.executor("executor"), bare, stage.rclpy(), stage.executor("quiet", bound=False), idle)
        rounds = _rounds(stage, settings, sides)
        messages = stage.messages()
        bare_releases = stage.bare_releases()
        releases, quiet_releases = stage.releases()
    yield from _cpu_rows(rounds)
    yield from _loss_rows(messages, rounds)
    for percent in (50, 99):
        yield compared(
            f"wake-up latency of the 1 kHz component that writes these {MANY} topics, p{percent}",
            _wakeup_pairs(releases, quiet_releases, [(found[0], found[3]) for found in rounds], percent),
            unit="us",
            beside="its resources bound to no topic",
            ratio_limit=1.1,
        )
    for percent in (50, 99):
        yield compared(
            f"the same of the bare publisher's loop, p{percent}",
            _wakeup_pairs(bare_releases, bare_releases, [(found[1], found[4]) for found in rounds], percent),
            unit="us",
            beside="it publishes nothing",
        )


def _wakeup_pairs(
    busy: Releases, idle: Releases, windows: Sequence[tuple[Window, Window]], percent: float
) -> list[tuple[float, float]]:
    """Wake-up latencies of a loop that sends, and of one that does not, in us."""
    return [(_wakeup_us(busy, one, percent), _wakeup_us(idle, other, percent)) for one, other in windows]


def _cpu_rows(rounds: list[list[Window]]) -> Iterator[Row]:
    what = f"CPU of an executor that sends {MANY} topics at 1 kHz"
    cpu = [[window.cpu_percent for window in found] for found in rounds]
    beside = "bare rcl publisher"
    yield compared(what, [(found[0], found[1]) for found in cpu], unit="%", beside=beside, ratio_limit=1.3)
    yield compared(what, [(found[0], found[2]) for found in cpu], unit="%", beside=_RCLPY)
    yield alone("the same executor's when it sends none of them", [found[3] for found in cpu], unit="%")


def _loss_rows(messages: Messages, rounds: list[list[Window]]) -> Iterator[Row]:
    for place, who in enumerate(("the executor", "bare rcl publisher", _RCLPY)):
        lost = [lost_percent(messages, found[place], MANY) for found in rounds]
        gaps = sum(lost_on_the_way(messages, found[place]) for found in rounds)
        note = (
            f"{gaps} messages were written and never arrived; the others were not written when they were due"
        )
        yield alone(f"of the messages due on {MANY} topics, lost: {who}", lost, unit="%", note=note)


def _rounds(stage: Stage, settings: Settings, sides: Sequence[Side]) -> list[list[Window]]:
    def measure(side: Side) -> Callable[[int], Window]:
        return lambda _: side.measured(settings.topics_s)

    stage.subscribe()
    return native.interleaved(settings.rounds, *map(measure, sides))


def _latency_us(messages: Messages, window: Window, percent: float) -> float:
    found = latencies_ns(messages, window)
    if not found:
        raise BenchmarkError("no message arrived")
    return percentile(found, percent) / 1e3


def _wakeup_us(releases: Releases, window: Window, percent: float) -> float:
    nominal, actual = releases[(releases[:, 0] >= window.begin_ns) & (releases[:, 0] < window.end_ns)].T
    return percentile((actual - nominal).tolist(), percent) / 1e3
