"""`mauve analyze --chain FROM:TO`: the bounds of a chain, and what a bag shows of it."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Any

from mauve_rt.analysis.chains import RouteBound, assumptions_of, route_bound
from mauve_rt.analysis.machines import in_ms
from mauve_rt.analysis.study import Study
from mauve_rt.analysis.verdict import Outcome
from mauve_rt.cli.chain_routes import Wiring
from mauve_rt.trace.errors import TraceError
from mauve_rt.trace.reading.chains import ChainTimes, Jobs, chain_times, jobs_of
from mauve_rt.trace.reading.statistics import Distribution

_FIGURES = {"reaction": "reaction", "data_age": "data age"}
"""Fields of ChainTimes, and how they are written."""


@dataclass(frozen=True)
class JudgedRoute:
    """One route of a chain."""

    bound: RouteBound
    measured: ChainTimes | None
    waits_in_queues: bool
    """Whether the measured times lack the time in a queue."""
    not_measured: str = ""
    """Why a bag does not show it."""

    @property
    def contradictions(self) -> list[str]:
        """Measured times above the bound."""
        if self.measured is None or self.bound.longest_ns is None:
            return []
        measured = {words: getattr(self.measured, name) for name, words in _FIGURES.items()}
        return [
            f"{words} of {in_ms(one.max_ns)} measured, and its bound is {in_ms(self.bound.longest_ns)}"
            for words, one in measured.items()
            if one.max_ns > self.bound.longest_ns
        ]


@dataclass(frozen=True)
class JudgedChain:
    """All routes of `--chain`, the longest first."""

    name: str
    routes: tuple[JudgedRoute, ...]
    assumptions: tuple[str, ...]

    @property
    def longest_ns(self) -> int | None:
        """Of all routes; None: one has no bound."""
        found = [one.bound.longest_ns for one in self.routes]
        return None if None in found else max(one for one in found if one is not None)

    @property
    def reasons(self) -> list[str]:
        """Why it has no bound."""
        return list(dict.fromkeys(why for one in self.routes for why in one.bound.reasons))

    @property
    def contradictions(self) -> list[str]:
        """Of all routes."""
        return [f"{one.bound.route}: {why}" for one in self.routes for why in one.contradictions]

    @property
    def outcome(self) -> Outcome:
        """What is known; whether its times are measured, the verdict of the architecture says."""
        if self.longest_ns is None:
            return Outcome.NOT_PROVABLE
        return Outcome.REFUTED if self.contradictions else Outcome.SCHEDULABLE


def judged_chains(
    words: Sequence[str], wiring: Wiring, now: Study, *, wakeup_ns: int, bag: Path | None
) -> list[JudgedChain]:
    """Each chain that is named; `bag`: to measure them in.

    Raises:
        ParameterError: a name is unknown, or there is no way.
    """
    import mauve_rt.trace  # noqa: PLC0415 - only with a bag

    trace = None if bag is None else mauve_rt.trace.open(bag)
    jobs = None if trace is None else cache(lambda component: jobs_of(trace.of(component)))
    chains = []
    for word in words:
        routes = wiring.routes(word)
        bounds = [route_bound(route, wiring.channels, now, wakeup_ns=wakeup_ns) for route in routes]
        judged = [_judged(bound, wiring, jobs) for bound in bounds]
        judged.sort(key=lambda one: -(one.bound.longest_ns or 0))
        chains.append(JudgedChain(word, tuple(judged), tuple(assumptions_of(routes, wiring.channels))))
    return chains


def _judged(bound: RouteBound, wiring: Wiring, jobs: Callable[[str], Jobs] | None) -> JudgedRoute:
    """A route, measured where there is a bag with the jobs of its members."""
    known = (wiring.channels[name] for name in bound.route.channels[:-1] if name)
    waits_in_queues = any(channel.is_queue for channel in known)
    try:
        measured = None if jobs is None else chain_times([jobs(name) for name in bound.route.members])
    except TraceError as error:
        return JudgedRoute(bound, None, waits_in_queues, str(error))
    return JudgedRoute(bound, measured, waits_in_queues)


def print_chain(chain: JudgedChain) -> None:
    """Print the bound with the term of each member, each further route, and the measured times."""
    for line in _lines(chain):
        print(line)


def _lines(chain: JudgedChain) -> Iterator[str]:
    if chain.longest_ns is None:
        yield f"{chain.name}: not provable: no bound of reaction and data age"
        yield from (f"  {why}" for why in chain.reasons)
    else:
        yield f"{chain.name}: {_bound(chain.routes[0].bound)}"
    for one in chain.routes:
        if len(chain.routes) > 1 and one.bound.longest_ns is not None:
            yield f"  {one.bound.route}: {_bound(one.bound)}"
        elif len(chain.routes) > 1 or chain.longest_ns is None:
            yield f"  route {one.bound.route}"
        if one.not_measured:
            yield f"    not measured: {one.not_measured}"
        if one.measured is not None:
            measured = "at least, without the time in a queue, " if one.waits_in_queues else ""
            for name, words in _FIGURES.items():
                yield f"    measured {words}: {measured}{_distribution(getattr(one.measured, name))}"
    if chain.contradictions:
        yield f"  model refuted: {'; '.join(chain.contradictions)}"
    if chain.longest_ns is not None:
        yield from (f"  if {each}" for each in chain.assumptions)


def _bound(bound: RouteBound) -> str:
    longest = in_ms(bound.longest_ns or 0)
    terms = ", ".join(map(str, bound.terms))
    return f"reaction at most {longest}, data age at most {longest}: {terms}"


def _distribution(found: Distribution) -> str:
    if not found.count:
        return "not seen from begin to end"
    figures = {"min": found.min_ns, "median": found.p50_ns, "99 %": found.p99_ns, "max": found.max_ns}
    return f"{', '.join(f'{name} {in_ms(ns)}' for name, ns in figures.items())} (n = {found.count:,})"


def chain_json(chain: JudgedChain) -> dict[str, Any]:
    """As `mauve analyze --json` prints it."""
    return {
        "chain": chain.name,
        "outcome": chain.outcome,
        "reaction_ns": chain.longest_ns,
        "data_age_ns": chain.longest_ns,
        "reasons": chain.reasons,
        "contradictions": chain.contradictions,
        "assumptions": chain.assumptions,
        "routes": [_route_json(one) for one in chain.routes],
    }


def _route_json(one: JudgedRoute) -> dict[str, Any]:
    return {
        "route": str(one.bound.route),
        "longest_ns": one.bound.longest_ns,
        "terms": [asdict(term) for term in one.bound.terms],
        "reasons": one.bound.reasons,
        "measured": None if one.measured is None else asdict(one.measured),
        "not_measured": one.not_measured,
        "measured_without_queues": one.waits_in_queues,
    }
