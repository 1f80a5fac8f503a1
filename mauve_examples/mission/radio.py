"""The radio process of a mission.

    ros2 run mauve_examples radio --ros-args -p robots:="[robot_1,robot_2]" [-p drop_share:=0.1] [-p seed:=1]
        [-p link_loss_at_s:=20.0] [-p link_back_at_s:=45.0]

Exit status: 0 after SIGINT or SIGTERM, 2 for bad parameters (one line on stderr).
"""

import sys

from mauve_rt.node.shared.first_steps import take_first_steps
from mauve_rt.node.shared.process import BAD_INPUT, Stop, complain, run_until_signalled
from mauve_rt.node.shared.ros_start import RosStartError, settle_ros_start


def main(arguments: list[str] | None = None) -> int:
    """Run the node until signalled; returns the exit status."""
    take_first_steps("radio")
    try:
        start = settle_ros_start()
    except RosStartError as error:
        complain(f"radio: {error}")
        return BAD_INPUT
    words = [*(sys.argv if arguments is None else arguments), *start.arguments]
    return run_until_signalled(lambda stop: _work(words, stop), program="radio")


def _work(arguments: list[str], stop: Stop) -> int:
    # Imported here: a signal while modules load is handled already, and threads they start block signals too.
    from mauve_examples.mission.radio_node import run_node  # noqa: PLC0415

    stop.begin()
    return run_node(arguments, stop)


if __name__ == "__main__":
    sys.exit(main())
