"""Parts in Python that the tests of Python components share, and a stage to run them on."""

import time
from collections.abc import Callable
from types import TracebackType
from typing import Any, Self

from geometry_msgs.msg import Point, PoseStamped

from mauve_rt.api import (
    AnyResource,
    Architecture,
    ComponentDescription,
    Core,
    Deployer,
    Fsm,
    PluginRegistry,
    Shell,
    monotonic_ns,
    ms_to_ns,
    property,  # noqa: A004
    read_port,
    write_port,
)

POSE = "geometry_msgs/msg/PoseStamped"  # no library of ours registers it
TIMEOUT_NS = 20_000_000_000


class CountShell(Shell):
    out = write_port(PoseStamped, optional=True)
    step = property(1, minimum=1, maximum=10, unit="1")


class CountCore(Core[CountShell]):
    def configure(self) -> None:
        self.count = 0

    def act(self) -> None:
        self.count += self.shell.step.value
        pose = PoseStamped()
        pose.header.frame_id = f"count {self.count}"
        pose.pose.position.x = float(self.count)
        self.shell.out.write(pose)


class ActFsm(Fsm[Any, Any]):
    """Calls act() every 2 ms."""

    def define(self) -> None:
        act = self.execution("Act", "act")
        pause = self.wait("Pause", ms_to_ns(2))
        self.set_initial(act)
        self.next(act, pause)
        self.next(pause, act)


class HearShell(Shell):
    heard = read_port(PoseStamped, optional=True)


class HearCore(Core[HearShell]):
    def configure(self) -> None:
        self.samples: list[Any] = []

    def act(self) -> None:
        sample = self.shell.heard.read()
        if sample.is_new:
            self.samples.append(sample)


class EmptyShell(Shell):
    pass


class IdleCore(Core[Shell]):
    def act(self) -> None:
        pass


class PointShell(Shell):
    point = write_port(Point, optional=True)


class Stage:
    """An architecture of the test's own, shut down at the end."""

    def __init__(self) -> None:
        self.registry = PluginRegistry()
        self.architecture = Architecture(self.registry)
        self.deployer: Deployer | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, _type: type[BaseException] | None, _value: BaseException | None, _trace: TracebackType | None
    ) -> None:
        if self.deployer is not None:
            self.deployer.shutdown()

    def add(self, name: str, shell: Any, core: Any, fsm: Any = ActFsm) -> Any:
        return self.architecture.add_component(name, shell, core, fsm)

    def share(self, name: str, resource: AnyResource, *ports: str) -> None:
        """Adds a resource and connects `component.port.service` to it."""
        self.architecture.add_resource(name, resource)
        for place in ports:
            component, port, service = place.split(".")
            self.architecture.connect(component, port, name, service)

    def deploy(self) -> Deployer:
        self.architecture.configure()
        self.deployer = Deployer(self.architecture)
        self.deployer.deploy()
        return self.deployer

    def describe(self, name: str) -> ComponentDescription:
        return self.architecture.component(name).describe()

    def until(self, condition: Callable[[], object]) -> None:
        end_ns = monotonic_ns() + TIMEOUT_NS
        while not condition():
            states = [f"{item.name} {item.state} {item.fault}" for item in self.architecture.components()]
            assert monotonic_ns() < end_ns, f"waited in vain; {states}"
            time.sleep(0.001)
