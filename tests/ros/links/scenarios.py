"""What befalls a pair of robots, scenario by scenario, and what their supervisors made of it.

Each takes a pair at rest (both usual, each hears the other) and leaves it so. Instants are time.time()'s.
"""

import itertools
import random
import signal
import time
from collections.abc import Callable
from dataclasses import dataclass, field

from robots import COOLDOWN_S, SILENCE_S, UNDO_S, Decision, Pair, Robot

LEASE_S = 20.0  # of Fast DDS, after which who is unheard is forgotten
AT_REST_S = COOLDOWN_S + 0.3  # after which nothing that was before holds a rule back
RANDOM = random.Random(1)  # noqa: S311 - no secret


@dataclass
class Outcome:
    """What came of it."""

    began_s: float
    mended_s: float = 0.0  # when what had befallen them was over
    told: dict[str, list[Decision]] = field(default_factory=dict)  # by robot, from the beginning on

    def acted(self, robot: str) -> list[str]:
        """The `do` and `undo` that were done, in order."""
        return [told.reason.partition(":")[0] for told in self.told[robot] if told.what == "done"]

    def instants(self, robot: str, what: str) -> list[float]:
        """When a robot decided so, of what was done: one that failed is tried again."""
        instants, decided_s = [], 0.0
        for told in self.told[robot]:
            if told.what == what:
                decided_s = told.time_s
            elif told.what == "done" and told.reason.startswith(f"{what}:"):
                instants.append(decided_s)
        return instants

    def after_s(self, robot: str, what: str) -> float:
        """From the cause to a robot's first `do`; from its end to its last `undo`."""
        instants = self.instants(robot, what)
        return instants[0] - self.began_s if what == "do" else instants[-1] - self.mended_s


def begin(pair: Pair) -> None:
    """Start both at once; until both hear each other."""
    began_s = time.time()
    for robot in pair.both:
        robot.start()
    _await(pair, lambda robot: "armed" in robot.said(since_s=began_s), pair.both, "arming")
    time.sleep(SILENCE_S)  # one that does not hear the other yet acts by then
    _settle(pair, began_s)


def link_down(pair: Pair, *, for_s: float) -> Outcome:
    """The cable of one is out for a while."""
    outcome = _begin()
    pair.hosts.set_link("robot_2", up=False)
    time.sleep(for_s)
    pair.hosts.set_link("robot_2", up=True)
    return _end(pair, outcome, acting=pair.both)


def loss(pair: Pair, *, percent: int, for_s: float) -> Outcome:
    """Both lose a share of what comes."""
    outcome = _begin()
    for robot in pair.both:
        pair.hosts.set_loss(robot.name, percent)
    time.sleep(for_s)
    for robot in pair.both:
        pair.hosts.set_loss(robot.name, 0)
    return _end(pair, outcome)


def frozen(pair: Pair, *, for_s: float = 3.0) -> Outcome:
    """The executor of one stands still for a while, and goes on."""
    outcome = _begin()
    pair.two.signal("executor", signal.SIGSTOP)
    time.sleep(for_s)
    pair.two.signal("executor", signal.SIGCONT)
    return _end(pair, outcome, acting=[pair.one])


def executor_killed(pair: Pair) -> Outcome:
    """The executor of one dies under its living supervisor, and is started anew."""
    outcome = _begin()
    pair.two.signal("executor", signal.SIGKILL)
    _await(pair, lambda robot: "do" in robot.acted(since_s=outcome.began_s), [pair.one], "the swap")
    outcome.mended_s = time.time()
    pair.two.start("executor")
    _await(pair, lambda robot: "armed" in robot.said(since_s=outcome.began_s), [pair.two], "arming anew")
    return _end(pair, outcome, acting=[pair.one])


def supervisor_killed(pair: Pair) -> Outcome:
    """The supervisor of one dies and is started anew, all being well."""
    outcome = _begin()
    pair.two.signal("supervisor", signal.SIGKILL)
    pair.two.start("supervisor")
    _await(pair, lambda robot: "armed" in robot.said(since_s=outcome.began_s), [pair.two], "arming anew")
    time.sleep(SILENCE_S + 1.0)
    return _end(pair, outcome)


def supervisor_killed_while_degraded(pair: Pair) -> Outcome:
    """It dies and is started anew while the link is down; then the link is back."""
    outcome = _begin()
    pair.hosts.set_link("robot_2", up=False)
    _await(pair, lambda robot: "do" in robot.acted(since_s=outcome.began_s), pair.both, "the swap")
    pair.two.signal("supervisor", signal.SIGKILL)
    began_s = time.time()
    pair.two.start("supervisor")
    _await(pair, lambda robot: "adopted" in robot.said(since_s=began_s), [pair.two], "its successor")
    pair.hosts.set_link("robot_2", up=True)
    return _end(pair, outcome, acting=pair.both)


def never_spoke(pair: Pair) -> Outcome:
    """One is not there from the beginning; then it is. For a pair that was not begun."""
    outcome = _begin()
    pair.one.start()
    _await(pair, lambda robot: "do" in robot.acted(), [pair.one], "the swap")
    outcome.mended_s = time.time()
    pair.two.start()
    _await(pair, lambda robot: "armed" in robot.said(), [pair.two], "arming")
    return _end(pair, outcome, acting=[pair.one])


def link_down_from_the_start(pair: Pair) -> Outcome:
    """Both start while the cable of one is out. For a pair that was not begun."""
    pair.hosts.set_link("robot_2", up=False)
    outcome = _begin()
    for robot in pair.both:
        robot.start()
    _await(pair, lambda robot: "do" in robot.acted(), pair.both, "the swap")
    pair.hosts.set_link("robot_2", up=True)
    return _end(pair, outcome, acting=pair.both)


def flapping(pair: Pair, *, for_s: float) -> Outcome:
    """The link comes and goes, for 0.3 to 3 s each."""
    outcome = _begin()
    for up in itertools.cycle((False, True)):
        if up and time.time() > outcome.began_s + for_s:
            break
        pair.hosts.set_link("robot_2", up=up)
        time.sleep(RANDOM.uniform(0.3, 3.0))
    pair.hosts.set_link("robot_2", up=True)
    return _end(pair, outcome)


def _begin() -> Outcome:
    return Outcome(began_s=time.time())


def _end(pair: Pair, outcome: Outcome, *, acting: "list[Robot] | tuple[Robot, ...]" = ()) -> Outcome:
    """Let all come back to rest: what was done is undone."""
    outcome.mended_s = outcome.mended_s or time.time()
    _await(pair, lambda robot: "undo" in robot.acted(since_s=outcome.began_s), acting, "the way back")
    _settle(pair, outcome.began_s)
    time.sleep(AT_REST_S)
    outcome.told = {robot.name: robot.decisions(since_s=outcome.began_s) for robot in pair.both}
    return outcome


def _settle(pair: Pair, since_s: float) -> None:
    """Until what was done is undone, and nothing has been decided for as long as an undo takes."""

    def is_usual(robot: Robot) -> bool:
        decisions = robot.decisions(since_s=since_s)
        quiet = not decisions or time.time() > decisions[-1].time_s + UNDO_S + 0.3
        return quiet and robot.acted()[-1:] != ["do"]

    _await(pair, is_usual, pair.both, "both to be usual again")


def _await(
    pair: Pair, condition: Callable[[Robot], bool], robots: "list[Robot] | tuple[Robot, ...]", what: str
) -> None:
    for robot in robots:
        pair.until(lambda robot=robot: condition(robot), f"{what} ({robot.name})")  # type: ignore[misc]


Scenario = Callable[[Pair], Outcome]
BOTH, ONE, NOBODY = ("robot_1", "robot_2"), ("robot_1",), ()
LOSS_S, FLAPPING_S = 4.0, 8.0

# By group: the first scenario begins the pair, or `begin` does.
GROUPS: list[dict[str, Scenario]] = [
    {
        "never spoke": never_spoke,
        "down longer than the lease": lambda pair: link_down(pair, for_s=LEASE_S + 3.0),
        "frozen": frozen,
    },
    {
        "down from the start": link_down_from_the_start,
        "down 3 s": lambda pair: link_down(pair, for_s=3.0),
        "supervisor killed while degraded": supervisor_killed_while_degraded,
        "10 % lost": lambda pair: loss(pair, percent=10, for_s=LOSS_S),
        "30 % lost": lambda pair: loss(pair, percent=30, for_s=LOSS_S),
        "50 % lost": lambda pair: loss(pair, percent=50, for_s=LOSS_S),
    },
    {
        "begin": begin,
        "flapping": lambda pair: flapping(pair, for_s=FLAPPING_S),
        "executor killed": executor_killed,
        "supervisor killed": supervisor_killed,
    },
]
ACTING = {
    "down 3 s": BOTH,
    "down longer than the lease": BOTH,
    "down from the start": BOTH,
    "supervisor killed while degraded": BOTH,
    "frozen": ONE,
    "executor killed": ONE,
    "never spoke": ONE,
    "10 % lost": NOBODY,
    "30 % lost": NOBODY,
    "50 % lost": NOBODY,
    "supervisor killed": NOBODY,
}

# Who starts anew may take longer to discover the other one than the other one may be silent: once, then.
LATECOMERS = {"never spoke": "robot_2", "supervisor killed": "robot_2"}


def acted_as_expected(name: str, outcome: Outcome) -> bool:
    """Whether each acted as often as it should have: once and back, or not at all."""
    for robot in BOTH:
        allowed = [["do", "undo"]] if robot in ACTING[name] else [[]]
        if LATECOMERS.get(name) == robot:
            allowed.append(["do", "undo"])
        if outcome.acted(robot) not in allowed:
            return False
    return True


def is_calm(outcome: Outcome) -> bool:
    """Whether nobody swapped more often than the cooldown lets it, and all was undone."""
    for robot in BOTH:
        acted = outcome.acted(robot)
        instants = sorted(outcome.instants(robot, "do") + outcome.instants(robot, "undo"))
        if acted != ["do", "undo"] * (len(acted) // 2):
            return False
        if any(after - before < COOLDOWN_S - 0.05 for before, after in itertools.pairwise(instants)):
            return False
    return True
