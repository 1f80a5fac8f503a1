"""Bounds of chains: how long a change at the begin takes to the end, and how old the data at the end is.

A member is a component, and a channel is the resource between two members. Components read and write at any
time in a job (explicit communication), so only two facts of a member count: the longest time T between two
releases, and the bound R of its response.

Theorem (Davare et al., DAC 2007, for digraph tasks). The maximum reaction time is at most the sum of T + R
over the members. Proof: let a value be in the channel before a member at t. The next release is at t + T at
the latest. That job reads at or after its release, so the job reads this value or a newer one, and writes at
its finish at the latest: t + T + R. This instant is the t of the next member.

1. A queue of N elements that drops its oldest: at most N - 1 elements are ahead, and each job takes at least
   one. So the job of the Nth release takes the value or a newer one: N T in place of T.
2. A member of higher priority than the next one on the same CPU (Durr et al., CASES 2019, theorem 5.4): let J
   be the longest wake-up. From r + J on, the thread of the job that was released at r is awake or has
   finished. While the job is not finished, no job of the next member begins. So the jobs that the next member
   releases from r + J on read the value: J in place of R. This does not hold for a member that leaves the CPU
   before its finish: a member that waits for a service, or for a lock that a thread on another CPU may hold.

The maximum data age is the same figure (Gunzel et al., ECRTS 2023). Proof: jobs of one component follow each
other, so the source times of the values at the end never decrease. Just before the end shows a source time
of t or later, it shows one before t. Both maxima are the largest distance between such a pair.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from mauve_rt.analysis.bounds import Bound, Subject
from mauve_rt.analysis.machines import FOREVER_NS, in_ms
from mauve_rt.analysis.study import Study

_REGISTERS = ("shared_data", "latest_value")
"""Kinds of resources whose readers get the newest value."""
_QUEUE = "ring_buffer"


@dataclass(frozen=True)
class Channel:
    """A resource, as far as a chain through it needs to know."""

    name: str
    kind: str = ""
    """Empty: nothing says it."""
    capacity: int = 0
    """Of a queue; 0: nothing says it."""
    overwrites: bool = False
    """Whether a full queue drops its oldest element, not the new one."""
    writers: tuple[str, ...] = ()
    """Components, and a topic that is written into it."""
    readers: tuple[str, ...] = ()
    topics: tuple[str, ...] = ()
    """That it is bound to, with their namespaces."""

    @property
    def is_queue(self) -> bool:
        """Whether each element has one reader."""
        return self.kind == _QUEUE


@dataclass(frozen=True)
class Route:
    """One way through the components."""

    members: tuple[str, ...]
    channels: tuple[str, ...]
    """In front of each member and behind the last one; empty: the chain begins or ends at the member."""

    def __str__(self) -> str:
        """As `scan -> control -> command`."""
        names = [self.channels[0]]
        for member, channel in zip(self.members, self.channels[1:], strict=True):
            names += [member, channel]
        return " -> ".join(filter(None, names))


@dataclass(frozen=True)
class Term:
    """The part of one member."""

    component: str
    wait_ns: int
    """The longest time between two releases."""
    jobs: int
    """That a value waits for: 1, or the capacity of the queue in front."""
    response_ns: int
    counted_ns: int
    """The response, or the wake-up where the next member cannot run before the finish."""

    @property
    def total_ns(self) -> int:
        """The longest time that a value spends here."""
        return self.jobs * self.wait_ns + self.counted_ns

    def __str__(self) -> str:
        """As `control 20.000 + 1.800 ms`."""
        times = f"{self.jobs} x " if self.jobs > 1 else ""
        return f"{self.component} {times}{self.wait_ns / 1e6:,.3f} + {in_ms(self.counted_ns)}"


@dataclass(frozen=True)
class RouteBound:
    """The bound of one route, or the reasons why there is none."""

    route: Route
    terms: tuple[Term, ...]
    reasons: tuple[str, ...] = ()

    @property
    def longest_ns(self) -> int | None:
        """Maximum reaction time and maximum data age; None: nothing is known."""
        return None if self.reasons else sum(term.total_ns for term in self.terms)


def route_bound(
    route: Route, channels: Mapping[str, Channel], study: Study, *, wakeup_ns: int = 0
) -> RouteBound:
    """The bound of a route; `wakeup_ns` as for the bounds of the study."""
    subjects = {subject.name: subject for subject in study.subjects}
    reasons = [f"this computer: {why}" for why in study.unknown]
    terms: list[Term] = []
    for index, name in enumerate(route.members):
        subject, bound = subjects[name], study.bounds[name]
        if why := [*_why_unbounded(subject, bound)]:
            reasons += why
            continue
        follower = subjects[route.members[index + 1]] if index + 1 < len(route.members) else None
        goes_first = follower is not None and _finishes_before(subject, follower, study.subjects)
        response_ns = longest_response_ns(bound)
        counted_ns = min(response_ns, wakeup_ns) if goes_first else response_ns
        channel = channels.get(route.channels[index])
        jobs = channel.capacity if channel is not None and channel.is_queue else 1
        terms.append(Term(name, longest_wait_ns(subject), jobs, response_ns, counted_ns))
    reasons += _why_lost(route, channels)
    return RouteBound(route, tuple(terms), tuple(dict.fromkeys(reasons)))


def longest_wait_ns(subject: Subject) -> int:
    """The longest time between two releases; FOREVER_NS: there may be none."""
    latest_ns = {state.name: state.latest_ns for state in subject.machine.states}
    return max((latest_ns[job.until] for job in subject.task.jobs), default=FOREVER_NS)


def longest_response_ns(bound: Bound) -> int:
    """Of all jobs: the bound itself shows a late one first."""
    return max((one.response_ns for one in bound.jobs), default=0)


def _why_unbounded(subject: Subject, bound: Bound) -> Iterator[str]:
    """Why no figure of a member is known."""
    name = subject.name
    if bound.response_ns is None:
        yield f"{name} has no response bound: {bound.reason}"
    for why in bound.too_long:
        yield f"{name} may be faulted: {why}"
    if longest_wait_ns(subject) == FOREVER_NS:
        latest_ns = {state.name: state.latest_ns for state in subject.machine.states}
        waits = {job.until for job in subject.task.jobs if latest_ns[job.until] == FOREVER_NS}
        named = ", ".join(sorted(waits)) or "its only state"
        yield f"{name} may wait forever in {named}: give the event wait a timeout"
    catches_up = subject.machine.overrun == "catch_up"
    for one in bound.jobs:
        if one.response_ns > one.job.separation_ns and not catches_up:
            took = (
                f"a response of {in_ms(one.response_ns)} and {in_ms(one.job.separation_ns)} to the next one"
            )
            yield f"{name} may miss a release: a job has {took}"
            break


def _finishes_before(subject: Subject, follower: Subject, subjects: Iterable[Subject]) -> bool:
    """Whether no job of the follower begins while a job of the subject is awake and not finished."""
    machine, other = subject.machine, follower.machine
    outside = {lock for one in subjects if not one.machine.is_component for lock in one.machine.locks}
    return (
        machine.cpus == other.cpus
        and len(machine.cpus) == 1
        and machine.priority > other.priority
        and not machine.clients
        and not machine.locks & outside
    )


def _why_lost(route: Route, channels: Mapping[str, Channel]) -> Iterator[str]:
    """Why a value may not come through a channel of the route."""
    last = len(route.channels) - 1
    for index, name in enumerate(route.channels):
        channel = channels.get(name)
        if channel is None:
            continue
        writers = [writer for writer in channel.writers if writer not in route.members[index - 1 : index]]
        if 0 < index < last and writers:
            yield f"{name} has more writers ({', '.join(writers)}): they may hide a value of the chain"
        if channel.is_queue:
            yield from _why_lost_in(channel, is_read=index < last)
        elif channel.kind and channel.kind not in _REGISTERS and index < last:
            yield f"{name} is a {channel.kind}: nothing says when its readers get a value"


def _why_lost_in(queue: Channel, *, is_read: bool) -> Iterator[str]:
    if not queue.capacity:
        yield f"nothing here says the capacity of the queue {queue.name}: analyze the architecture file"
    elif not queue.overwrites:
        yield f"{queue.name} refuses values when it is full: set overwrite to true"
    if is_read and len(queue.readers) > 1:
        names = ", ".join(queue.readers)
        yield f"{queue.name} has several readers ({names}): each takes values of the others"


def assumptions_of(routes: Sequence[Route], channels: Mapping[str, Channel]) -> Iterator[str]:
    """What the figures of a chain take for granted."""
    yield "each job of a member reads its input and then writes its output; of a queue it takes an element"
    inside = {name for route in routes for name in route.channels[:-1] if name in channels}
    if unknown := sorted(name for name in inside if not channels[name].kind):
        yield f"the readers of {', '.join(unknown)} get the newest value (nothing here says the kind)"
    ends = {name for route in routes for name in (route.channels[0], route.channels[-1])}
    if topics := sorted({topic for name in ends if name in channels for topic in channels[name].topics}):
        yield f"no time passes on {', '.join(topics)}: the transport is not counted"
