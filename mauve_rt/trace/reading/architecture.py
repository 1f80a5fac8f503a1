"""The architecture that a bag tells of: components, their places in time, what their ports connect to."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, Self

_PORT_KINDS = {1: "read", 2: "write", 3: "call", 4: "event"}  # mauve_msgs/msg/PortInfo


@dataclass(frozen=True)
class PortInfo:
    """A port of a component's shell."""

    name: str
    kind: str
    """read, write, call or event"""
    type: str
    """Identity of the port's type, e.g. geometry_msgs/msg/Point."""
    resource: str
    """What it is connected to; empty when it is not."""
    service: str
    longest_hold_ns: int = 0
    """For how long one user holds the resource's lock; 0: not declared, or an earlier version's bag."""
    wait_free: bool = False
    """It took no lock, as ports were connected then; False: or an earlier version's bag."""


@dataclass(frozen=True)
class ComponentInfo:
    """A component as it was deployed."""

    name: str
    shell: str
    core: str
    fsm: str
    period_ns: int
    """g; 0 of one that waits for events."""
    offset_ns: int
    policy: str
    """Scheduling policy read back from the thread."""
    priority: int
    cpus: tuple[int, ...]
    ports: tuple[PortInfo, ...]
    deadline_ns: int = 0
    """Declared, from a release to the next wait; 0: the next instant."""
    overrun: str = ""
    states: tuple[Any, ...] = ()
    """Of the fsm, with the fields of mauve_msgs/msg/StateInfo; none in a bag of an earlier version."""

    @classmethod
    def of_message(cls, message: Any) -> Self:
        """Take it from a mauve_msgs/msg/ComponentInfo, of whichever library."""
        ports = tuple(
            PortInfo(
                port.name,
                _PORT_KINDS.get(int(port.kind), "unknown"),
                port.type,
                port.resource,
                port.service,
                int(getattr(port, "longest_hold_ns", 0)),
                bool(getattr(port, "wait_free", False)),
            )
            for port in message.ports
        )
        return cls(
            name=message.name,
            shell=message.shell,
            core=message.core,
            fsm=message.fsm,
            period_ns=int(message.period_ns),
            offset_ns=int(message.offset_ns),
            policy=message.policy,
            priority=int(message.priority),
            cpus=tuple(int(cpu) for cpu in message.cpus),
            ports=ports,
            deadline_ns=int(getattr(message, "deadline_ns", 0)),
            overrun=getattr(message, "overrun", ""),
            states=tuple(getattr(message, "states", ())),
        )

    def prefixed(self, prefix: str) -> Self:
        """Return the same with its name and its resources' below a prefix."""
        ports = tuple(
            replace(port, resource=f"{prefix}/{port.resource}" if port.resource else "")
            for port in self.ports
        )
        return replace(self, name=f"{prefix}/{self.name}", ports=ports)


def with_known_policies(
    told: Iterable[ComponentInfo], before: Iterable[ComponentInfo]
) -> tuple[ComponentInfo, ...]:
    """Return what is told, with the policies told before where a thread has ended and has none to tell."""
    known = {component.name: component.policy for component in before}
    return tuple(
        component if component.policy else replace(component, policy=known.get(component.name, ""))
        for component in told
    )
