"""Machines made of namespaces, which not every computer lets a test make."""

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from mauve_examples.mission.hosts import HostsError


@contextmanager
def hosts_or_skip() -> Iterator[None]:
    """Inside of it the test is skipped where no such machines can be made."""
    try:
        yield
    except HostsError as error:
        pytest.skip(str(error))
