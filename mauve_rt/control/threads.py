"""Threads of a running executor that are no components: the list that it publishes and analyzes."""

from collections.abc import Collection, Iterable, Mapping, Sequence

from mauve_rt._kernel import ComponentDescription
from mauve_rt.control.runtime import Runtime
from mauve_rt.model.threads import ThreadInfo, ThreadList, is_named, thread_list


def threads_of(
    runtime: Runtime,
    components: Sequence[ComponentDescription],
    uses: Mapping[str, Collection[str]],
    *,
    others: Iterable[ThreadInfo] = (),
) -> ThreadList:
    """The threads that the settings ask for, and each of `others` that is none of them.

    Args:
        runtime: what runs.
        components: of the runtime.
        uses: how threads that are no components use resources, as `uses_of`.
        others: real-time threads of the process.

    """
    all_uses = {resource: {*sides} for resource, sides in uses.items()}
    for name in runtime.model.recorded:
        all_uses.setdefault(name, set()).add("records")
    has_bounds = any(state.max_execution_ns for part in components for state in part.states)
    known = thread_list(runtime.model.executor, all_uses, components=len(components), has_bounds=has_bounds)
    names = {each.name for each in known.tasks} | {part.name for part in components}
    found = (each for each in others if not is_named(each.name, names))
    return ThreadList(known.wakeup_ns, known.overhead_ns, (*known.tasks, *found))
