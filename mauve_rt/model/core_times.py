"""Worst cases of a component whose core is not the one of its file."""

from typing import Any

from mauve_rt._kernel import PluginRegistry
from mauve_rt.model.schema import ComponentModel


def times_of_other_core(
    part: Any, declared: ComponentModel | None, registry: PluginRegistry
) -> dict[str, int | None]:
    """By state what the present core declares, in ns, where the file declares a worst case for another core.

    None: the present core declares none. A worst case that is enforced holds for every core.

    Args:
        part: the component with the core that it has.
        declared: as the file describes it.
        registry: with the core.

    """
    if declared is None or declared.core == part.core:
        return {}
    times = registry.describe_core(part.core).wcet_ns
    found: dict[str, int | None] = {}
    for state in part.states:
        of_file = declared.states.get(state.name)
        if of_file is None or of_file.wcet_ns is None or state.wcet_enforced:
            continue
        methods = [*([] if state.is_wait else [state.action]), *state.guards]
        is_known = all(method in times for method in methods)
        found[state.name] = sum(times[method] for method in methods) if is_known else None
    return found
