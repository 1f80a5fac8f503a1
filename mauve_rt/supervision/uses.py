"""What rules do with an architecture that is checked with them, and what they wait for in vain."""

from collections.abc import Iterator

from mauve_rt.errors import Problem
from mauve_rt.model import ArchitectureModel
from mauve_rt.model.remarks import Uses
from mauve_rt.supervision.rules import RulesFile
from mauve_rt.supervision.silence_limits import listened_to, writers_of


def add_uses(uses: Uses, file: RulesFile) -> None:
    """Add what the rules of a file name."""
    uses.has_rules = True
    for rule in file.rules.rules:
        uses.steps += [*rule.do, *rule.steps("undo")]
        named = (leaf.parameters.get("resource") for leaf in rule.when.leaves())
        uses.resources |= {str(name) for name in named if name}


def unpublished_topics(file: RulesFile, model: ArchitectureModel) -> Iterator[Problem]:
    """Topics that the architecture is to publish, and whose resource no component writes.

    A topic to which no resource is bound is another node's: nothing is known of it.
    """
    for rule in file.rules.rules:
        for leaf in rule.when.leaves():
            name, resource = listened_to(leaf, model)
            topic = resource.topic if resource is not None else None
            if topic is None or topic.direction != "publish" or "topic" not in leaf.parameters:
                continue
            if leaf.parameters["topic"] and resource.service is None and not writers_of(name, model):
                what = (
                    f"rule '{rule.name}': resource '{name}' publishes topic {topic.name}, "
                    "and no component writes it"
                )
                remedy = f"connect a writer to {name}.write in {model.path}"
                yield file.problem((*leaf.place, leaf.kind, "topic"), what, remedy=remedy)
