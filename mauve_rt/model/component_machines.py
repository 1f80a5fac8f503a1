"""Components as the timing analysis takes them, of what an executor, a bag or the kernel tells of them."""

from collections.abc import Iterable, Mapping
from typing import Any

from mauve_rt.analysis.machines import Machine
from mauve_rt.model.plugins import PluginIndex


def component_machines(
    components: Iterable[Any], kinds: Mapping[str, str], index: PluginIndex
) -> list[Machine]:
    """Of each component, with the fields of mauve_msgs/msg/ComponentInfo; `kinds`: of resources, by name."""
    return [Machine.of(part, is_python=is_python_part(part, index), kinds=kinds) for part in components]


def is_python_part(part: Any, index: PluginIndex, modelled: Mapping[str, bool] | None = None) -> bool | None:
    """Whether one of its parts is in Python; None: not known. `modelled`: of parts that a model describes."""
    known = modelled or {}
    named = (("shell", part.shell), ("core", part.core), ("fsm", part.fsm))
    plugins = [index.find(kind, name) for kind, name in named if name not in known]
    if any(known.get(name) for _, name in named) or any(
        each is not None and each.is_python for each in plugins
    ):
        return True
    return None if None in plugins else False
