"""Parts of ROS and numpy that our programs do not use, left out of their start."""

import os
import sys
from types import ModuleType

_MESSAGE_GENERATOR = "rosidl_generator_py.generate_py_impl"


def leave_out_unused() -> None:
    """Leave out what costs a process time and memory and serves no running program of ours.

    Call this at the start of a process, before anything loads numpy or a message's type support, and before
    there is a thread that reads the environment.

    - OpenBLAS starts a thread for each CPU as soon as numpy is loaded: half of numpy's CPU time. A process
      whose components have CPUs of their own has no use for these threads. The user's setting counts.
    - rosidl_generator_py loads the generator of message code, 7 MB with its parser, together with the first
      type support. The package does without a generator that cannot be loaded, as one that is None here.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    modules: dict[str, ModuleType | None] = sys.modules  # type: ignore[assignment]  # importlib takes None
    modules.setdefault(_MESSAGE_GENERATOR, None)
