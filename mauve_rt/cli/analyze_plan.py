"""`mauve analyze FILE --plan FILE`: the verdicts on a change, while it is made and after it."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from mauve_rt.analysis.machines import Machine
from mauve_rt.analysis.plan import Handovers
from mauve_rt.analysis.study import Study, Surroundings, study
from mauve_rt.cli.analyzed import Analyzed, analyzed
from mauve_rt.control.change_timing import (
    budget_ns,
    handovers_of,
    judged_change,
    with_blends,
    with_times_of_core,
)
from mauve_rt.control.simulated_runtime import SimulatedRuntime
from mauve_rt.file_schema.file_kind import FileKind
from mauve_rt.model import ArchitectureModel, PluginIndex
from mauve_rt.model.component_machines import is_python_part
from mauve_rt.model.file_kinds import file_kind
from mauve_rt.model.fragment import fragment
from mauve_rt.model.steps import Change, Step, load_change
from mauve_rt.model.threads import ThreadList, thread_list, uses_of
from mauve_rt.supervision.rehearsal import before_and_after
from mauve_rt.supervision.rules import Rule, RulesFile


class Plan(NamedTuple):
    """What is known of one change."""

    change: str
    """In words: `with rule link_lost`; empty: the change that the user names."""
    during: Study
    after: Study
    is_idle: bool = False
    """Whether it has to be made at an idle instant."""


class Planner:
    """The verdicts on changes of an architecture."""

    def __init__(
        self, found: Analyzed, now: Study, components: Sequence[Machine], surroundings: Surroundings
    ) -> None:
        """Of an architecture file.

        Args:
            found: the architecture before.
            now: what is known of it.
            components: it has, with their times.
            surroundings: what runs beside them.

        """
        if found.model is None:
            raise ValueError("a change is judged for an architecture file")
        self._model, self._now = found.model, now
        self._components, self._surroundings = components, surroundings

    @classmethod
    def of_architecture(cls, path: Path) -> "Planner":
        """Of an architecture file with the times that it declares."""
        found = analyzed(str(path), ())
        if found.threads is None:
            raise ValueError("an architecture file has threads")
        surroundings = Surroundings(threads=found.threads)
        now = study(found.components, surroundings)
        return cls(found, now, found.components, surroundings)

    @property
    def now(self) -> Study:
        """What is known of the architecture."""
        return self._now

    def of_file(self, path: Path) -> Iterator[Plan]:
        """The changes of a file: of steps, of each rule, or to another architecture.

        Raises:
            ArchitectureFileError: it is no such file, or the executor would refuse a step.

        """
        kind = file_kind(path)
        if kind is FileKind.ARCHITECTURE:
            yield self._judged("", _by_file(path, self._model))
        elif kind is FileKind.RULES:
            for rule in RulesFile(path).rules.rules:
                yield self.of_rule(path, rule)
        else:
            yield self._by_steps("", path, load_change(path))

    def of_rule(self, path: Path, rule: Rule) -> Plan:
        """The action of a rule of a file.

        Raises:
            ArchitectureFileError: the executor would refuse a step.

        """
        change = Change(steps=list(rule.do))
        return self._by_steps(f"when rule {rule.name} acts", path, change, awaits_idle=False)

    def alternatives(self) -> Iterator[Plan]:
        """Of each core that the file names as an alternative or a fallback.

        Raises:
            ArchitectureFileError: the executor would refuse the core.

        """
        index = PluginIndex.installed()
        for name, part in self._model.components.items():
            listed = part.alternatives if isinstance(part.alternatives, list) else []
            cores = [core for core in listed if index.find("core", core) is not None and core != part.core]
            for core in dict.fromkeys([*cores, *([part.fallback] if part.fallback else [])]):
                kind = "fallback" if core == part.fallback else "alternative"
                change = Change(steps=[Step("replace_core", name, core)])
                awaits_idle = kind == "alternative"  # a fallback comes when a component faults
                words = f"with {kind} {core} of {name}"
                yield self._by_steps(words, self._model.path, change, awaits_idle=awaits_idle)

    def _by_steps(self, words: str, path: Path, change: Change, *, awaits_idle: bool = True) -> Plan:
        after = _by_steps(change, path, self._model, self._components)
        return self._judged(words, after, is_idle=change.idle, awaits_idle=awaits_idle)

    def _judged(
        self, words: str, after: "_After", *, is_idle: bool = False, awaits_idle: bool = True
    ) -> Plan:
        """`awaits_idle`: the executor makes it at an idle instant where it requires schedulable changes."""
        awaits_idle &= self._model.executor.require_schedulable is True
        judged = judged_change(
            self._now, self._surroundings, *after, is_idle=is_idle, awaits_idle=awaits_idle
        )
        return Plan(words, *judged)


_After = tuple[list[Machine], ThreadList, Handovers]


def _by_file(path: Path, before: ArchitectureModel) -> _After:
    """The architecture after the change; components of one name are the same component."""
    after = analyzed(str(path), ())
    if after.model is None or after.registry is None or after.threads is None:
        raise ValueError("an architecture file has a model")
    cores = {name: part.core for name, part in after.model.components.items()}
    handovers = {
        name: budget_ns(after.registry, cores[name])
        for name, part in before.components.items()
        if cores.get(name, part.core) != part.core
    }
    return after.components, after.threads, handovers


def _by_steps(change: Change, path: Path, model: ArchitectureModel, components: Sequence[Machine]) -> _After:
    before, after = before_and_after(path, change, model)
    registry = SimulatedRuntime.registry
    there = {part.name for part in before.components}
    kinds = {resource.name: resource.kind for resource in after.resources}
    known = {machine.name: machine for machine in components}
    changed = {step.target for step in change.steps}
    index = PluginIndex.installed()
    machines: list[Machine] = []
    for part in after.components:
        machine = Machine.of(part, is_python=is_python_part(part, index), kinds=kinds)
        if part.name in known and part.name not in changed:
            machine = known[part.name]
        elif part.name in there:
            machine = with_times_of_core(machine, part, model.components[part.name], registry)
        machines.append(machine)
    machines = with_blends(machines, known, change.steps)
    cores = {part.name: part.core for part in after.components if part.name in there}
    return machines, _threads_after(model, change, machines), handovers_of(change.steps, cores, registry)


def _threads_after(model: ArchitectureModel, change: Change, machines: Sequence[Machine]) -> ThreadList:
    """With the users of resources that the change adds."""
    uses = uses_of(model)
    for added in _added_resources(model, change):
        uses |= uses_of(added)
    has_bounds = any(state.is_watched for machine in machines for state in machine.states)
    return thread_list(model.executor, uses, components=len(machines), has_bounds=has_bounds)


def _added_resources(model: ArchitectureModel, change: Change) -> Iterator[ArchitectureModel]:
    for step in change.steps:
        if step.kind == "add_resource":
            yield fragment(model, step.value, section="resources", name=step.target)
