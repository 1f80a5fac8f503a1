"""The architecture as a graph: components and resources, joined by connections."""

import networkx as nx

from mauve_rt.model.architecture_file import ArchitectureModel


def architecture_graph(model: ArchitectureModel) -> "nx.MultiDiGraph[str]":
    """Nodes are components and resources (attribute `kind`), edges connections in the direction of the data.

    An edge has the attributes `component`, `port`, `resource` and `service`. A service whose name starts with
    `read` or `get` gives data to the component, every other one takes it.
    """
    graph: nx.MultiDiGraph[str] = nx.MultiDiGraph()
    for name in model.components:
        graph.add_node(name, kind="component")
    for name in model.resources:
        graph.add_node(name, kind="resource")
    for link in model.connections:
        ends = (link.component, link.resource)
        start, end = reversed(ends) if link.service.startswith(("read", "get")) else ends
        facts = {
            "component": link.component,
            "port": link.port,
            "resource": link.resource,
            "service": link.service,
        }
        graph.add_edge(start, end, **facts)
    return graph
