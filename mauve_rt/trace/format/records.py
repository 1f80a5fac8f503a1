"""Trace records as numpy sees them: the layout of mauve_msgs/msg/TraceRecord and what its kinds mean."""

from enum import IntEnum
from typing import Any

import numpy as np
import numpy.typing as npt


class Kind(IntEnum):
    """Kinds of trace records that readers know more of than their table tells (see `kinds`)."""

    DEPLOYMENT = 1
    START = 2
    STOP = 3
    FAULT = 4
    RELEASE = 5
    STATE_BEGIN = 6
    STATE_END = 7
    WAIT = 8
    OVERRUN = 9
    PARKED = 10
    ARMED = 11
    SERVICE_BEGIN = 12
    SERVICE_END = 13
    CONTENDED = 14
    RECONFIGURATION = 15
    MARK = 16
    DECISION = 17


class ReconfigurationPhase(IntEnum):
    """Values of `a` in records of kind RECONFIGURATION."""

    ADOPT = 1
    TAKE = 2


DEADLINE_MISSED = "deadline missed"
"""Name of a record of kind MARK at a deadline, in a bag that an analysis wrote; `a`: how late, in ns."""


IN_VAIN = 2
"""Value of `b` in records of kind ARMED: the change was called off; nothing was changed."""


RECORD = np.dtype(
    [
        ("sequence", "<u8"),
        ("time_ns", "<i8"),
        ("a", "<i8"),
        ("b", "<i8"),
        ("c", "<i8"),
        ("name", "<u4"),
        ("kind", "<u2"),
        ("component", "<u2"),
    ]
)
"""One record, 48 bytes, little-endian, no padding; times in ns of CLOCK_MONOTONIC."""

Records = npt.NDArray[Any]
"""A structured array of dtype RECORD. (numpy has no static type for the fields of one.)"""
