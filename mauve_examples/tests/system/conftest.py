import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))  # for demo_harness and bag_reading

from demo_harness import Starter


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Starter]:
    """Start a demo: start("--robots", "2", ...)."""
    starter = Starter(tmp_path)
    yield starter
    starter.close()


@pytest.fixture(scope="module")
def start_once(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Starter]:
    """As `start`, for a mission that several tests look at."""
    starter = Starter(tmp_path_factory.mktemp("once"))
    yield starter
    starter.close()
