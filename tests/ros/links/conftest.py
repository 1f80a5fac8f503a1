"""Tests of links: what they share lies beside them."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))  # for listener, scenarios, lossy_cable, needed_hosts
