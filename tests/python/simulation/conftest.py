"""Fixtures of the tests in which chains of controllers are changed and have faults."""

from collections.abc import Iterator

import pytest
from controller_chains import Execution, Noted
from python_parts import Stage
from running_host import Running


@pytest.fixture
def log() -> Iterator[list[Execution]]:
    Noted.log.clear()
    yield Noted.log
    Noted.log.clear()


@pytest.fixture(params=["threads", "virtual"])
def running(request: pytest.FixtureRequest, log: list[Execution]) -> Iterator[Running]:
    del log
    with Stage() as stage:
        made = Running(stage, simulated=request.param == "virtual")
        yield made
        made.host.shutdown()
