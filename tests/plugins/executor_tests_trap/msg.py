"""Looks like the messages of a package."""

from std_msgs.msg import Float64 as X

__all__ = ["X"]
