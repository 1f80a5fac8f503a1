"""Findings about executors that answer, from their own replies."""

from collections.abc import Iterator, Sequence
from typing import Any

from mauve_rt.counts import counted
from mauve_rt.doctor.finding import Finding, error, ok, warning

_FAULTED = 5  # of mauve_msgs/msg/ComponentInfo


def describe_found(executors: Sequence[str]) -> Iterator[Finding]:
    """The executors that this shell reaches."""
    yield ok(", ".join(executors) or "none")


def describe_executor(reply: Any, denied_here: Sequence[str]) -> Iterator[Finding]:
    """One executor, by its ListComponents reply. `denied_here`: rights that this shell lacks."""
    rights = "docs/howto/realtime_rights.md"
    for line in reply.realtime.missing:
        yield warning(line, cost="components of this executor run without this right", remedy=rights)
    if bool(reply.realtime.missing) != bool(denied_here):
        here, there = ("fewer", "more") if denied_here else ("more", "fewer")
        yield warning(
            f"the executor has {there} real-time rights than this shell",
            cost=f"an executor that you start from this shell has {here} rights than this one",
            remedy=f"compare `ulimit -r -l` here with LimitRTPRIO and LimitMEMLOCK of its unit: {rights}",
        )
    others = [each.name for each in reply.components if each.policy not in ("", "SCHED_FIFO")]
    if others and not reply.realtime.missing:
        cost = "other programs delay these components"
        yield warning(f"not SCHED_FIFO: {', '.join(others)}", cost=cost, remedy=rights)
    late = [
        f"{each.name} {each.overruns:,} of {each.releases:,}" for each in reply.components if each.overruns
    ]
    if late:
        yield warning(
            f"overruns: {', '.join(late)}",
            cost="these components missed instants",
            remedy="docs/howto/find_an_overrun.md",
        )
    faulted = [each.name for each in reply.components if each.state == _FAULTED]
    if faulted:
        yield warning(
            f"faulted: {', '.join(faulted)}",
            cost="these components do not run",
            remedy="docs/howto/repair_a_faulted_component.md",
        )
    for line in reply.warnings:
        yield warning(
            line, cost="requests may reach another executor, or none", remedy="docs/howto/operate.md"
        )
    count = counted(len(reply.components), "component")
    granted = "all real-time rights" if reply.realtime.granted else "not all real-time rights"
    yield ok(f"{count}, revision {reply.revision}, {granted}")


def describe_not_asked(node: str | None) -> Finding:
    """Executors that cannot be asked, as discovery does not work; an error where one is named."""
    report = warning if node is None else error
    return report(
        "not asked, as discovery does not work",
        cost="mauve and supervisors reach no executor",
        remedy="mend what the line `discovery` says",
    )


def describe_unreached(problem: str) -> Finding:
    """An executor that does not answer."""
    return error(
        problem,
        cost="mauve and supervisors do not reach this executor",
        remedy="start it, in the ROS_DOMAIN_ID of this shell; `mauve nodes` lists those that answer",
    )
