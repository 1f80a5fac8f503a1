"""For drivers: the last command, and the safe one where no command comes. Needs no ROS."""

from mauve_rt.driver.command_watch import CommandWatch

__all__ = ["CommandWatch"]
