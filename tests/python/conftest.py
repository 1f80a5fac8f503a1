import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))  # for python_parts

from python_parts import Stage


@pytest.fixture
def built() -> Iterator[Stage]:
    """An empty architecture, shut down at the end."""
    with Stage() as stage:
        yield stage
