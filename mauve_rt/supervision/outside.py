"""What cannot be heard outside of an executor."""

from collections.abc import Mapping

from mauve_rt.supervision.when import When
from mauve_rt.supervision.when_spec import heard

# Kinds of signals that only the process in which they arise hears.
_INSIDE: Mapping[str, str] = {
    "write": "writes to resource {target} are heard",
    "overruns": "overruns of {target} are heard",
    "late": "it is heard how late {target} is",
    "release": "releases of {target} are heard",
    "over_declared": "it is heard how long {target} executes",
    "node": "it is heard whether Python works",
}


def inside_only(leaf: When) -> str:
    """What of a condition can be heard in the executor only, in words; empty: all can be heard outside."""
    for signal in heard(leaf):
        if signal.kind in _INSIDE:
            return _INSIDE[signal.kind].format(target=signal.target)
        if signal.kind == "field" and leaf.parameters.get("resource"):
            return f"the values of resource {signal.target} are heard"
    topic = leaf.parameters.get("topic")
    if topic and not leaf.parameters.get("type"):
        return f"the type of topic {topic} is known: the rule does not tell it"
    return ""
