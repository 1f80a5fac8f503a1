"""What all tests share, MAUVE RT's and the mission's: how Hypothesis tries, what reads their bags."""

import sys
from pathlib import Path

from hypothesis import HealthCheck, settings

import mauve_examples  # noqa: F401 - as it is installed: pytest would name tests after the clone's folder

sys.path.insert(0, str(Path(__file__).parent / "tests"))  # for bag_rules
sys.path.append(str(Path(__file__).parent / "scripts"))  # for check_claims

# What an example may take depends on what else the machine does.
settings.register_profile("mauve", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("mauve")
