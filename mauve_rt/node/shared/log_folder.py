"""The folder for rcl's log files, decided before rcl is initialized: without one rcl refuses to start.

rcl takes ROS_LOG_DIR, else ROS_HOME/log, else HOME/.ros/log. Where no file can be written there, a folder for
temporary files takes its place. Where that one cannot be written either, there are no log files.
"""

import os
from pathlib import Path

from mauve_rt.scratch import scratch_folders, unwritable

LOG_FOLDER = "ROS_LOG_DIR"
NO_LOG_FILES = ("--ros-args", "--disable-external-lib-logs")
_REMEDY = f"Set {LOG_FOLDER} to a folder that can be written."


def choose_log_folder() -> tuple[tuple[str, ...], str]:
    """Set ROS_LOG_DIR where rcl's own choice cannot be written.

    Returns:
        Further words for rcl's command line, and a remark for the user; both empty where all is usual.
    """
    problem = _problem_of_usual()
    if not problem:
        return (), ""
    temporary = _temporary_folder()
    if temporary is None:
        return NO_LOG_FILES, f"{problem}. This run writes no log files. {_REMEDY}"
    os.environ[LOG_FOLDER] = str(temporary)
    return (), f"{problem}. This run's log files are in {temporary}. {_REMEDY}"


def _problem_of_usual() -> str:
    """Why no file can be written where rcl would write it; "" where one can."""
    folder = os.environ.get(LOG_FOLDER) or f"{os.environ.get('ROS_HOME') or '~/.ros'}/log"
    if folder.startswith("~"):
        home = os.environ.get("HOME")
        if home is None:
            return f"log folder: expected {LOG_FOLDER} or HOME in the environment, found neither"
        folder = home + folder[1:]
    path = Path(folder)
    return f"log folder {path}: cannot be written ({error})" if (error := unwritable(path)) else ""


def _temporary_folder() -> Path | None:
    """A folder of this account's own for temporary files; None where there is none."""
    for parent in scratch_folders():
        folder = parent / f"mauve_rt_log_{os.geteuid()}"
        if _is_own(folder) and not unwritable(folder):
            return folder
    return None


def _is_own(folder: Path) -> bool:
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.lstat()
    except OSError:
        return False
    return folder.is_dir() and not folder.is_symlink() and found.st_uid == os.geteuid()
