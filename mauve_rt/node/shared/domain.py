"""ROS_DOMAIN_ID, checked before Fast DDS ends the process for a number that it cannot use."""

import os
import re

DOMAIN = "ROS_DOMAIN_ID"
_LARGEST = 232  # by the UDP ports of RTPS


def domain() -> int:
    """The ROS domain that the environment says; it has no `domain_problem`."""
    return int(os.environ.get(DOMAIN) or 0)


def domain_problem() -> str:
    """What is wrong with ROS_DOMAIN_ID, and the remedy; "" where nothing is."""
    given = os.environ.get(DOMAIN, "")
    if not given or (re.fullmatch(r"\d{1,9}", given, re.ASCII) and int(given) <= _LARGEST):
        return ""
    return f"{DOMAIN}: expected a number from 0 to {_LARGEST}, found {given}. Choose one from 0 to 101."
