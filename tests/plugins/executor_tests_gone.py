"""A module that leaves as a program does, in the middle of its import."""

import sys

sys.exit("this module is gone")
