"""What the command line says to a supervisor before there is a node."""

from collections.abc import Sequence
from typing import Any

from mauve_rt.errors import ParameterError
from mauve_rt.node.shared.ros_arguments import parse_ros_arguments
from mauve_rt.node.shared.settings import Setting, check_given, near_misses, usage, values_of

PARAMETERS = {
    "rules": Setting("", "rules file"),
    "replace": Setting(
        default=False, description="take the place of a supervisor of the same name that runs already"
    ),
}


def settings_of(words: Sequence[str]) -> tuple[dict[str, Any], tuple[str, ...]]:
    """The values of a command line, and what else to tell.

    Raises:
        ParameterError: a value of the wrong type, a name that no parameter has, `qos_overrides`, or
            `use_sim_time` for it alone.
    """
    arguments = parse_ros_arguments(words, node="supervisor")
    namespace = arguments.namespace or "/"
    for name in check_given(arguments, PARAMETERS, namespace=namespace):
        raise ParameterError(
            f"parameter {name}: a supervisor has none of that name; known: {', '.join(PARAMETERS)}"
        )
    values = values_of(arguments.within(namespace), PARAMETERS)
    if not values["rules"]:
        raise ParameterError("parameter 'rules' is missing: --ros-args -p rules:=FILE")
    return values, near_misses(arguments, PARAMETERS, namespace=namespace)


def help_text() -> str:
    """What `supervisor --help` says."""
    return usage("ros2 run mauve_rt supervisor", PARAMETERS)
