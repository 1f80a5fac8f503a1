"""Values of the project from and to mauve_msgs, and qualities of service."""
