"""Asks an executor for its components with as little as rclpy needs for it.

rclpy_list.py EXECUTOR
"""

import sys

import rclpy
from rclpy.node import Node

from mauve_msgs.srv import ListComponents


def main() -> None:
    """Print how many there are."""
    rclpy.init(args=[])
    node = Node("rclpy_list", enable_rosout=False, start_parameter_services=False)
    client = node.create_client(ListComponents, f"{sys.argv[1]}/list_components")
    while not client.wait_for_service(timeout_sec=0.02):
        pass
    future = client.call_async(ListComponents.Request())
    rclpy.spin_until_future_complete(node, future)
    print(len(future.result().components))
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    main()
