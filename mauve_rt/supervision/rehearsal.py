"""Transactions tried on an architecture in virtual time, in which nothing runs. Knows no ROS."""

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from mauve_rt._kernel import (
    ComponentDescription,
    Overlays,
    OverlaySpec,
    ResourceDescription,
    Simulation,
)
from mauve_rt.control import requests
from mauve_rt.control.control import Control
from mauve_rt.control.no_ros import NoRos
from mauve_rt.control.simulated_runtime import SimulatedRuntime
from mauve_rt.control.wishes import assignment_of
from mauve_rt.errors import ArchitectureFileError, Problem
from mauve_rt.file_schema.yaml_file import YamlFile
from mauve_rt.model import ArchitectureModel
from mauve_rt.model.steps import Change, Step, place_of_step
from mauve_rt.supervision.rule_hearing import own_leaves, unobservable
from mauve_rt.supervision.rule_names import full_name, leaf_findings
from mauve_rt.supervision.rules import RulesFile
from mauve_rt.supervision.when import When


class Described(NamedTuple):
    """The parts of an architecture at one moment."""

    components: Sequence[ComponentDescription]
    resources: Sequence[ResourceDescription]


class RefusedStepError(Exception):
    """A transaction that the executor would refuse; `index` is that of the step, from 0."""

    def __init__(self, message: str) -> None:
        super().__init__(message)
        number = re.match(r"step (\d+) \(", message)  # told where there are several
        self.index = int(number[1]) - 1 if number else 0


class Rehearsal:
    """An executor's answers to transactions, by its own checks, before there is an executor."""

    def __init__(self, runtime: SimulatedRuntime) -> None:
        self._runtime = runtime
        self._control = Control(runtime, outside=NoRos())

    def unobservable(self, file: RulesFile, leaf: When, topics: Mapping[str, str]) -> Problem | None:
        """As rule_hearing.unobservable(), of this executor."""
        return unobservable(file, leaf, self._runtime.host, topics)

    def periods_s(self) -> Mapping[str, float]:
        """Of every component, s."""
        return {each.name: each.period_ns / 1e9 for each in self._runtime.components()}

    def described(self) -> Described:
        """Every component and resource as it is now."""
        return Described(self._runtime.components(), self._runtime.architecture.resources())

    def is_so(self, steps: Sequence[Step]) -> bool:
        """Whether all that these steps set is so already."""
        overlays = Overlays()
        overlay = overlays.put("", OverlaySpec("", [assignment_of(step) for step in steps]))
        return not overlays.steps_if(
            overlay, is_active=True, description=self._runtime.architecture.describe()
        )

    def carry_out(self, steps: Sequence[Step], *, dry_run: bool = False) -> None:
        """Ask for a transaction.

        Raises:
            RefusedStepError: it was refused.
        """
        outcome = self._control.handle(requests.Request(steps=tuple(steps), dry_run=dry_run))
        if not outcome.success:
            raise RefusedStepError(outcome.message)


@contextmanager
def rehearsal(model: ArchitectureModel) -> Iterator[Rehearsal]:
    """A rehearsal on an architecture as it is at its start.

    Raises:
        ArchitectureFileError: it cannot be built or configured.
    """
    simulation = Simulation(trace=False)
    runtime = SimulatedRuntime(simulation, lambda: model)
    runtime.configure()
    try:
        runtime.activate()
        yield Rehearsal(runtime)
    finally:
        simulation.shutdown()


def try_change(path: Path, change: Change, model: ArchitectureModel) -> None:
    """Whether the executor of `model` would take the transaction of a file at its start.

    Raises:
        ArchitectureFileError: at the step that it would refuse.
    """
    with rehearsal(model) as executor, refusals_at(path):
        executor.carry_out(change.steps, dry_run=True)


def before_and_after(path: Path, change: Change, model: ArchitectureModel) -> tuple[Described, Described]:
    """The architecture of `model` at its start, and after the transaction of a file.

    Raises:
        ArchitectureFileError: at the step that the executor would refuse.
    """
    with rehearsal(model) as executor, refusals_at(path):
        before = executor.described()
        executor.carry_out(change.steps)
        return before, executor.described()


@contextmanager
def refusals_at(path: Path) -> Iterator[None]:
    """Give a refused step its place in a file of steps.

    Raises:
        ArchitectureFileError: at that step.
    """
    try:
        yield
    except RefusedStepError as error:
        file = YamlFile(path)
        problem = file.problem(place_of_step(file, error.index), str(error))
        raise ArchitectureFileError(path, [problem]) from None


def try_rule(file: RulesFile, index: int, model: ArchitectureModel) -> None:
    """Whether the executor of `model` would take what a rule does, and then what undoes it.

    A core may refuse to adopt another one's state that early: then `undo` is not tried.

    Raises:
        ArchitectureFileError: at the step that it would refuse.
    """
    rule = file.rules.rules[index]
    with rehearsal(model) as executor:
        try:
            executor.carry_out(rule.do, dry_run=True)
        except RefusedStepError as error:
            raise file.error(("rules", index, "do", error.index), str(error)) from None
        if rule.undo is None or not rule.undo.do:
            return
        try:
            executor.carry_out(rule.do)
        except RefusedStepError:
            return
        try:
            executor.carry_out(rule.undo.do, dry_run=True)
        except RefusedStepError as error:
            raise file.error(("rules", index, "undo", "do", error.index), str(error)) from None


def rehearsal_problems(file: RulesFile, model: ArchitectureModel) -> list[Problem]:
    """What the executor of `model` would refuse of every rule.

    Raises:
        ArchitectureFileError: the architecture cannot be built or configured.
    """
    with rehearsal(model) as executor:
        found = list(_unobservable(executor, file, model))
    for index in range(len(file.rules.rules)):
        try:
            try_rule(file, index, model)
        except ArchitectureFileError as error:
            found += error.problems
    return found


def _unobservable(executor: Rehearsal, file: RulesFile, model: ArchitectureModel) -> Iterator[Problem]:
    """Of conditions whose names are as they should be."""
    topics = {
        full_name(each.topic.name, model.namespace): name
        for name, each in model.resources.items()
        if each.topic is not None and each.topic.direction == "subscribe"
    }
    for leaf in own_leaves(file):
        if any(leaf_findings(file, leaf, model)):
            continue
        topic = str(leaf.parameters.get("topic") or "")
        resource = topics.get(full_name(topic, model.namespace))
        problem = executor.unobservable(file, leaf, {topic: resource} if resource else {})
        if problem is not None:
            yield problem
