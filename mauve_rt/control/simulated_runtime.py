"""An architecture at work in virtual time: a simulation in the place of threads. Knows no ROS."""

from collections.abc import Callable

from mauve_rt._kernel import Architecture, Host, Simulation
from mauve_rt.control.runtime import Runtime
from mauve_rt.model import ArchitectureModel

__all__ = ["SIMULATED", "SimulatedRuntime"]

SIMULATED = "simulated time: nothing ran in real time"


class SimulatedRuntime(Runtime):
    """A runtime whose architecture joins the simulation when it is configured."""

    def __init__(self, simulation: Simulation, load: Callable[[], ArchitectureModel]) -> None:
        super().__init__(load)
        self.instance_id = "simulated"  # the same every time, as all of it
        self._simulation = simulation

    def _make_host(self, architecture: Architecture, *, require_realtime: bool) -> Host:
        del require_realtime  # there is none to be had
        return self._simulation.add(architecture)
