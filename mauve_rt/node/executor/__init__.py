"""The node `executor`: an architecture on ROS 2."""

# Before anything that loads the C++ library: its allocations are counted, too, then.
from mauve_rt import _kernel as _kernel
