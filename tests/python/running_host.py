"""An architecture on either host, on threads or in virtual time, for the tests that run on both."""

import time
from collections.abc import Callable

from python_parts import TIMEOUT_NS, Stage

from mauve_rt.api import Deployer, Host, Simulation


class Running:
    """An architecture on one of the hosts."""

    def __init__(self, stage: Stage, *, simulated: bool) -> None:
        self.stage = stage
        self.simulated = simulated
        self.architecture = stage.architecture
        self._simulation = Simulation() if simulated else None
        self._host: Host | None = None

    @property
    def host(self) -> Host:
        if self._host is None:
            simulation, architecture = self._simulation, self.architecture
            self._host = Deployer(architecture) if simulation is None else simulation.add(architecture)
        return self._host

    def deploy(self) -> None:
        self.architecture.configure()
        self.host.deploy()

    def run_for(self, duration_ns: int) -> None:
        until = max(self.host.epoch_ns, self.host.now_ns()) + duration_ns
        if self._simulation is not None:
            self._simulation.run_until(until)
            return
        while self.host.now_ns() < until:
            time.sleep(1e-3)

    def run_until(self, condition: Callable[[], object]) -> None:
        """Runs the components until the condition holds."""
        end_ns = max(self.host.epoch_ns, self.host.now_ns()) + TIMEOUT_NS
        while not condition():
            assert self.host.now_ns() < end_ns, f"waited in vain; {self.host.describe()}"
            self.run_for(1_000_000)

    def state(self, name: str) -> str:
        return self.architecture.component(name).state

    def releases(self, name: str) -> int:
        return self.architecture.component(name).describe().releases
