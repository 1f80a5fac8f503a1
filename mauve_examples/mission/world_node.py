"""The world that robots on machines of their own share: where each one's body is, all others can see.

It passes /robot_i/body on to /bodies, as the bytes they are. That is no radio: a body is seen, whatever the
link between the robots does.
"""

import threading

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import qos_profile_sensor_data
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import try_shutdown

from mauve_examples.mission.architecture import body_of
from mauve_msgs.msg import RobotBody
from mauve_rt.node.shared.announcement import first_participant

_SPIN_S = 0.2  # how long a stop may go unnoticed


class WorldNode(Node):
    """The node. Every method runs on the thread that spins it."""

    def __init__(self) -> None:
        """Watch the robots that the parameter `robots` names."""
        super().__init__("world")
        robots = self.declare_parameter("robots", Parameter.Type.STRING_ARRAY).value or []
        bodies = self.create_publisher(RobotBody, "/bodies", qos_profile_sensor_data)
        for robot in robots:
            topic = body_of(robot)
            self.create_subscription(RobotBody, topic, bodies.publish, qos_profile_sensor_data, raw=True)


def run_node(arguments: list[str], stop: threading.Event) -> int:
    """Run the node until `stop` is set; returns 0."""
    rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
    with first_participant():
        node = WorldNode()
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    try:
        while not stop.is_set():
            executor.spin_once(timeout_sec=_SPIN_S)
    finally:
        executor.shutdown()
        node.destroy_node()
        try_shutdown()
    return 0
