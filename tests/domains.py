"""ROS domains for tests. scripts/test gives each process of tests that runs in parallel its own range."""

import os
import random


def draw_domain() -> int:
    """A domain of the range that the environment names; system tests have 51 to 100."""
    first, _, last = os.environ.get("MAUVE_TEST_DOMAINS", "1-50").partition("-")
    return random.SystemRandom().randint(int(first), int(last))
