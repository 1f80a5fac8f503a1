"""ROS 2 nodes: the executor, which runs an architecture, and the supervisor, which reconfigures it."""
