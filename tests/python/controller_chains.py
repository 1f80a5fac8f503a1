"""A chain of controllers that note what they do, for the tests of what others reported of such chains."""

from typing import Any, ClassVar, NamedTuple

from python_parts import Stage
from rclpy.serialization import deserialize_message
from running_host import Running
from std_msgs.msg import Float64

from mauve_rt.api import Core, SharedData, Shell, read_port, write_port

MS = 1_000_000
PERIOD_NS = 2 * MS  # of ActFsm


class Execution(NamedTuple):
    """What a core did at an instant."""

    core: str
    clock_ns: int
    value: float


class Noted(Core[Any]):
    """A core that notes what it does."""

    log: ClassVar[list[Execution]] = []

    def note(self, value: float) -> None:
        self.log.append(Execution(type(self).__name__, self.shell.clock_ns, value))

    def act(self) -> None:
        self.note(0.0)


class PlannerShell(Shell):
    reference = write_port(Float64)  # zero when the component is stopped or has a fault


class ControllerShell(Shell):
    reference = read_port(Float64)
    command = write_port(Float64)


class Planner(Noted):
    value = 5.0

    def act(self) -> None:
        self.shell.reference.write(Float64(data=self.value))
        self.note(self.value)


class Controller(Noted):
    """Passes its reference on."""

    def act(self) -> None:
        reference = self.shell.reference.read().value
        self.note(reference.data)
        self.shell.command.write(reference)


def chain(stage: Stage, *components: tuple[str, type[Noted]]) -> None:
    """A planner and controllers behind it; each writes to the resource that has its name."""
    for (name, core), before in zip(components, [None, *(name for name, _ in components)], strict=False):
        stage.add(name, PlannerShell if before is None else ControllerShell, core)
        stage.share(name, SharedData(Float64), f"{name}.{'reference' if before is None else 'command'}.write")
        if before is not None:
            stage.architecture.connect(name, "reference", before, "read")


def value_of(running: Running, resource: str) -> float:
    return float(deserialize_message(running.host.read_resource(resource)[0], Float64).data)


def of(log: list[Execution], *cores: str) -> list[Execution]:
    return [execution for execution in log if execution.core in cores]


def check_that_no_release_is_lost(running: Running, executions: list[Execution], name: str) -> None:
    """Each instant of a component's grid was executed, or skipped for an overrun that was counted.

    Stops the components, so that nothing is executed between the looks. The last skipped instants may have no
    execution after them.
    """
    running.host.shutdown()
    first, last = executions[0].clock_ns, executions[-1].clock_ns
    skipped = running.architecture.component(name).describe().skipped
    assert 0 <= (last - first) // PERIOD_NS + 1 - len(executions) <= skipped
    assert not (running.simulated and skipped)
