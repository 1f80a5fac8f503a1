"""Implementations of a model's cores in Python."""

from collections.abc import Mapping
from typing import ClassVar

import pytest

from mauve_rt.api import ModelCore, PeriodicFsm, Shell


class GuidanceCore(ModelCore[Shell]):
    """As it is generated."""

    actions = ("read", "follow")
    guards = ("has_path",)
    worst_cases: ClassVar[Mapping[str, Mapping[str, int]]] = {"Straight": {"read": 1000}}


class Straight(GuidanceCore):
    """All methods, and one of its own."""

    def read(self) -> None:
        self._look()

    def follow(self) -> None: ...

    def has_path(self) -> bool:
        return False

    def configure(self) -> None: ...

    def _look(self) -> None: ...


def test_an_implementation_has_the_methods_of_the_model() -> None:
    assert Straight.wcet_ns == {"read": 1000}

    with pytest.raises(TypeError, match="Lacking lacks follow, has_path, which the model names"):

        class Lacking(GuidanceCore):
            def read(self) -> None: ...

    with pytest.raises(
        TypeError, match="More has a method old_name that the model does not name; begin its name"
    ):

        class More(Straight):
            def old_name(self) -> None: ...


def test_what_implementations_share_is_abstract() -> None:
    class Common(GuidanceCore, abstract=True):
        def read(self) -> None: ...

    class Whole(Common):
        def follow(self) -> None: ...

        def has_path(self) -> bool:
            return True

    assert Whole.wcet_ns == {}


def test_a_period_comes_before_the_states() -> None:
    with pytest.raises(RuntimeError, match="call period\\(\\) before the first state"):
        PeriodicFsm[Shell, GuidanceCore](Shell()).periodic_state("Idle", "read")
