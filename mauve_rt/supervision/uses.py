"""What rules do with an architecture that is checked with them, and what they wait for in vain."""

from collections.abc import Iterator

from mauve_rt.errors import Problem
from mauve_rt.model import ArchitectureModel
from mauve_rt.model.remarks import Uses
from mauve_rt.model.resource_kinds import given_kinds
from mauve_rt.supervision.rules import RulesFile
from mauve_rt.supervision.silence_limits import listened_to, writers_of


def add_uses(uses: Uses, file: RulesFile) -> None:
    """Add what the rules of a file name."""
    uses.has_rules = True
    for rule in file.rules.rules:
        uses.steps += [*rule.do, *rule.steps("undo")]
        named = (leaf.parameters.get("resource") for leaf in rule.when.leaves())
        uses.resources |= {str(name) for name in named if name}


def unpublished_topics(file: RulesFile, model: ArchitectureModel, uses: Uses) -> Iterator[Problem]:
    """Topics that the architecture is to publish, and whose resource no component writes.

    A topic to which no resource is bound is another node's: nothing is known of it. A plug-in's resource may
    write itself.
    """
    for rule in file.rules.rules:
        for leaf in rule.when.leaves():
            name, resource = listened_to(leaf, model)
            if resource is None or resource.topic is None or not leaf.parameters.get("topic"):
                continue
            is_ours = resource.topic.direction == "publish" and resource.kind in given_kinds()
            is_written = writers_of(name, model) or resource.service is not None or name in uses.connected()
            if is_ours and not is_written:
                topic = f"topic {resource.topic.name}"
                what = f"rule '{rule.name}': resource '{name}' publishes {topic}, and no component writes it"
                remedy = f"connect a writer to {name}.write in {model.path}"
                yield file.problem((*leaf.place, leaf.kind, "topic"), what, remedy=remedy)
