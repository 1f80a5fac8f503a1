"""What an architecture most likely was not meant to be, though it can run: the warnings of `mauve check`.

Each claim is true of the files that are checked together. What is common and meant has no remark.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

from mauve_rt._kernel import Architecture, ComponentDescription, ResourceDescription
from mauve_rt.analysis.demand import utilization_of
from mauve_rt.analysis.digraph import DigraphTask, Job, digraph_of
from mauve_rt.analysis.machines import FOREVER_NS, Machine, in_ms
from mauve_rt.errors import Problem
from mauve_rt.file_schema.words import listed
from mauve_rt.model.architecture_file import ArchitectureModel
from mauve_rt.model.build import previewed_states
from mauve_rt.model.qos_remarks import file_warnings
from mauve_rt.model.resource_kinds import given_kinds
from mauve_rt.model.step_kinds import STEP_KINDS
from mauve_rt.model.steps import Step

_ELSEWHERE = ""
"""A reader or writer that is no component and no topic."""


@dataclass
class Uses:
    """What the rules and steps files that are checked with an architecture do with it."""

    has_rules: bool = False
    steps: list[Step] = field(default_factory=list)
    resources: set[str] = field(default_factory=set)
    """That conditions name."""

    def plugins(self, component: str) -> set[str]:
        """Parts that steps put into a component."""
        parts = ("core", "fsm", "shell")
        return {
            step.name
            for step in self.steps
            if step.target == component and STEP_KINDS[step.kind].name in parts
        }

    def changed(self) -> set[str]:
        """Components that steps start, stop, connect or remove."""
        kinds = {name for name, kind in STEP_KINDS.items() if kind.leaves or kind.is_structural}
        return {step.target for step in self.steps if step.kind in kinds}

    def connected(self) -> set[str]:
        """Resources to which steps connect a port."""
        return {step.value.partition(".")[0] for step in self.steps if step.kind == "connect"}


class Subject:
    """An architecture as the checks take it.

    `architecture` was built from `model` and is configured. `uses` may be filled until remarks() is called.
    """

    def __init__(self, model: ArchitectureModel, architecture: Architecture, uses: Uses) -> None:
        self.model, self.uses = model, uses
        self.components: Sequence[ComponentDescription] = architecture.components()
        self.resources: Mapping[str, ResourceDescription] = {
            each.name: each for each in architecture.resources() if each.kind in given_kinds()
        }
        self._states = previewed_states(model, architecture)

    @cached_property
    def tasks(self) -> dict[str, DigraphTask]:
        """The jobs of the components that are released by time alone."""
        periodic = [each for each in self.components if each.period_ns]
        return {each.name: digraph_of(Machine.of(each, states=self._states[each.name])) for each in periodic}

    @cached_property
    def readers(self) -> Mapping[str, list[str]]:
        """Of each resource with values: components that read it, and what else has its values."""
        ports = {f"{link.component}.{link.port}": link.resource for link in self.model.connections}
        seen = [*self.model.recorded, *(mirror.name for mirror in self.model.mirrors)]
        shown = {ports.get(name, name) for name in seen} | self.uses.resources
        found = self._users("read", "publish")
        return {name: [*users, *([_ELSEWHERE] if name in shown else [])] for name, users in found.items()}

    @cached_property
    def writers(self) -> Mapping[str, list[str]]:
        """Of each resource with values: components that write it, and what else gives it values."""
        return self._users("write", "subscribe")

    def _users(self, kind: str, direction: str) -> dict[str, list[str]]:
        found: dict[str, list[str]] = {}
        for name, described in self.resources.items():
            services = {each.name: each.kind for each in described.services}
            if not {"read", "write"} <= set(services.values()):
                continue
            resource = self.model.resources[name]
            links = [link for link in self.model.connections if link.resource == name]
            users = [link.component for link in links if services[link.service] == kind]
            if resource.topic is not None and resource.topic.direction == direction:
                users.append(f"topic {resource.topic.name}")
            if resource.service is not None or resource.action is not None or name in self.uses.connected():
                users.append(_ELSEWHERE)
            found[name] = users
        return found

    def on_one_cpu(self) -> Iterator[tuple[int, list[ComponentDescription]]]:
        """Components that share a CPU and can run on no other one."""
        for cpu in sorted({each.cpus[0] for each in self.components if len(each.cpus) == 1}):
            yield cpu, [each for each in self.components if each.cpus == [cpu]]


def _qos(subject: Subject) -> Iterator[Problem]:
    return file_warnings(subject.model)


def _optional_ports(subject: Subject) -> Iterator[Problem]:
    """Without a connection, though a resource of their name fits, of a component that has connections."""
    for component in subject.components:
        if component.name in subject.uses.changed() or not any(port.resource for port in component.ports):
            continue
        free = [port for port in component.ports if not port.resource and port.name in subject.resources]
        for port in free:
            for service in subject.resources[port.name].services:
                if (service.kind, service.type) == (port.kind, port.type):
                    own = f"{component.name}.{port.name}"
                    what = f"optional port '{own}' is not connected, and resource '{port.name}' fits it"
                    remedy = f"add [{own}, {port.name}.{service.name}] to connections"
                    yield subject.model.key_problem(("components", component.name), what, remedy=remedy)


def _unused_resources(subject: Subject) -> Iterator[Problem]:
    """Values that have no reader, or no writer."""
    for name, readers in subject.readers.items():
        place, writers = ("resources", name), subject.writers[name]
        if not readers and not writers:
            what = f"resource '{name}' is not used: no port is connected to it"
            yield subject.model.key_problem(place, what, remedy="connect a writer and a reader, or remove it")
        elif not readers and len(subject.components) > 1:  # else `mauve echo` reads it
            what = f"resource '{name}' is written, and no component, topic, mirror or recording reads it"
            yield subject.model.key_problem(place, what, remedy="connect a reader, or remove it")
        elif not writers:
            what = f"resource '{name}' is read, and no component or topic writes it"
            yield subject.model.key_problem(place, what, remedy="connect a writer, or bind it to a topic")


def _two_writers(subject: Subject) -> Iterator[Problem]:
    """Of a resource that holds the last value only."""
    for name, writers in subject.writers.items():
        several = list(dict.fromkeys(writers))
        if subject.resources[name].kind != "shared_data" or len(several) == 1 or not several:
            continue
        if _ELSEWHERE in several or subject.uses.changed() & {*several}:
            continue
        names = listed(several, last="and")
        what = f"resource '{name}' has {len(several)} writers, {names}: the last one counts"
        remedy = "connect one of them, or let a ring_buffer keep the values of each"
        yield subject.model.key_problem(("resources", name), what, remedy=remedy)


def _long_jobs(subject: Subject) -> Iterator[Problem]:
    """Declared to take longer than to the next instant."""
    for name, task in subject.tasks.items():
        for job in _jobs_beyond(task):
            states = listed(job.states, last="and")
            what = (
                f"component '{name}' declares {in_ms(job.cost_ns or 0)} for {states}, "
                f"and has {in_ms(job.deadline_ns)} from release to {job.until}"
            )
            place = ("components", name, "states", job.states[0], "wcet_ns")
            remedy = f"shorten {states}, lengthen the wait, or correct the declared times"
            yield subject.model.key_problem(place, what, remedy=remedy)


def _jobs_beyond(task: DigraphTask) -> list[Job]:
    """The worst one, where there are any."""
    known = [job for job in task.jobs if job.cost_ns is not None and job.separation_ns != FOREVER_NS]
    beyond = [job for job in known if (job.cost_ns or 0) > max(job.deadline_ns, job.separation_ns)]
    return [max(beyond, key=lambda job: job.cost_ns or 0)] if beyond else []


def _full_cpus(subject: Subject) -> Iterator[Problem]:
    """Declared executions that together are more than a CPU has."""
    for cpu, components in subject.on_one_cpu():
        tasks = [subject.tasks[each.name] for each in components if each.name in subject.tasks]
        known = [each for each in tasks if each.largest_cost_ns is not None and not _jobs_beyond(each)]
        shares = {task.name: float(utilization_of(task)) for task in known}
        if sum(shares.values()) > 1:
            parts = listed((f"{name} {share:.0%}" for name, share in shares.items()), last="and")
            whole = f"{sum(shares.values()):.0%}"
            what = f"the components on CPU {cpu} declare up to {whole} of its time: {parts}"
            lowest = min((each for each in components if each.name in shares), key=lambda each: each.priority)
            place = ("components", lowest.name, "cpus")
            yield subject.model.key_problem(place, what, remedy="move one to another CPU, or shorten states")


def _inverse_priorities(subject: Subject) -> Iterator[Problem]:
    """A longer period with a higher priority, on one CPU; a declared deadline takes the period's place."""
    for cpu, components in subject.on_one_cpu():
        times = {each.name: each.deadline_ns or each.period_ns for each in components}
        for fast in components:
            slower = [each for each in components if times[each.name] > times[fast.name] > 0]
            inverse = [each for each in slower if each.priority > fast.priority]
            if inverse:
                slow = max(inverse, key=lambda each: times[each.name])
                what = (
                    f"component '{fast.name}' ({in_ms(times[fast.name])}, priority {fast.priority}) waits on "
                    f"CPU {cpu} for '{slow.name}' ({in_ms(times[slow.name])}, priority {slow.priority})"
                )
                remedy = f"give the shorter period the higher priority, or '{slow.name}' a deadline_ns"
                yield subject.model.key_problem(("components", fast.name, "priority"), what, remedy=remedy)


def _unused_alternatives(subject: Subject) -> Iterator[Problem]:
    """That no rule puts in."""
    if not subject.uses.has_rules:
        return
    for name, component in subject.model.components.items():
        used = {component.shell, component.core, component.fsm, component.fallback}
        used |= subject.uses.plugins(name)
        parts = component.alternatives if isinstance(component.alternatives, list) else []
        for index, part in enumerate(parts):
            if part not in used:
                what = f"no rule or step of these files puts alternative {part} into component '{name}'"
                place = ("components", name, "alternatives", index)
                yield subject.model.problem(place, what, remedy="remove it, or add the rule")


CHECKS: Sequence[Callable[[Subject], Iterator[Problem]]] = (
    _qos,
    _optional_ports,
    _unused_resources,
    _two_writers,
    _long_jobs,
    _full_cpus,
    _inverse_priorities,
    _unused_alternatives,
)
"""Each yields its warnings, at their places in the file."""


def remarks(subject: Subject) -> Iterator[Problem]:
    """What the checks found."""
    for check in CHECKS:
        yield from check(subject)
