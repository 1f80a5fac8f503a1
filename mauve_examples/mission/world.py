"""The process of the world that robots on machines of their own share.

    python -m mauve_examples.mission.world --ros-args -p robots:="[robot_1,robot_2]"

Exit status: 0 after SIGINT or SIGTERM, 2 where it cannot be kept to this machine as asked.
"""

import sys

from mauve_rt.node.shared.first_steps import take_first_steps
from mauve_rt.node.shared.process import BAD_INPUT, Stop, complain, run_until_signalled
from mauve_rt.node.shared.ros_start import RosStart, RosStartError, settle_ros_start


def main() -> int:
    """Run the node until signalled; returns the exit status."""
    take_first_steps("world")
    try:
        start = settle_ros_start()
    except RosStartError as error:
        complain(f"world: {error}")
        return BAD_INPUT
    return run_until_signalled(lambda stop: _work(start, stop), program="world")


def _work(start: RosStart, stop: Stop) -> int:
    # Imported here: a signal while modules load is handled already, and threads they start block signals too.
    from mauve_examples.mission.world_node import run_node  # noqa: PLC0415

    stop.begin()
    return run_node([*sys.argv, *start.arguments], stop)


if __name__ == "__main__":
    sys.exit(main())
