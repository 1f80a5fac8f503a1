"""The supervisor process: watches an executor by the rules of a file.

    ros2 run mauve_rt supervisor --ros-args -r __ns:=/robot_1 -p rules:=FILE

Exit status: 0 after SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGUSR1 or SIGUSR2, 2 for bad input (one line on
stderr).
"""

import sys
from collections.abc import Sequence

from mauve_rt.node.shared.first_steps import take_first_steps
from mauve_rt.node.shared.process import BAD_INPUT, Stop, asks_for_help, complain, run_until_signalled
from mauve_rt.node.shared.ros_start import RosStart, RosStartError, settle_ros_start


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the node until signalled; returns the exit status."""
    take_first_steps("supervisor")
    words = sys.argv if arguments is None else arguments
    if asks_for_help(words):
        from mauve_rt.node.supervisor.settings import help_text  # noqa: PLC0415 - takes its time to load

        sys.stdout.write(help_text())
        return 0
    try:
        start = settle_ros_start()
    except RosStartError as error:
        complain(f"supervisor: {error}")
        return BAD_INPUT
    return run_until_signalled(lambda stop: _work(words, start, stop), program="supervisor")


def _work(arguments: Sequence[str], start: RosStart, stop: Stop) -> int:
    # Imported here: a signal while modules load is handled already, and threads they start block signals too.
    from mauve_rt.node.supervisor.node import run_node  # noqa: PLC0415

    stop.begin()
    return run_node(arguments, start, stop)


if __name__ == "__main__":
    sys.exit(main())
