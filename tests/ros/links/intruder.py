"""A node that tries to change executors: python intruder.py MUST_REACH[,MUST_REACH] [MAY_REACH].

Prints, as JSON and by executor, which services answered, and how many subscribers a topic of it has. It ends
1.5 s after everything of those that it must reach was reached.
"""

import json
import sys
import time

import rclpy
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from rclpy.node import Node
from rclpy.task import Future
from std_msgs.msg import Float64

from mauve_msgs.srv import Stop

GRACE_S, RESEND_S = 1.5, 2.0
TRUTH = ParameterValue(type=ParameterType.PARAMETER_BOOL, bool_value=True)
REQUESTS = {
    "executor/stop": (Stop, Stop.Request(component="relay")),
    "executor/set_parameters": (
        SetParameters,
        SetParameters.Request(parameters=[Parameter(name="use_sim_time", value=TRUTH)]),
    ),
    "executor/change_state": (
        ChangeState,
        ChangeState.Request(transition=Transition(id=Transition.TRANSITION_DEACTIVATE)),
    ),
}


class Attempt:
    """At one service."""

    def __init__(self, node: Node, name: str, what: str) -> None:
        service_type, self._request = REQUESTS[what]
        self._client = node.create_client(service_type, f"/{name}/{what}")
        self._futures: list[Future] = []
        self._sent_s = 0.0
        self.what = what

    def answered(self) -> bool:
        return any(future.done() for future in self._futures)

    def go_on(self) -> None:
        """Ask, whether the service is seen or not; again while no answer comes."""
        if not self.answered() and time.monotonic() > self._sent_s + RESEND_S:
            self._sent_s = time.monotonic()
            self._futures.append(self._client.call_async(self._request))


def main() -> None:
    wanted, *others = (names.split(",") for names in sys.argv[1:])
    names = [*wanted, *(name for names in others for name in names)]
    rclpy.init(args=[])
    node = rclpy.create_node("intruder", enable_rosout=False, start_parameter_services=False)
    attempts = {name: [Attempt(node, name, what) for what in REQUESTS] for name in names}
    voices = {name: node.create_publisher(Float64, f"/{name}/given", 10) for name in names}

    def is_reached(name: str) -> bool:
        return voices[name].get_subscription_count() > 0 and all(map(Attempt.answered, attempts[name]))

    reached_s = None
    while reached_s is None or time.monotonic() < reached_s + GRACE_S:
        for name in names:
            voices[name].publish(Float64(data=666.0))
            for attempt in attempts[name]:
                attempt.go_on()
        rclpy.spin_once(node, timeout_sec=0.05)
        if reached_s is None and all(map(is_reached, wanted)):
            reached_s = time.monotonic()
    found = {
        name: {
            "answered": [attempt.what for attempt in attempts[name] if attempt.answered()],
            "subscribers": voices[name].get_subscription_count(),
        }
        for name in names
    }
    sys.stdout.write(json.dumps(found))


main()
