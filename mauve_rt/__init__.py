"""MAUVE RT: real-time components whose software can be rewired and re-implemented while it runs, on ROS 2.

`mauve_rt.api` is the door for who writes parts and programs in Python; `mauve_rt.trace` reads what happened.
`mauve_rt.model` reads architecture files, `mauve_rt.node` runs them as ROS 2 nodes, `mauve_rt.cli` is the
`mauve` command.
"""

from mauve_rt._kernel import __version__

__all__ = ["__version__"]
