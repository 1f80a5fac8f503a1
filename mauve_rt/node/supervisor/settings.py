"""What the command line says to a supervisor before there is a node."""

from collections.abc import Sequence

from mauve_rt.errors import ParameterError
from mauve_rt.node.shared.ros_arguments import parse_ros_arguments
from mauve_rt.node.shared.settings import Setting, check_given, near_misses, usage

PARAMETERS = {"rules": Setting("", "rules file")}


def check_arguments(words: Sequence[str]) -> tuple[str, ...]:
    """Whether a supervisor has all that its command line names; returns what else to tell.

    Raises:
        ParameterError: a name that no parameter has, `qos_overrides`, or `use_sim_time`.
    """
    arguments = parse_ros_arguments(words, node="supervisor")
    namespace = arguments.namespace or "/"
    for name in check_given(arguments, PARAMETERS, namespace=namespace):
        raise ParameterError(f"parameter {name}: a supervisor has none of that name; known: rules")
    return near_misses(arguments, PARAMETERS, namespace=namespace)


def help_text() -> str:
    """What `supervisor --help` says."""
    return usage("ros2 run mauve_rt supervisor", PARAMETERS)
