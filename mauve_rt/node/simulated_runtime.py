"""An architecture at work in virtual time: a simulation in the place of threads. Knows no ROS."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import cast

from mauve_rt._kernel import (
    Architecture,
    Deployer,
    Simulation,
    TraceDrain,
    Transaction,
    TransactionReport,
)
from mauve_rt.model import ArchitectureModel
from mauve_rt.node.executor_runtime import Runtime

__all__ = ["NoRealtime", "SimulatedDeployer", "SimulatedRuntime"]

SIMULATED = "simulated time: nothing ran in real time"


@dataclass(frozen=True)
class NoRealtime:
    """As `mauve_rt._kernel.RealtimeStatus`, of a simulation."""

    granted: bool = False
    missing: tuple[str, ...] = (SIMULATED,)


@dataclass(frozen=True)
class _Committed:
    """As `mauve_rt._kernel.Committed`."""

    measured: TransactionReport

    def report(self, _phase_timeout_ns: int = 0) -> TransactionReport:
        """As Committed.report: all of it is known."""
        return self.measured


class SimulatedDeployer:
    """One architecture of a simulation, with the calls of a Deployer. Its timeouts pass in no time."""

    def __init__(self, simulation: Simulation, architecture: Architecture) -> None:
        self._simulation = simulation
        self._architecture = architecture

    def prepare_process(self) -> None:
        """Join the simulation; there are no rights to ask for."""
        self._simulation.add(self._architecture)

    def deploy(self) -> None:
        """Start, with the others: the simulation has one epoch for all."""
        if self._simulation.epoch_ns() == 0:
            self._simulation.deploy()

    def shutdown(self) -> None:
        """Stop every component, the last one first."""
        for part in reversed(self._architecture.components()):
            if part.state == "RUNNING":
                self._simulation.stop(self._architecture, part.name)

    def stop(self, component: str, _timeout_ns: int = 0) -> None:
        """As Deployer.stop."""
        self._simulation.stop(self._architecture, component)

    def start(self, component: str, clock_ns: int | None = None) -> None:
        """As Deployer.start."""
        self._simulation.start(self._architecture, component, clock_ns)

    def make(
        self,
        transaction: Transaction,
        *,
        dry_run: bool = False,
        expected_revision: int = 0,
        **_timeouts_ns: int,
    ) -> "_Committed":
        """As Deployer.make; the phases of the next releases are not measured, they are yet to come."""
        return _Committed(
            self._simulation.commit(
                self._architecture, transaction, dry_run=dry_run, expected_revision=expected_revision
            )
        )

    def realtime_status(self) -> NoRealtime:
        """As Deployer.realtime_status."""
        return NoRealtime()

    @property
    def epoch_ns(self) -> int:
        """As Deployer.epoch_ns."""
        return self._simulation.epoch_ns()

    def collect_trace(self, period_ns: int) -> None:
        """Do nothing: who drives the simulation drains in time."""

    def drain_trace(self) -> TraceDrain:
        """As Deployer.drain_trace."""
        return self._simulation.drain_trace(self._architecture)

    def trace_components(self) -> list[str]:
        """As Deployer.trace_components."""
        return self._simulation.trace_components(self._architecture)

    def trace_names(self) -> list[str]:
        """As Deployer.trace_names."""
        return self._simulation.trace_names()

    def take_published(self) -> list[tuple[str, bytes, int]]:
        """As Deployer.wait_published, without the waiting."""
        return self._simulation.take_published(self._architecture)

    def write_resource(self, resource: str, data: bytes) -> bool:
        """As Deployer.write_resource."""
        return self._simulation.write_resource(self._architecture, resource, data)


class SimulatedRuntime(Runtime):
    """A runtime whose architecture joins the simulation when it is configured."""

    def __init__(self, simulation: Simulation, load: Callable[[], ArchitectureModel]) -> None:
        super().__init__(load)
        self.instance_id = "simulated"  # the same every time, as all of it
        self._simulation = simulation

    @property
    def simulated(self) -> SimulatedDeployer:
        """The deployer, as what it is."""
        return cast("SimulatedDeployer", self.deployer)

    def _make_deployer(self, architecture: Architecture, *, require_realtime: bool) -> Deployer:
        del require_realtime  # there is none to be had
        made: object = SimulatedDeployer(self._simulation, architecture)
        return cast("Deployer", made)  # of which Runtime and Control use no more than that has
