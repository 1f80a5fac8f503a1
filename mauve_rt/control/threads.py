"""Threads of a running executor that are no components: the list that it publishes and analyzes."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any

from mauve_rt.control.runtime import Runtime
from mauve_rt.model.threads import ThreadInfo, ThreadList, is_named, thread_list


def threads_of(
    runtime: Runtime,
    components: Sequence[Any],
    uses: Mapping[str, Collection[str]],
    *,
    has_bounds: bool,
    others: Iterable[ThreadInfo] = (),
) -> ThreadList:
    """The threads that the settings ask for, and each of `others` that is none of them.

    Args:
        runtime: what runs.
        components: that there are, with their names.
        uses: how threads that are no components use resources, as `uses_of`.
        has_bounds: a state of a component has a `max_execution_ns`, or an enforced worst case.
        others: real-time threads of the process.

    """
    all_uses = {resource: {*sides} for resource, sides in uses.items()}
    for name in runtime.model.recorded:
        all_uses.setdefault(name, set()).add("records")
    known = thread_list(runtime.model.executor, all_uses, components=len(components), has_bounds=has_bounds)
    names = {each.name for each in known.tasks} | {part.name for part in components}
    found = (each for each in others if not is_named(each.name, names))
    return ThreadList(known.wakeup_ns, known.overhead_ns, (*known.tasks, *found))
