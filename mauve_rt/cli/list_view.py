"""What `mauve list` prints: what runs, which cores, what is connected; four tables that 80 columns hold."""

from collections.abc import Iterable, Iterator
from datetime import UTC, datetime
from typing import Any

from rich import box, filesize
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from mauve_rt.cli.views import console
from mauve_rt.control.state_age import in_words
from mauve_rt.counts import counted, duration
from mauve_rt.graph.components import ROS_SIDES, frames_text

# As mauve_msgs/msg/ComponentInfo.
STATES = {0: "UNCONFIGURED", 1: "STOPPED", 2: "RUNNING", 4: "STOPPING", 5: "FAULTED"}
# As mauve_msgs/msg/HeldElement; else it is a rule.
_HOLDERS = {
    "over": "a person, above the rules",
    "stop": "a person, who stopped it",
    "base": "no rule any longer",
    "none": "none of them, as every value was rejected",
}
_STYLES = {"RUNNING": "green", "FAULTED": "bold red", "STOPPED": "yellow"}
_WAIT_FREE_KINDS = ("shared_data", "latest_value", "ring_buffer")  # the other kinds have a lock, or know best


def print_components(reply: Any, out: Console | None = None) -> None:
    """A ListComponents reply: tables, authors of changes, faults, states that last, what real time lacks."""
    out = out or console()
    for table in (
        _components(reply),
        bounds_table(reply.components),
        _cores(reply),
        _connections(reply),
        _memory(reply),
    ):
        if table.row_count:
            out.print(table)
    for name, element, author in _authors(reply):
        out.print(f"[bold]{name}[/]: {escape(element)} by {escape(author)}", soft_wrap=True)
    print_held(reply, out)
    for component in reply.components:
        _print_remarks(component, out)
    for component in reply.components:
        if component.hung or component.state_age_ns > component.period_ns > 0:
            style = "bold red" if component.hung else "yellow"
            text = in_words(component)
            words = f"hung: {text}" if component.hung else text
            out.print(f"[{style}]{component.name}[/]: {escape(words)}", soft_wrap=True)
    for line in reply.warnings:
        out.print(f"[yellow]warning[/]: {escape(line)}", soft_wrap=True)
    for line in reply.realtime.missing:
        out.print(f"[yellow]no real time[/]: {escape(line)}", soft_wrap=True)
    if reply.access:
        out.print(f"may change it: {escape(reply.access)}", style="dim", soft_wrap=True)
    out.print(f"revision {reply.revision}", style="dim")


def print_held(reply: Any, out: Console) -> None:
    """Elements that rules or persons have their hand on: who wants what, and what it is without rules."""
    for held in reply.held:
        what = f"{held.element or 'presence'} held by {_HOLDERS.get(held.holder, held.holder)}"
        wanted, base = (text or "not known" for text in (held.wanted, held.base))
        out.print(
            f"[bold]{held.target}[/]: {escape(f'{what}: {wanted}; without rules: {base}')}", soft_wrap=True
        )


def _print_remarks(component: Any, out: Console) -> None:
    if enforced := ", ".join(state.name for state in component.states if state.wcet_enforced):
        out.print(f"[bold]{component.name}[/]: wcet_ns is enforced of {enforced}", soft_wrap=True)
    for one in component.slew_limits:
        text = f"{one.output} changes by at most {one.max_slew:g} per second: {slew_counts(one)}"
        out.print(f"[bold]{component.name}[/]: {escape(text)}", soft_wrap=True)
    if component.fault:
        out.print(f"[bold red]{component.name}[/]: {escape(component.fault)}", soft_wrap=True)
    for probation in component.probations:
        out.print(f"[bold]{component.name}[/]: {escape(probation_line(probation))}", soft_wrap=True)


def slew_counts(one: Any) -> str:
    """How often max_slew has acted on a number, in words."""
    text = f"{counted(one.limited, 'write')} limited"
    stops = f", {counted(one.not_limited, 'value')} of a stop written at once"
    return text + (stops if one.not_limited else "")


def _authors(reply: Any) -> Iterator[tuple[str, str, str]]:
    """(component or resource, element, author) of what was changed since the file."""
    for component in reply.components:
        for text in component.authors:
            element, _, author = text.partition("=")
            yield component.name, element, author
    for resource in reply.resources:
        if resource.author:
            yield resource.name, "resource", resource.author


def _components(reply: Any) -> Table:
    table = _table("component")
    for column in ("state", "period", "priority", "cpus", "releases", "overruns"):
        table.add_column(column, no_wrap=True)
    for component in reply.components:
        state = STATES.get(component.state, str(component.state))
        table.add_row(
            component.name,
            f"[{_STYLES.get(state, 'default')}]{state}[/]",
            duration(component.period_ns),
            str(component.priority) if component.policy == "SCHED_FIFO" else "-",
            ",".join(str(cpu) for cpu in component.cpus) or "any",
            str(component.releases),
            str(component.overruns),
        )
    return table


def bounds_table(components: Iterable[Any]) -> Table:
    """A line for each kind of job with a bound."""
    table = _table("component", "job")
    for column in ("longest", "bound", "above it"):
        table.add_column(column, no_wrap=True, justify="right")
    for component in components:
        for job in component.bounds:
            is_first = [job.after] == job.states[:1]  # after a start: it begins in its state
            if is_first and not job.jobs:
                continue
            violations = f"[bold red]{job.violations}[/]" if job.violations else "0"
            way = " -> ".join([*([] if is_first else [job.after]), *job.states, job.until])
            table.add_row(component.name, way, duration(job.longest_ns), duration(job.bound_ns), violations)
    return table


def _cores(reply: Any) -> Table:
    table = _table("component", "core, others it takes")
    table.add_column("generation", no_wrap=True)
    table.add_column("built", no_wrap=True)
    for component in reply.components:
        others = component.alternatives if component.reconfigurable else ["(protected)"]
        cores = "\n".join([component.core, *(f"[dim]{core}[/]" for core in others)])
        table.add_row(component.name, cores, str(component.generation or "-"), _built(component.built_ns))
    return table


def probation_line(probation: Any) -> str:
    """A core on probation, or the last verdict, in words."""
    verdict = {0: "on probation", 1: "passed its probation", 2: "reverted", 3: "probation inconclusive"}
    text = f"{probation.to_core} {verdict.get(probation.verdict, str(probation.verdict))}"
    text += f", {counted(probation.releases, 'release')}"
    if probation.reason:
        text += f": {probation.reason}"
    return f"{text} (before: {probation.from_core})"


def _built(built_ns: int) -> str:
    """When the code of a core was built: the time of today, else the date."""
    if built_ns == 0:
        return "-"
    built = datetime.fromtimestamp(built_ns / 1e9, tz=UTC).astimezone()
    is_of_today = built.date() == datetime.now(tz=UTC).astimezone().date()
    return built.strftime("%H:%M:%S" if is_of_today else "%Y-%m-%d %H:%M")


def _connections(reply: Any) -> Table:
    """A line for each port; then the resources that none has but ROS."""
    table = _table("port", "connected to", "on ROS")
    resources = {resource.name: resource for resource in reply.resources}
    locked = {
        f"{resource.name}.{name}"
        for resource in reply.resources
        if resource.kind in _WAIT_FREE_KINDS
        for name in ("read", "write")
        if name not in resource.wait_free
    }
    connected, shown = set(), set()
    for component in reply.components:
        for port in component.ports:
            service = f"{port.resource}.{port.service}" if port.resource else "[yellow]nothing[/]"
            if service in locked:
                service += " [dim](lock)[/]"
            if frames := frames_text(port):
                service += f"\n[dim]{escape(frames)}[/]"
            names = _ros_names(resources[port.resource], port) if port.resource in resources else []
            table.add_row(f"{component.name}.{port.name}", service, "\n".join(names))
            connected.add(port.resource)
            shown |= {(port.resource, name) for name in names}
    for name, resource in resources.items():
        left = [line for line in _ros_names(resource) if (name, line) not in shown]
        if left or name not in connected:
            table.add_row("[dim]-[/]", name, "\n".join(left))
    return table


def _memory(reply: Any) -> Table:
    table = _table("resource", "type")
    table.add_column("memory", no_wrap=True, justify="right")
    for resource in reply.resources:
        if resource.memory_bytes:
            table.add_row(resource.name, resource.type, filesize.decimal(resource.memory_bytes))
    return table


def _ros_names(resource: Any, port: Any = None) -> list[str]:
    """The lines for a resource's ROS names; with a port, those that the port has a part in."""
    others = (
        {} if port is None else {port.READ: "publishes", port.EVENT: "publishes", port.WRITE: "subscribes"}
    )
    not_its = others.get(port.kind) if port is not None else None
    names = [(side, getattr(resource, side)) for side in ROS_SIDES if side != not_its]
    names += [("mirrors", topic) for topic in resource.mirrors]
    lines = [f"[dim]{side}[/] {name}" for side, name in names if name]
    if frames := frames_text(resource):
        lines.append(f"[dim]{escape(frames)}[/]")
    return lines


def _table(*folding: str) -> Table:
    """These columns keep all they say, on several lines if need be."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for column in folding:
        table.add_column(column, overflow="fold")
    return table
