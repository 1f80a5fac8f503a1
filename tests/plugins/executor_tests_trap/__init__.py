"""Installed, but no interface package: whoever imports it leaves a trace."""

import os
from pathlib import Path

Path(os.environ["EXECUTOR_TESTS_TRAP"]).touch()
