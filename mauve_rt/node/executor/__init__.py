"""The node `executor`: an architecture on ROS 2."""
