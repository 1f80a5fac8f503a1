"""What a program settles before its first ROS context, so that the environment cannot end its start."""

import resource
from typing import NamedTuple

from mauve_rt.node.shared.domain import domain_problem
from mauve_rt.node.shared.failures import more_open_files
from mauve_rt.node.shared.lean_start import leave_out_unused
from mauve_rt.node.shared.log_folder import choose_log_folder
from mauve_rt.node.shared.loopback import LoopbackError, keep_to_this_machine
from mauve_rt.node.shared.shared_memory import no_room_for_ros, shared_memory_problem
from mauve_rt.node.shared.static_peers import resolve_static_peers, unresolved_text

_FEW_FILES = 64  # enough for a small architecture only


class RosStartError(Exception):
    """ROS cannot start in this environment. str() is one line that says what to set."""


class RosStart(NamedTuple):
    """How to initialize ROS, and what to report then."""

    arguments: tuple[str, ...]  # to be added to rcl's command line
    remarks: tuple[str, ...]  # for the user, a line each
    unresolved: tuple[str, ...]  # names of static peers that have no address yet


def settle_ros_start() -> RosStart:
    """Set the environment so that ROS can start in it, for this process and its children.

    Once, at the start of a program. No thread may be there that reads the environment while this runs.

    Raises:
        RosStartError: a variable of the environment has a value that ROS cannot use, or /dev/shm is full.
    """
    if problem := domain_problem() or no_room_for_ros():
        raise RosStartError(problem)
    unresolved = resolve_static_peers()
    try:
        keep_to_this_machine()
    except LoopbackError as error:
        raise RosStartError(str(error)) from None
    leave_out_unused()
    arguments, logs = choose_log_folder()
    peers = unresolved_text(unresolved) if unresolved else ""
    remarks = tuple(remark for remark in (logs, shared_memory_problem(), peers, _few_files()) if remark)
    return RosStart(arguments, remarks, unresolved)


def _few_files() -> str:
    soft, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    if soft == resource.RLIM_INFINITY or soft >= _FEW_FILES:
        return ""
    return (
        f"open files: a large architecture or a recording can need {_FEW_FILES} or more. {more_open_files()}"
    )
