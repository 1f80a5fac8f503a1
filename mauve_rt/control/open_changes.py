"""Changes that are not complete: what is known of them, for how long, and the way out."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

from mauve_rt.control.requests import Code, code_of
from mauve_rt.control.runtime import Runtime
from mauve_rt.errors import MauveError

if TYPE_CHECKING:
    from mauve_rt._kernel import OpenChange

_LONG_NS = 1_000_000_000  # a change that is open for longer is told in /diagnostics
_DONE = {
    "called_off": "the change of component '{}' is called off: nothing was changed",
    "faulted": "component '{}' is given up: it is FAULTED, its outputs are safe, and its thread is left "
    "behind until its state ends; remove the component, or remove it and add it anew",
    "stopped": "component '{}' is stopped: its state had just ended",
}


def open_changes(runtime: Runtime) -> list["OpenChange"]:
    """Every open change; none while unconfigured. From any thread; waits for no change."""
    return runtime.host.open_changes() if runtime.configured else []


def abandon(runtime: Runtime, component: str) -> tuple[Code, str]:
    """Call off the change of a component, or give the component up. From any thread; waits for no change."""
    if not runtime.active:
        return Code.NOT_ACTIVE, "the executor is not active; activate it first (lifecycle)"
    try:
        done = runtime.host.abandon(component)
    except MauveError as error:
        return code_of(error), str(error)
    return Code.OK, _DONE[done].format(component)


def long_ones(changes: Sequence["OpenChange"], now_ns: int) -> Iterator[str]:
    """A line for each component that keeps a change open for long."""
    for change in changes:
        if now_ns - change.begun_ns <= _LONG_NS:
            continue
        by = f" of {change.author}" if change.author else ""
        if not change.late:
            yield f"the change{by} is {change.phase}{in_hook(change)}"
        for late in change.late:
            yield f"late: {late.name} has not {done_with(change.phase)} the change{by}, {in_state(late)}"


def done_with(phase: str) -> str:
    """What a component has yet to do with a change: `agreed to` or `taken`."""
    return "agreed to" if phase == "waiting" else "taken"


def in_hook(change: Any) -> str:
    """`, in configure of core my_robot/Pid for 3.2 s`; of a change of the kernel, or a message OpenChange."""
    return f", in {change.hook} for {change.hook_age_ns / 1e9:.3g} s" if change.hook else ""


def in_state(late: Any) -> str:
    """`in state Act for 3.2 s`; of a component of the kernel, or a message LateComponent."""
    state = f"in {'wait' if late.waiting else 'state'} {late.state}" if late.state else "in no state"
    age = f" for {late.state_age_ns / 1e9:.3g} s" if late.state_age_ns else ""
    return f"{state}{age}{', left behind: its thread still executes' if late.left_behind else ''}"
