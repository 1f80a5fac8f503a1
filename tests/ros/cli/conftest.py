"""Terminals of the test's own."""

from collections.abc import Callable, Iterator
from typing import Any

import pytest
from terminal import Terminal


@pytest.fixture
def terminal(domain: int) -> Iterator[Callable[..., Terminal]]:
    opened: list[Terminal] = []

    def open_(*words: str, **options: Any) -> Terminal:
        opened.append(Terminal(*words, domain=domain, **options))
        return opened[-1]

    yield open_
    for each in opened:
        each.end()
