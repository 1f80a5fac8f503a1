"""Log lines as ROS has them: /rosout, severities, names of loggers."""

from typing import Any

from builtin_interfaces.msg import Time
from rcl_interfaces.msg import Log

from mauve_rt._kernel import TASK_SETTINGS
from mauve_rt.control.part_log import LogLine

__all__ = ["LEVELS", "LOG_TYPE", "ROSOUT", "SEVERITIES", "log_message", "logger_name"]

ROSOUT, LOG_TYPE = "/rosout", "rcl_interfaces/msg/Log"
SEVERITIES = {level: 10 * (number + 1) for number, level in enumerate(TASK_SETTINGS["log_level"].choices)}
"""Of ROS, by level; the numbers of rcl_interfaces/msg/Log and of the services of loggers."""
LEVELS = {severity: level for level, severity in SEVERITIES.items()}


def logger_name(node: str, part: str) -> str:
    """Of a component or resource of a node: `robot_1.executor.guidance`."""
    name = node.strip("/").replace("/", ".")
    return f"{name}.{part}" if part else name


def log_message(line: LogLine, *, node: str, stamp: Time) -> Any:
    """The line as a message on /rosout."""
    return Log(
        stamp=stamp,
        level=SEVERITIES[line.level],
        name=logger_name(node, line.part),
        msg=line.text,
        file=line.file,
        function=line.function,
        line=line.line,
    )
