"""Two runs compared: everything the page and the terminal show, computed once."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

from mauve_rt.trace.errors import TraceError
from mauve_rt.trace.progress import Progress, silent
from mauve_rt.trace.reading.reconfigurations import reconfigurations
from mauve_rt.trace.reading.trace import Trace
from mauve_rt.trace.report.runs.events import Act, CoreChange, Cost, acts_of, costs_of
from mauve_rt.trace.report.runs.timing import ComponentRun, Figure, component_run, only_in, timing_figures
from mauve_rt.trace.report.runs.values import Values, compared_values
from mauve_rt.trace.report.units import listed


@dataclass(frozen=True)
class ComparedRuns:
    """Two runs and where they differ."""

    names: tuple[str, str]
    """Of A and B."""
    traces: tuple[Trace, Trace]
    components: dict[str, tuple[ComponentRun, ComponentRun]]
    """Those that both runs have."""
    only: tuple[list[str], list[str]]
    """Components, and states of shared components, that are only in A and only in B."""
    timing: list[Figure]
    """Of all shared components, judged."""
    values: Values
    acts: tuple[list[Act], list[Act]]
    """Of rules, by time."""
    costs: tuple[dict[CoreChange, Cost], dict[CoreChange, Cost]]
    """Of reconfigurations."""
    tested: int
    """Figures with an interval: these share the 5 %."""
    simulated: bool
    """Both runs are of simulated time: any difference of a value is larger than chance."""

    @property
    def figures(self) -> list[Figure]:
        """All figures."""
        of_values = (figure for field in self.values.fields for figure in (field.mean, field.rms))
        return [*self.timing, *of_values]

    @property
    def differing(self) -> list[Figure]:
        """Figures whose difference is larger than the noise."""
        return [figure for figure in self.figures if figure.differs]

    def rules(self) -> list[str]:
        """Names of all rules that acted in either run."""
        return list(dict.fromkeys(act.rule for run in self.acts for act in run))

    def changes(self) -> list[CoreChange]:
        """Kinds of reconfigurations of either run."""
        return sorted({*self.costs[0], *self.costs[1]})


def compare_runs(
    a: Trace, b: Trace, *, names: tuple[str, str] = ("A", "B"), progress: Progress = silent
) -> ComparedRuns:
    """Compare two runs.

    Args:
        a: the run that the other one is compared with.
        b: the other run.
        names: of both, for the page.
        progress: told how far it is.

    Raises:
        TraceError: the runs have no component in common, or the messages of a bag cannot be read.

    """
    shared = [component for component in a.components if component in b.components]
    if not shared:
        found = [listed(list(trace.components)) or "none" for trace in (a, b)]
        raise TraceError(
            f"no component is in both runs: {names[0]} has {found[0]}; {names[1]} has {found[1]}. "
            "Compare two runs of one architecture."
        )
    measured = [reconfigurations(trace) for trace in (a, b)]
    components: dict[str, tuple[ComponentRun, ComponentRun]] = {}
    timing: list[Figure] = []
    for index, component in enumerate(shared):
        progress(0.7 * index / len(shared), "comparing")
        runs = component_run(a, component, measured[0]), component_run(b, component, measured[1])
        components[component] = runs
        timing += timing_figures(component, *runs)
    simulated = all(run.is_simulated for runs in components.values() for run in runs if run.releases)
    simulated = simulated and any(run.releases for runs in components.values() for run in runs)
    progress(0.7, "reading values")
    values = compared_values(a, b, simulated=simulated)
    progress(0.9, "comparing")
    compared = ComparedRuns(
        names,
        (a, b),
        components,
        (_only(a, b, components, 0), _only(b, a, components, 1)),
        timing,
        values,
        (acts_of(a), acts_of(b)),
        (costs_of(a, measured[0]), costs_of(b, measured[1])),
        tested=0,
        simulated=simulated,
    )
    return _judged(compared)


def _only(
    one: Trace, other: Trace, components: dict[str, tuple[ComponentRun, ComponentRun]], side: int
) -> list[str]:
    missing = [component for component in one.components if component not in other.components]
    measures = (
        f"{measure} in {component}"
        for component, runs in components.items()
        for measure in only_in(runs[side], runs[1 - side])
    )
    return [*missing, *measures]


def _judged(found: ComparedRuns) -> ComparedRuns:
    """Judge each figure by the number of figures that are tested."""
    tested = sum(figure.change is not None for figure in found.figures)

    def judge(figure: Figure) -> Figure:
        return replace(figure, judged=figure.change.judged(tested)) if figure.change else figure

    fields = [replace(one, mean=judge(one.mean), rms=judge(one.rms)) for one in found.values.fields]
    return replace(
        found,
        timing=[judge(figure) for figure in found.timing],
        values=replace(found.values, fields=fields),
        tested=tested,
    )


def only_in_one(found: ComparedRuns) -> Iterator[tuple[str, str]]:
    """Yield what is in one run alone: the run, A or B, and the thing in words."""
    for side, run in enumerate("AB"):
        other = 1 - side
        for thing in found.only[side]:
            yield run, thing
        for topic in (found.values.only_a, found.values.only_b)[side]:
            yield run, f"topic {topic}"
        theirs = {act.rule for act in found.acts[other]}
        for rule in dict.fromkeys(act.rule for act in found.acts[side]):
            if rule not in theirs:
                yield run, f"an act of rule {rule}"
        for change in found.costs[side]:
            if change not in found.costs[other]:
                yield run, f"reconfiguration of {change.component} to {change.to_core}"
        for component, runs in found.components.items():
            counts = [one.counts["faults"].total for one in (runs[side], runs[other])]
            if counts[0] and not counts[1]:
                yield run, f"a fault of {component}"
