"""What an executor cannot hear of the conditions of its own rules."""

from collections.abc import Iterator, Mapping

from mauve_rt._kernel import Host, MauveError, RuleActions, RuleRunner, RuleSpec
from mauve_rt.errors import Problem
from mauve_rt.supervision.rules import RulesFile
from mauve_rt.supervision.when import When
from mauve_rt.supervision.when_spec import heard, when_spec

OUTSIDE = {
    "peer": "another executor",
    "diagnostic": "a diagnostic",
}  # signals that no executor has of its own
REMEDY = "give the rule `in: supervisor`"


def only_outside(file: RulesFile) -> Iterator[Problem]:
    """Conditions of the executor's rules that only the outside can see, whatever the architecture."""
    for leaf in own_leaves(file):
        for signal in heard(leaf):
            if signal.kind in OUTSIDE:
                what = f"an executor's own rules cannot receive {OUTSIDE[signal.kind]} ({signal.target})"
                yield file.problem((*leaf.place, leaf.kind), what, remedy=REMEDY)


def unobservable(file: RulesFile, leaf: When, host: Host, topics: Mapping[str, str]) -> Problem | None:
    """Why this host, at which no rule is at work yet, cannot hear a condition for another reason.

    `topics`: the resource that is bound to each topic, named as in the rules.
    """
    if any(signal.kind in OUTSIDE for signal in heard(leaf)):
        return None
    place = (*leaf.place, leaf.kind)
    topic = leaf.parameters.get("topic")
    if topic and topic not in topics:
        what = f"no resource of the architecture takes the messages of topic {topic}"
        remedy = f"bind one to it (topic: {{name: {topic}, direction: subscribe}}), or {REMEDY}"
        return file.problem((*place, "topic"), what, remedy=remedy)
    error = _refusal(leaf, host, topics)
    if error is None:
        return None
    where = ": ".join(filter(None, (error.component, error.element)))
    facts = {"expected": error.expected, "found": error.found, "remedy": error.remedy}
    return file.problem(place, f"{where}: {error.statement}" if where else error.statement, **facts)


def own_leaves(file: RulesFile) -> Iterator[When]:
    """The conditions of the rules that the executor runs."""
    for rule in file.rules.rules:
        if rule.where == "executor":
            yield from rule.when.leaves()


def _refusal(leaf: When, host: Host, topics: Mapping[str, str]) -> MauveError | None:
    """Of the executor itself: it would listen to the condition just so."""
    try:
        RuleRunner(host, [RuleSpec("one", when_spec(leaf))], [RuleActions([])], dict(topics))
    except MauveError as error:
        return error
    return None
