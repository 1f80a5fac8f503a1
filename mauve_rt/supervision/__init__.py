"""Rules: their file, their check, their engine, their rehearsal. Knows no ROS."""
