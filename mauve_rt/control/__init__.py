"""A request carried out or refused. Knows no ROS."""
