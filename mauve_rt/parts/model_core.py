"""Cores in Python whose actions and guards a model names.

    class StraightGuidance(GuidanceCore):       # GuidanceCore was generated from the model
        def read_inputs(self) -> None: ...
        def has_path(self) -> bool: ...

A class that several implementations share says so: `class Common(GuidanceCore, abstract=True)`.
"""

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Generic

from mauve_rt.parts.cores import Core, ShellT

__all__ = ["ModelCore"]


class ModelCore(Core[ShellT], Generic[ShellT]):
    """Base of the abstract cores that are generated from a model.

    An implementation has the methods that the model names, and no others.

    Raises:
        TypeError: where an implementation is declared: it lacks a method, or has one that the model does not
        name. Methods of its own begin with an underscore.
    """

    actions: ClassVar[Sequence[str]] = ()
    """Methods that execution states call."""
    guards: ClassVar[Sequence[str]] = ()
    """Methods that transitions ask."""
    worst_cases: ClassVar[Mapping[str, Mapping[str, int]]] = {}
    """Worst-case execution times in ns, by implementation and method."""

    def __init_subclass__(cls, *, abstract: bool = False, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        if "actions" in vars(cls):
            return  # the generated one
        methods = (*cls.actions, *cls.guards)
        unknown = [name for name in _own_methods(cls) if name not in methods]
        if unknown:
            remedy = "begin its name with an underscore, or name it in the model"
            raise TypeError(
                f"{cls.__qualname__} has a method {unknown[0]} that the model does not name; {remedy}"
            )
        lacking = [name for name in methods if not callable(getattr(cls, name, None))]
        if lacking and not abstract:
            raise TypeError(f"{cls.__qualname__} lacks {', '.join(lacking)}, which the model names; write it")
        cls.wcet_ns = cls.worst_cases.get(cls.__name__, {})


def _own_methods(of: type) -> list[str]:
    """The functions that a class declares, but for those of every core."""
    return [
        name
        for name, value in vars(of).items()
        if callable(value) and not name.startswith("_") and not hasattr(Core, name)
    ]
