"""The settings that the kernel has for a component's task: limits, defaults and hints are its own."""

from typing import Any

from mauve_rt._kernel import TASK_SETTINGS
from mauve_rt.file_schema.kinds import Choice, Flag, Kind, ListOf, Real, Whole
from mauve_rt.file_schema.section import Setting

_NS_PER_MS = 1e6
_INT_MAX = 2**31 - 1


class KernelSetting(Setting):
    """A setting of a Section that the kernel knows by `name`; None where the kernel is to choose."""

    def __init__(self, name: str, what: str, *, in_ms: bool, default: Any) -> None:
        known = TASK_SETTINGS[name]
        self.name, self._in_ms = name, in_ms
        kind: Kind = Choice(*known.choices)
        usual: Any = known.default
        if isinstance(usual, list):  # CPUs: that the machine has one, element_problems() sees
            kind, usual = ListOf(Whole(known.least, _INT_MAX), few=1), usual or None
        elif isinstance(usual, bool):
            kind = Flag()
        elif isinstance(usual, int):
            kind = Whole(known.least, known.most)
            if not known.least <= usual <= known.most:
                usual = None
            if in_ms:
                kind = Real(least=known.least / _NS_PER_MS, most=known.most / _NS_PER_MS)
                usual = None if usual is None else usual / _NS_PER_MS
        super().__init__(kind, what, default=usual if default is None else default, hint=known.hint)

    def to_kernel(self, value: Any) -> Any:
        """A value of the file as the kernel takes it."""
        return round(value * _NS_PER_MS) if self._in_ms else value


def kernel_setting(name: str, what: str, *, in_ms: bool = False, default: Any = None) -> Any:
    """The kernel's setting of that name, with its default or another; `in_ms`: nanoseconds to the kernel."""
    return KernelSetting(name, what, in_ms=in_ms, default=default)
