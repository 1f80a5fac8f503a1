"""Inputs of conditions that only the executor has."""

from collections.abc import Mapping

from mauve_rt.supervision.when import When
from mauve_rt.supervision.when_spec import heard

# Kinds of signals that only their own process receives.
_INSIDE: Mapping[str, str] = {
    "write": "writes to resource {target} are known",
    "overruns": "overruns of {target} are known",
    "late": "wake-ups and responses of {target} are known",
    "release": "releases of {target} are known",
    "over_declared": "execution times of {target} are known",
    "node": "the state of the Python side is known",
    "goal": "the goals of resource {target} are known",
}


def inside_only(leaf: When) -> str:
    """The input that only the executor has, in words; empty: other processes have all inputs."""
    for signal in heard(leaf):
        if signal.kind in _INSIDE:
            return _INSIDE[signal.kind].format(target=signal.target)
        if signal.kind == "field" and leaf.parameters.get("resource"):
            return f"the values of resource {signal.target} are known"
    topic = leaf.parameters.get("topic")
    if topic and not leaf.parameters.get("type"):
        return f"the type of topic {topic} is known: the rule does not tell it"
    return ""
