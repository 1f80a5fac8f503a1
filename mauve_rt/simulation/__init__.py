"""The same nodes in virtual time, without ROS."""
