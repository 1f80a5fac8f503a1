"""A context that others are entered in, and end with."""

from abc import ABC, abstractmethod
from contextlib import ExitStack
from types import TracebackType
from typing import Self


class Scope(ABC):
    """A context. What `_enter` has entered ends with it, also when that fails half-way."""

    def __init__(self) -> None:
        self._stack = ExitStack()

    @abstractmethod
    def _enter(self, stack: ExitStack) -> None:
        """Enter into `stack` all that ends with this context."""

    def __enter__(self) -> Self:
        with ExitStack() as stack:
            self._enter(stack)
            self._stack = stack.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._stack.__exit__(kind, error, traceback)
