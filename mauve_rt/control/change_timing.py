"""A change by steps as the timing analysis takes it: handovers, execution times of other cores, verdicts.

Import this module only to judge: it loads the analysis.
"""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

from mauve_rt._kernel import PluginRegistry
from mauve_rt.analysis.machines import ExecutionTime, Machine, State
from mauve_rt.analysis.plan import Handovers
from mauve_rt.analysis.study import AT_AN_IDLE_INSTANT, Study, Surroundings, study, study_of_change
from mauve_rt.analysis.verdict import Outcome
from mauve_rt.model.bumpless import read_bumpless
from mauve_rt.model.core_times import times_of_other_core
from mauve_rt.model.schema import ComponentModel
from mauve_rt.model.steps import Step
from mauve_rt.model.threads import ThreadList
from mauve_rt.yaml.text import read_yaml

_NEW_CORE = ("replace_core", "replace_shell", "configure", "promote", "revert_core")
"""Kinds of steps that put another instance of the core in, which takes the state of the old one."""


class JudgedChange(NamedTuple):
    """What is known of a change, while it is made and after it."""

    during: Study
    after: Study
    is_idle: bool = False
    """Whether it has to be made at an idle instant."""


def judged_change(
    now: Study,
    surroundings: Surroundings,
    machines: list[Machine],
    threads: ThreadList,
    handovers: Handovers,
    *,
    is_idle: bool = False,
    awaits_idle: bool = False,
) -> JudgedChange:
    """The studies of a change to these components and threads.

    `is_idle`: it is made at an idle instant. `awaits_idle`: it will be, where the verdict needs that.
    """
    changed = replace(surroundings, threads=replace(surroundings.threads, tasks=threads.tasks))
    after = study(machines, changed)
    plain = None if is_idle else study_of_change(now, after, handovers, changed)
    if plain is not None and (is_proved(plain) or not is_proved(after)):
        return JudgedChange(plain, after)
    idle = study_of_change(now, after, handovers, changed, is_idle=True)
    if plain is None or (awaits_idle and is_proved(idle)):
        return JudgedChange(idle, after, is_idle=True)
    if is_proved(idle):
        why = f"{plain.verdict.why}; {AT_AN_IDLE_INSTANT} (idle: true): {idle.verdict.outcome}"
        plain = replace(plain, verdict=replace(plain.verdict, why=why))
    return JudgedChange(plain, after)


def is_proved(one: Study) -> bool:
    """Whether each component meets its deadline, if declared or measured times hold."""
    return one.verdict.outcome in (Outcome.SCHEDULABLE, Outcome.FORECAST)


def handovers_of(steps: Iterable[Step], cores: Mapping[str, str], registry: PluginRegistry) -> Handovers:
    """Of the components that get another core; `cores`: after the change, of those that were there before."""
    found = {step.target for step in steps if step.kind in _NEW_CORE}
    return {name: budget_ns(registry, core) for name, core in cores.items() if name in found}


def with_blends(
    machines: Iterable[Machine], before: Mapping[str, Machine], steps: Iterable[Step]
) -> list[Machine]:
    """In a blend (blend_s) the states of the old core come after those of the new one, in each release.

    `before`: the components before the change, by name.
    """
    blended = {step.target for step in steps if _blends(step)}
    return [
        _with_both_cores(machine, before[machine.name])
        if machine.name in blended and machine.name in before
        else machine
        for machine in machines
    ]


def _blends(step: Step) -> bool:
    if step.kind not in ("replace_core", "promote") or not step.value:
        return False
    value = read_yaml(step.value)
    given = value.get("bumpless") if isinstance(value, dict) else None
    return given is not None and read_bumpless(given).blend_s > 0


def _with_both_cores(machine: Machine, old: Machine) -> Machine:
    """A release costs the guards at the end of a wait, then the states up to the next wait."""
    states = {state.name: state for state in old.states}
    return replace(
        machine,
        states=tuple(
            replace(state, time=_with_release_of(state, states)) if state.is_wait else state
            for state in machine.states
        ),
    )


def _with_release_of(wait: State, old: Mapping[str, State]) -> ExecutionTime:
    def costliest(name: str) -> int | None:
        """From the begin of that state of the old core to its next wait."""
        state = old[name]
        if state.is_wait:
            return 0
        return _sum(state.time.ns, [costliest(following) for following in state.successors])

    same = old[wait.name]
    own_ns = _sum(same.time.ns, [costliest(following) for following in same.successors])
    if own_ns is None or wait.time.ns is None:
        return ExecutionTime(why_missing="both cores execute in a blend, and a time of one is missing")
    is_measured = wait.time.is_measured or any(state.time.is_measured for state in old.values())
    return ExecutionTime(
        wait.time.ns + own_ns, "with the old core, during the blend", is_measured=is_measured
    )


def _sum(first: int | None, rest: Iterable[int | None]) -> int | None:
    known = [*rest]
    if first is None or None in known:
        return None
    return first + max((each for each in known if each is not None), default=0)


def budget_ns(registry: PluginRegistry, core: str) -> int | None:
    """That a core declares for adopt and take together; None: it declares none."""
    return registry.describe_core(core).budget_ns or None


def with_times_of_core(
    machine: Machine, part: Any, declared: ComponentModel | None, registry: PluginRegistry
) -> Machine:
    """Without the worst cases that the file declares, where these are those of another core.

    `part`: the component with the core that it has; `declared`: as the file describes it.
    """
    times = times_of_other_core(part, declared, registry)
    if declared is None or not times:
        return machine
    states = tuple(
        replace(state, time=_own_time(times[state.name], part.core, declared.core))
        if state.name in times
        else state
        for state in machine.states
    )
    return replace(machine, states=states)


def _own_time(time_ns: int | None, core: str, declared: str) -> ExecutionTime:
    if time_ns is not None:
        return ExecutionTime(time_ns, f"declared by core {core}")
    return ExecutionTime(why_missing=f"the file declares the time of core {declared}, not of {core}")
