"""The radio between the robots: carries what one says to every other one; can be cut, or lose a share.

It forwards /robot_i/radio/out to every other /robot_j/radio/in as the bytes they are. `~/set_link`
(std_srvs/SetBool) cuts and restores the link, `~/link` (std_msgs/Bool, transient local) tells which; the
parameter `drop_share` may be changed at any time, `seed` makes losses repeatable. `~/connected` (transient
local) is true once every robot both speaks and listens here. From then on the parameters `link_loss_at_s`
and `link_back_at_s` count: seconds after which the link is lost and back (0: never). What was forwarded and
dropped is on /diagnostics, once a second.
"""

import threading
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor, SetParametersResult
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import try_shutdown
from std_msgs.msg import Bool
from std_srvs.srv import SetBool

from mauve_examples.mission.medium import Counts, Medium
from mauve_msgs.msg import PeerMessage
from mauve_rt.node.shared.announcement import first_participant
from mauve_rt.node.shared.loopback import reach, udp_sockets
from mauve_rt.node.shared.process import BAD_INPUT, complain

DEPTH = 50
FIXED = ("robots", "seed", "link_loss_at_s", "link_back_at_s")
CONNECTION_CHECK_S = 0.1
PLANNED = (
    ("link_loss_at_s", "seconds after all have met until the link is lost; 0: never", False),
    ("link_back_at_s", "seconds after all have met until the link is back; 0: never", True),
)
SPIN_S = 0.2  # how long a stop may go unnoticed


class Radio(Node):
    """The radio node. Every method runs on the thread that spins it."""

    def __init__(self, **options: Any) -> None:
        """Create topics and service; `options` go to rclpy's Node.

        Raises:
            ValueError: no robots, two of one name, a share outside 0..1.
        """
        super().__init__("radio", **options)
        share = FloatingPointRange(from_value=0.0, to_value=1.0)
        robots = self.declare_parameter("robots", Parameter.Type.STRING_ARRAY).value or []
        drop_share = self.declare_parameter(
            "drop_share",
            0.0,
            ParameterDescriptor(
                description="share of deliveries lost at random", floating_point_range=[share]
            ),
        ).value
        seed = self.declare_parameter("seed", 1).value
        self._changes = [
            (self.declare_parameter(name, 0.0, ParameterDescriptor(description=words)).value, up)
            for name, words, up in PLANNED
        ]
        if not robots or len(set(robots)) != len(robots):
            raise ValueError(
                "parameter 'robots' must name every robot once: -p robots:=\"[robot_1,robot_2]\""
            )
        self._medium = Medium(robots, drop_share=drop_share, seed=seed)
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._link = self.create_publisher(Bool, "~/link", latched)
        self._connected = self.create_publisher(Bool, "~/connected", latched)
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self._into = {
            robot: self.create_publisher(PeerMessage, f"/{robot}/radio/in", DEPTH) for robot in robots
        }
        self._out_of = [
            self.create_subscription(
                PeerMessage, f"/{robot}/radio/out", self._forwarder(robot), DEPTH, raw=True
            )
            for robot in robots
        ]
        self.create_service(SetBool, "~/set_link", self._set_link)
        self._steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(CONNECTION_CHECK_S, self._check_connected, clock=self._steady)
        self.create_timer(1.0, self._publish_counts, clock=self._steady)
        self.add_on_set_parameters_callback(self._set_parameters)
        self._was_connected: bool | None = None
        self._link.publish(Bool(data=True))

    @property
    def counts(self) -> Counts:
        """What became of the messages so far."""
        return self._medium.counts

    def _forwarder(self, sender: str) -> Any:
        def forward(message: bytes) -> None:
            for robot in self._medium.receivers(sender):
                self._into[robot].publish(message)

        return forward

    def _set_link(self, request: Any, response: Any) -> Any:
        response.success, response.message = True, self._switch(up=request.data)
        return response

    def _switch(self, *, up: bool) -> str:
        self._medium.link_up = up
        self._link.publish(Bool(data=up))
        words = "link up" if up else "link down"
        self.get_logger().info(f"{words}; {self._medium.counts}")
        return words

    def _plan_changes(self) -> None:
        """All have met for the first time: the link changes so long after it."""
        for at_s, up in self._changes:
            if at_s > 0.0:
                self._plan_change(at_s, up)
        self._changes = []

    def _plan_change(self, at_s: float, up: bool) -> None:  # noqa: FBT001 - one caller
        def change() -> None:
            timer.cancel()
            self._switch(up=up)

        timer = self.create_timer(at_s, change, clock=self._steady)

    def _set_parameters(self, parameters: list[Any]) -> Any:
        for parameter in parameters:
            if parameter.name == "drop_share":
                self._medium.drop_share = float(parameter.value)
            elif parameter.name in FIXED:
                return SetParametersResult(successful=False, reason=f"{parameter.name} is fixed once it runs")
        return SetParametersResult(successful=True)

    def _check_connected(self) -> None:
        """Whether every robot has its endpoints, and ours have matched all that the graph knows."""
        listened = all(
            0 < self.count_subscribers(publisher.topic_name) <= publisher.get_subscription_count()
            for publisher in self._into.values()
        )
        spoken = all(subscription.get_publisher_count() > 0 for subscription in self._out_of)
        if (listened and spoken) != self._was_connected:
            self._was_connected = listened and spoken
            self._connected.publish(Bool(data=self._was_connected))
            if self._was_connected:
                self._plan_changes()

    def _publish_counts(self) -> None:
        counts = self._medium.counts
        status = DiagnosticStatus(
            level=DiagnosticStatus.OK if self._medium.link_up else DiagnosticStatus.WARN,
            name="radio",
            message="link up" if self._medium.link_up else "link down",
            values=[KeyValue(key=key, value=str(value)) for key, value in vars(counts).items()],
        )
        array = DiagnosticArray(status=[status])
        array.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(array)


def run_node(arguments: list[str], stop: threading.Event) -> int:
    """Run the node until `stop` is set; returns 0, or 2 for bad parameters (one line on stderr)."""
    try:
        sockets = udp_sockets()
        rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
        with first_participant():
            node = Radio()
        reach(sockets).log(node.get_logger())
    except Exception as error:  # noqa: BLE001 - rclpy has an exception class of its own for each mistake
        complain(f"radio: {error}")
        try_shutdown()
        return BAD_INPUT
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    try:
        while not stop.is_set():
            executor.spin_once(timeout_sec=SPIN_S)
    finally:
        executor.shutdown()
        node.destroy_node()
        try_shutdown()
    return 0
