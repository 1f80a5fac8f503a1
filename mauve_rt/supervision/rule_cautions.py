"""What `mauve rules check` warns of: rules that an executor takes, but that rarely do what they are for."""

from collections.abc import Iterator

from mauve_rt.errors import Problem
from mauve_rt.model import ArchitectureModel
from mauve_rt.supervision.rehearsal import Rehearsal
from mauve_rt.supervision.rules import Rule, RulesFile
from mauve_rt.supervision.silence_limits import limit_warnings, listened_to
from mauve_rt.supervision.when_spec import heard


def form_warnings(file: RulesFile) -> Iterator[Problem]:
    """What can be seen without an architecture."""
    for index, rule in enumerate(file.rules.rules):
        if rule.latch and not rule.safety:
            what = f"rule '{rule.name}' is latched, and is no safety rule: rules and persons can go over it"
            yield file.problem(("rules", index, "latch"), what, remedy="add safety: true and otherwise: stop")


def model_warnings(file: RulesFile, model: ArchitectureModel, executor: Rehearsal) -> Iterator[Problem]:
    """What an architecture shows, as it is at its start."""
    yield from limit_warnings(file, model, executor.periods_s())
    for index, rule in enumerate(file.rules.rules):
        yield from _redundant_undo(file, index, rule, executor)
        if rule.safety:
            yield from _forgotten_inputs(file, rule, model)


def _redundant_undo(file: RulesFile, index: int, rule: Rule, executor: Rehearsal) -> Iterator[Problem]:
    """Steps of `undo` that say what is there at the start: that comes back without them."""
    steps = rule.steps("undo")
    if steps and not rule.takes_over and executor.is_so(steps):
        what = (
            f"rule '{rule.name}': these steps are not needed: what was there before comes back without them"
        )
        yield file.problem(("rules", index, "undo", "do"), what, remedy="leave `do` of `undo` out")


def _forgotten_inputs(file: RulesFile, rule: Rule, model: ArchitectureModel) -> Iterator[Problem]:
    """Values of topics of which a new executor receives none before the next one is published."""
    for leaf in rule.when.leaves():
        _, resource = listened_to(leaf, model)
        topic = resource.topic if resource is not None else None
        if topic is None or topic.qos.is_kept or topic.qos.deadline_ms:
            continue
        if any(signal.kind == "field" for signal in heard(leaf)):
            what = (
                f"safety rule '{rule.name}': an executor that starts again does not know the value of "
                f"topic {topic.name} before the next message"
            )
            remedy = "publish and bind the topic with qos: transient_local, or state its deadline_ms"
            yield file.problem((*leaf.place, leaf.kind), what, remedy=remedy)
