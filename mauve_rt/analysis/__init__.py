"""Timing: which jobs the components of an architecture release, and when each is done. No ROS in it."""
