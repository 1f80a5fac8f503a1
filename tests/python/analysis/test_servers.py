"""The demand of sporadic tasks and servers: computed by hand, and held against runs in virtual time."""

from collections.abc import Callable
from itertools import groupby
from pathlib import Path
from random import Random

import pytest
from rclpy.serialization import serialize_message
from schedule_simulation import RUN, Release, simulate
from std_msgs.msg import Float64

from mauve_rt._kernel import PluginRegistry, Simulation
from mauve_rt.analysis.demand import Demand, utilization_of
from mauve_rt.analysis.digraph import DigraphTask, Job, digraph_of
from mauve_rt.analysis.digraph_times import Component, digraph_times
from mauve_rt.analysis.machines import Machine
from mauve_rt.model import build, load_architecture, previewed_states
from mauve_rt.model.plugins import PluginIndex, PluginLoader
from mauve_rt.parts.cores import Core, core_factory

MS = 1_000_000
PERIOD_MS, BUDGET = 10, 3
KINDS = ["Sporadic", "PollingServer", "DeferrableServer"]
ROBOT = """\
mauve: 1
components:
  server:
    shell: mauve_rt/Float64ServerShell
    core: test/Serve
    fsm: mauve_rt/Float64{kind}Fsm
    cpus: [0]
    priority: 50
    properties: {{period_us: 10000, budget: 3, polls: 10, wcet_us: 1000}}
resources:
  requests: {{kind: ring_buffer, type: std_msgs/msg/Float64, capacity: 1000}}
connections:
  - [server.requests, requests.read]
"""


class Server:
    """A server with a period of 10 ms and a budget of 3 requests of 1 ms each."""

    def __init__(self, folder: Path, kind: str) -> None:
        self.served: list[tuple[int, float]] = []
        """Instant after the epoch, and the number of the request."""
        server = self

        class Serve(Core):
            def take_request(self) -> bool:
                self.request = self.shell.requests.read()
                return bool(self.request.is_new)

            def serve(self) -> None:
                simulation = server.simulation
                server.served.append((simulation.now_ns() - simulation.epoch_ns(), self.request.value.data))

        file = folder / "robot.yaml"
        file.write_text(ROBOT.format(kind=kind), encoding="utf-8")
        registry = PluginRegistry()
        PluginLoader(registry, PluginIndex.installed()).require("shell", "mauve_rt/Float64ServerShell")
        registry.add_python_core("test/Serve", "mauve_rt/Float64ServerShell", core_factory(Serve))
        model = load_architecture(file)
        architecture = build(model, registry)
        (part,) = architecture.components()
        states = previewed_states(model, architecture)["server"]
        self.task = digraph_of(Machine.of(part, states=states, is_python=False))
        architecture.configure()
        self.simulation = Simulation()
        self.host = self.simulation.add(architecture)
        self.simulation.deploy()

    def run(self, requests_ns: list[int], until_ns: int) -> None:
        """Requests at these instants after the epoch, numbered from 0."""
        epoch_ns = self.simulation.epoch_ns()
        for number, at_ns in enumerate(sorted(requests_ns)):
            message = serialize_message(Float64(data=float(number)))
            self.simulation.at(
                epoch_ns + at_ns, lambda message=message: self.host.write_resource("requests", message)
            )
        self.simulation.run_until(epoch_ns + until_ns)

    def releases(self) -> list[Release]:
        """What it executed: all requests of an instant are one job."""
        jobs = [(at_ns, len([*group])) for at_ns, group in groupby(at_ns for at_ns, _ in self.served)]
        return [Release(at_ns, at_ns, [(RUN, count * MS)]) for at_ns, count in jobs]


@pytest.fixture
def server(tmp_path: Path) -> Callable[[str], Server]:
    return lambda kind: Server(tmp_path, kind)


def sporadic_ms(within_ms: int) -> int:
    return 1 + within_ms // PERIOD_MS


def polling_ms(within_ms: int) -> int:
    return BUDGET * (1 + within_ms // PERIOD_MS)


def deferrable_ms(within_ms: int) -> int:
    """Whole budgets from the start of a period on, or before them what is left for the last of 10 polls."""
    if within_ms < 1:
        return BUDGET
    return max(polling_ms(within_ms), BUDGET - 1 + polling_ms(within_ms - 1))


@pytest.mark.parametrize(
    ("kind", "expected_ms", "share"),
    [
        ("Sporadic", sporadic_ms, 0.1),
        ("PollingServer", polling_ms, 0.3),
        ("DeferrableServer", deferrable_ms, 0.3),
    ],
)
def test_the_demand_of_a_server_is_the_one_computed_by_hand(
    server: Callable[[str], Server], kind: str, expected_ms: Callable[[int], int], share: float
) -> None:
    task = server(kind).task
    demand = Demand(task)
    found_ms = [demand.until_ns(within_ms * MS) / MS for within_ms in range(61)]
    # A release without a request counts as an execution of 1 ns.
    assert found_ms == pytest.approx([expected_ms(within_ms) for within_ms in range(61)], abs=1e-3)
    assert demand.until_ns(10 * MS - 1) < demand.until_ns(10 * MS)
    assert float(utilization_of(task)) == pytest.approx(share, abs=1e-4)


def test_the_back_to_back_hit_of_a_deferrable_server_is_in_its_demand(
    server: Callable[[str], Server],
) -> None:
    demands_ms = [Demand(server(kind).task).until_ns(1 * MS) / MS for kind in KINDS]
    assert demands_ms == pytest.approx([1, 3, 2 + 3], abs=1e-3)


def patterns(random: Random, until_ns: int) -> list[int]:
    """Instants of requests: single ones, and bursts."""
    found: list[int] = []
    at_ns = 0
    while (at_ns := at_ns + random.randint(0, random.choice((2, 8, 30)) * MS)) < until_ns:
        found += [at_ns] * random.choice((1, 1, 2, 3, 7))
    return found


@pytest.mark.parametrize("kind", KINDS)
def test_no_run_of_a_server_exceeds_its_demand_or_delays_others_beyond_their_bound(
    tmp_path: Path, kind: str
) -> None:
    for seed in range(6):
        random = Random(seed)  # noqa: S311 - not for secrets
        server = Server(tmp_path, kind)
        requests = patterns(random, 400 * MS)
        server.run(requests, 3000 * MS)
        numbers = [number for _, number in server.served]
        assert numbers == [*range(len(requests))], "none is lost, in their order"
        demand = Demand(server.task)
        instants = [at_ns for at_ns, _ in server.served]
        for first, from_ns in enumerate(instants):
            for last, to_ns in enumerate(instants[first : first + 40], start=first):
                assert (last - first + 1) * MS <= demand.until_ns(to_ns - from_ns), (seed, from_ns, to_ns)
        assert longest_below(server, offset_ns=random.choice(instants)) <= bound_below(server), seed


LOW_MS, LOW_PERIOD_MS = 4, 25
LOW = DigraphTask("low", (Job("W", (), LOW_MS * MS, "W", LOW_PERIOD_MS * MS, 10**9),))


def with_low(server: Server) -> list[Component]:
    """The server, and a component of lower priority."""
    return [Component(server.task, 50), Component(LOW, 40)]


def longest_below(server: Server, offset_ns: int) -> int:
    """The longest response of the component of lower priority, in the run of the server."""
    end_ns = max(at_ns for at_ns, _ in server.served)
    low = range(offset_ns % (LOW_PERIOD_MS * MS), end_ns + 1, LOW_PERIOD_MS * MS)
    runs = {"server": server.releases(), "low": [Release(at, at, [(RUN, LOW_MS * MS)]) for at in low]}
    return simulate(with_low(server), runs)["low"]


def bound_below(server: Server) -> int:
    bound_ns = digraph_times(with_low(server))["low"].response_ns
    assert bound_ns is not None
    return bound_ns


@pytest.mark.parametrize(
    ("kind", "requests_ms", "worst_ms"),
    [
        ("Sporadic", [100], 100),
        ("PollingServer", [98, 98, 98], 100),
        # One begins a period at 100 ms; two are served at its last poll, and three where the next one begins.
        ("DeferrableServer", [100, *[109] * 5], 109),
    ],
)
def test_the_worst_requests_reach_the_bound(
    server: Callable[[str], Server], kind: str, requests_ms: list[int], worst_ms: int
) -> None:
    one = server(kind)
    one.run([at_ms * MS for at_ms in requests_ms], 200 * MS)
    longest_ns = longest_below(one, worst_ms * MS)
    assert 0 <= bound_below(one) - longest_ns < 100, "a release without a request counts as 1 ns"
