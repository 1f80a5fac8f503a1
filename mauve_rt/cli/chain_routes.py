"""The routes of `--chain FROM:TO`: from a component, port, resource or topic to another one."""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import islice, pairwise
from typing import Any

import networkx as nx

from mauve_rt.analysis.chains import Channel, Route
from mauve_rt.errors import ParameterError
from mauve_rt.file_schema.words import did_you_mean
from mauve_rt.graph.components import takes_values

_MOST_ROUTES = 1_000
_COMPONENT, _RESOURCE = "component", "resource"
_Node = tuple[str, str]


@dataclass(frozen=True)
class Port:
    """A connected port."""

    component: str
    name: str
    resource: str
    takes: bool
    """Whether the component gets values through it, not the resource."""

    @property
    def edge(self) -> tuple[_Node, _Node]:
        """Along the data."""
        ends = (_RESOURCE, self.resource), (_COMPONENT, self.component)
        return ends if self.takes else (ends[1], ends[0])


@dataclass(frozen=True)
class Wiring:
    """Who reads and writes which resource."""

    components: tuple[str, ...]
    ports: tuple[Port, ...]
    channels: Mapping[str, Channel]

    @classmethod
    def of(cls, components: Iterable[Any], channels: Iterable[Channel] = ()) -> "Wiring":
        """Of descriptions with the fields of mauve_msgs/msg/ComponentInfo, and what is known of resources."""
        described = list(components)
        ports = [
            Port(one.name, port.name, port.resource, takes_values(port))
            for one in described
            for port in one.ports
            if port.resource
        ]
        known = {channel.name: channel for channel in channels}
        users: dict[bool, dict[str, list[str]]] = {True: defaultdict(list), False: defaultdict(list)}
        for port in ports:
            if port.component not in users[port.takes][port.resource]:
                users[port.takes][port.resource].append(port.component)
        found = {}
        for name in dict.fromkeys([*known, *(port.resource for port in ports)]):
            one = known.get(name, Channel(name))
            writers, readers = (*users[False][name], *one.writers), tuple(users[True][name])
            found[name] = Channel(
                name, one.kind, one.capacity, one.overwrites, writers, readers, topics=one.topics
            )
        return cls(tuple(one.name for one in described), tuple(ports), found)

    def routes(self, chain: str) -> list[Route]:
        """Each way without a loop from the first name to the last; of more than two, each is the next step.

        Raises:
            ParameterError: a name is unknown, or there is no way, or there are too many.
        """
        names = chain.split(":")
        if len(names) < len(("from", "to")) or not all(names):
            raise ParameterError(
                f"--chain: expected FROM:TO as scan:command, or each step of one route as "
                f"scan:control:command, found {chain}"
            )
        steps = [self._nodes(chain, name) for name in names]
        begins, finishes = steps[0], steps[-1]
        if begins & finishes:
            both = ", ".join(f"{kind} {name}" for kind, name in sorted(begins & finishes))
            raise ParameterError(
                f"--chain {chain}: expected two ends, found {both} as both; name another end"
            )
        graph: nx.DiGraph[_Node] = nx.DiGraph()
        graph.add_nodes_from(begins | finishes)
        graph.add_edges_from(port.edge for port in self.ports)
        is_direct = len(steps) > len(("from", "to"))
        ways = (
            way
            for begin in sorted(begins)
            for finish in sorted(finishes)
            for way in nx.all_simple_paths(graph, begin, finish, 2 * len(steps) if is_direct else None)
            if not is_direct or _follows(way, steps)
        )
        routes = list(islice(self._through_ports(names, ways), _MOST_ROUTES + 1))
        if not routes:
            back = any(nx.has_path(graph, finish, begin) for begin in begins for finish in finishes)
            remedy = (
                f"the data goes the other way: write {':'.join(reversed(names))}"
                if back
                else "see mauve graph"
            )
            direct = " by these steps" if is_direct else ""
            raise ParameterError(
                f"--chain {chain}: no data goes from {names[0]} to {names[-1]}{direct}; {remedy}"
            )
        if len(routes) > _MOST_ROUTES:
            raise ParameterError(
                f"--chain {chain}: more than {_MOST_ROUTES:,} routes; name each step of one route"
            )
        return routes

    def _nodes(self, chain: str, name: str) -> set[_Node]:
        found = {(_COMPONENT, port.component) for port in self.ports if _named(port) == name}
        found |= {(_COMPONENT, one) for one in self.components if one == name}
        found |= {(_RESOURCE, one) for one in self.channels if one == name}
        found |= {(_RESOURCE, one.name) for one in self.channels.values() if name in one.topics}
        if not found:
            known = [*self.components, *self.channels, *map(_named, self.ports)]
            known += [topic for one in self.channels.values() for topic in one.topics]
            raise ParameterError(
                f"--chain {chain}: expected a component, a port, a resource or a topic, found {name}; "
                f"{did_you_mean(name, known)}"
            )
        return found

    def _through_ports(self, names: list[str], ways: Iterable[list[_Node]]) -> Iterator[Route]:
        """Of these ways those that go through the ports that are named; at an end a port may lead outside."""
        named = [{port.edge for port in self.ports if _named(port) == name} for name in names]
        for way in ways:
            edges = {*pairwise(way)}
            before = sorted(edge for edge in named[0] if edge[1] == way[0])
            behind = sorted(edge for edge in named[-1] if edge[0] == way[-1])
            edges |= {*before, *behind}
            if any(ports and not ports & edges for ports in named):
                continue
            if route := _route([*(edge[0] for edge in before), *way, *(edge[1] for edge in behind)]):
                yield route


def _follows(way: list[_Node], steps: list[set[_Node]]) -> bool:
    """Whether each step is the next node, or the next but one."""
    at = 0
    for step in steps[1:]:
        at += 1 if at + 1 < len(way) and way[at + 1] in step else 2
        if at >= len(way) or way[at] not in step:
            return False
    return at == len(way) - 1


def _route(way: list[_Node]) -> Route | None:
    """None: no component is on it."""
    members = tuple(name for kind, name in way if kind == _COMPONENT)
    channels = [name for kind, name in way if kind == _RESOURCE]
    if way[0][0] == _COMPONENT:
        channels.insert(0, "")
    if way[-1][0] == _COMPONENT:
        channels.append("")
    return Route(members, tuple(channels)) if members else None


def _named(port: Port) -> str:
    return f"{port.component}.{port.name}"
