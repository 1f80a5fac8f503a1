"""Task sets with known response times, from papers and text-books or worked out by hand."""

from dataclasses import dataclass

from sporadic_tasks import SporadicTask, response_times

from mauve_rt.analysis.critical_section import CriticalSection


def task(name: str, *, period: int, cost: int, priority: int, **others: object) -> SporadicTask:
    """A task whose deadline is its period if none is given."""
    facts: dict[str, object] = {"deadline_ns": period, **others}
    return SporadicTask(
        name=name,
        separation_ns=period,
        cost_ns=cost,
        priority=priority,
        **facts,  # type: ignore[arg-type]
    )


def section(resource: str, length: int, inside: str = "") -> CriticalSection:
    return CriticalSection(resource=resource, length_ns=length, inside=inside)


@dataclass(frozen=True)
class Example:
    """Tasks, and the response time of each in their order."""

    name: str
    tasks: tuple[SporadicTask, ...]
    expected_ns: tuple[int | None, ...]

    def holds(self) -> bool:
        return tuple(bound.response_ns for bound in response_times(self.tasks)) == self.expected_ns


EXAMPLES = (
    Example(
        "Liu and Layland 1973: periods 2 and 5, the largest second cost",
        (task("a", period=2, cost=1, priority=2), task("b", period=5, cost=2, priority=1)),
        (1, 4),
    ),
    Example(
        "Joseph and Pandya 1986, as set C of Burns and Wellings, Real-Time Systems and Programming Languages",
        (
            task("a", period=7, cost=3, priority=3),
            task("b", period=12, cost=3, priority=2),
            task("c", period=20, cost=5, priority=1),
        ),
        (3, 6, 20),
    ),
    Example(
        "Joseph and Pandya 1986, harmonic periods and utilization 1 (Burns and Wellings)",
        (
            task("a", period=80, cost=40, priority=1),
            task("b", period=40, cost=10, priority=2),
            task("c", period=20, cost=5, priority=3),
        ),
        (80, 15, 5),
    ),
    Example(
        "Lehoczky 1990: arbitrary deadlines, the fifth job is the worst",
        (
            task("a", period=70, cost=26, priority=2),
            task("b", period=100, cost=62, priority=1, deadline_ns=118),
        ),
        (26, 118),
    ),
    Example(
        "Tindell 1994: jitter of a higher priority, whose second job comes right at the finish",
        (task("a", period=10, cost=3, priority=2, jitter_ns=2), task("b", period=20, cost=5, priority=1)),
        (5, 8),
    ),
    Example(
        "Tindell 1994: jitter of a higher priority, whose second job comes before the finish",
        (task("a", period=10, cost=3, priority=2, jitter_ns=3), task("b", period=20, cost=5, priority=1)),
        (6, 11),
    ),
    Example(
        "Tindell 1994: jitter above the period, so that three jobs are released at once",
        (task("a", period=5, cost=1, priority=1, jitter_ns=12),),
        (13,),
    ),
    Example(
        "Sha, Rajkumar, Lehoczky 1990: push-through blocking of a task that locks nothing",
        (
            task("a", period=50, cost=5, priority=3, sections=(section("s", 1),)),
            task("b", period=60, cost=7, priority=2),
            task("c", period=90, cost=9, priority=1, sections=(section("s", 4),)),
        ),
        (9, 16, 21),
    ),
    Example(
        "Sha, Rajkumar, Lehoczky 1990: once for each lower task and once for each semaphore (5 + 1 or 4 + 3)",
        (
            task("a", period=100, cost=5, priority=3, sections=(section("s", 1), section("t", 1))),
            task("b", period=100, cost=10, priority=2, sections=(section("s", 5), section("t", 4))),
            task("c", period=100, cost=10, priority=1, sections=(section("s", 3), section("t", 1))),
        ),
        (12, 18, 25),
    ),
    Example(
        "Sha, Rajkumar, Lehoczky 1990: transitive, c holds t that b locks inside s",
        (
            task("a", period=100, cost=5, priority=3, sections=(section("s", 1),)),
            task("b", period=100, cost=10, priority=2, sections=(section("s", 5), section("t", 4, "s"))),
            task("c", period=100, cost=10, priority=1, sections=(section("t", 3),)),
        ),
        (13, 18, 25),
    ),
    Example(
        "Equal priorities: no preemption by the second job of a, which is released at 10",
        (task("a", period=10, cost=3, priority=1), task("b", period=100, cost=8, priority=1)),
        (11, 11),
    ),
    Example(
        "Equal priorities: b catches up with its backlog of four jobs before c starts at 34",
        (
            task("a", period=1000, cost=30, priority=1),
            task("b", period=10, cost=1, priority=1, deadline_ns=40),
            task("c", period=1000, cost=5, priority=1),
        ),
        (36, 36, 39),
    ),
    Example(
        "Utilization above 1 has no bound; the higher priority has",
        (task("a", period=10, cost=6, priority=2), task("b", period=10, cost=5, priority=1)),
        (6, None),
    ),
)
