"""The first steps of each program: the process is as the interpreter and libraries expect it. Knows no ROS.

A daemon can start a program with stdin, stdout or stderr closed. The next file that the process opens gets
the free number: then /dev/cpu_dma_latency or a socket is "stdout". A small limit for open files, or modules
of another ROS distribution on PYTHONPATH, end a start in the middle of it.
"""

import os
import resource
import sys
from pathlib import Path

from mauve_rt.node.shared.failures import more_open_files, report_uncaught

_STREAMS = (("stdin", "r"), ("stdout", "w"), ("stderr", "w"))  # by their file descriptors
_OPEN_FILES = 1024  # a usual soft limit; a smaller one is raised to it where the hard limit permits
_LEAST_OPEN_FILES = 32  # a ROS node of one DDS participant has about 20 open, and more while it loads
_BAD_INPUT = 2
_OF_ROS = ("ament_index_python", "rclpy", "std_msgs")


def take_first_steps(program: str) -> None:
    """Prepare the process. The first call of an entry point, before there is a second thread.

    Raises:
        SystemExit: status 2, after a line on stderr: the process may open too few files.
    """
    open_standard_streams()
    report_uncaught(program)
    allowed = allow_open_files()
    if allowed < _LEAST_OPEN_FILES:
        sys.stderr.write(
            f"{program}: open files: expected at least {_LEAST_OPEN_FILES}. {more_open_files()}\n"
        )
        sys.exit(_BAD_INPUT)
    leave_out_foreign_ros()


def open_standard_streams() -> None:
    """Open /dev/null for each of stdin, stdout and stderr that is closed."""
    for descriptor, (name, mode) in enumerate(_STREAMS):
        try:
            os.fstat(descriptor)
        except OSError:
            opened = os.open(os.devnull, os.O_RDWR)  # the lowest free number
            if opened != descriptor:
                os.dup2(opened, descriptor)
                os.close(opened)
            os.set_inheritable(descriptor, True)
        if getattr(sys, name) is None:
            setattr(sys, name, open(descriptor, mode, encoding="utf-8", closefd=False))  # noqa: SIM115


def allow_open_files() -> int:
    """Raise a low soft limit for open files as far as the hard limit permits; returns the limit."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = _OPEN_FILES if hard == resource.RLIM_INFINITY else min(_OPEN_FILES, hard)
    if soft != resource.RLIM_INFINITY and soft < wanted:
        resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))
        soft = wanted
    return _OPEN_FILES if soft == resource.RLIM_INFINITY else soft


def leave_out_foreign_ros() -> None:
    """Leave out entries of PYTHONPATH with another ROS than this interpreter's environment has.

    scripts/setup does the same with the whole variable before it builds. An environment without a ROS of its
    own finds ROS by PYTHONPATH: there nothing is left out.
    """
    named = [entry for entry in os.environ.get("PYTHONPATH", "").split(os.pathsep) if entry]
    with_ros = [entry for entry in named if _has_ros(Path(entry))]
    if not with_ros:
        return
    import sysconfig  # noqa: PLC0415 - 0.2 MB, with the configuration that it reads

    own = Path(sysconfig.get_path("purelib"))
    if not _has_ros(own):
        return
    foreign = {entry for entry in with_ros if _is_other(Path(entry), own)}
    if foreign:
        os.environ["PYTHONPATH"] = os.pathsep.join(entry for entry in named if entry not in foreign)
        absolute = {os.path.abspath(entry) for entry in foreign}  # noqa: PTH100 - as the interpreter does
        sys.path[:] = [entry for entry in sys.path if os.path.abspath(entry) not in absolute]  # noqa: PTH100


def _is_other(folder: Path, own: Path) -> bool:
    try:
        return not folder.samefile(own)
    except OSError:
        return False


def _has_ros(folder: Path) -> bool:
    try:
        return any((folder / name).is_dir() for name in _OF_ROS)
    except OSError:  # it may not be read
        return False
