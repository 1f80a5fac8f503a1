"""For drivers: what a machine is told to do, and the safe value where no command comes. Needs no ROS."""

from mauve_rt.driver.command_watch import CommandWatch

__all__ = ["CommandWatch"]
