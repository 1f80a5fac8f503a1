"""Resources written in Python: their services, who may call them, and who may not."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from python_parts import ActFsm, IdleCore, Stage

from mauve_rt.api import Core, MauveError, Resource, Shell, call_port, service
from mauve_rt.model.plugins import PluginIndex, PluginLoader
from mauve_rt.parts.resources import service_type
from mauve_rt.trace.format.records import RECORD, Kind


class Ledger(Resource):
    """Numbers that components add and read."""

    def configure(self) -> None:
        self.numbers: list[int] = []

    @service
    def add(self, number: int, *, times: int = 1) -> int:
        self.numbers += [number] * times
        return len(self.numbers)

    @service("test/Visitor")
    def visit(self, visitor: Callable[[list[int]], Any]) -> Any:
        return visitor(self.numbers)


class AddShell(Shell):
    add = call_port(Ledger.add)


class AddCore(Core[AddShell]):
    def configure(self) -> None:
        self.answers: list[int] = []

    def act(self) -> None:
        self.answers.append(self.shell.add(7, times=2))


class VisitShell(Shell):
    visit = call_port("test/Visitor")


class VisitCore(Core[VisitShell]):
    def configure(self) -> None:
        self.lengths: list[int] = []

    def act(self) -> None:
        self.lengths.append(self.shell.visit(len))


def test_services_are_called_by_cores_in_python(built: Stage):
    add, visit = built.add("add", AddShell, AddCore), built.add("visit", VisitShell, VisitCore)
    built.share("ledger", Ledger(), "add.add.add", "visit.visit.visit")
    resource = built.architecture.resources()[0]
    assert {(item.name, item.kind) for item in resource.services} == {("add", "call"), ("visit", "call")}
    assert {item.type for item in resource.services} == {service_type(Ledger.add), "test/Visitor"}
    deployer = built.deploy()
    built.until(lambda: len(add.core.answers) > 5 and visit.core.lengths and visit.core.lengths[-1] > 5)
    assert add.core.answers == [2 * (i + 1) for i in range(len(add.core.answers))]
    records = np.frombuffer(deployer.drain_trace().records, RECORD)
    names = deployer.trace_names()
    begun = {names[i] for i in records["name"][records["kind"] == Kind.SERVICE_BEGIN]}
    assert begun == {"ledger.add", "ledger.visit"}
    assert Kind.SERVICE_END in records["kind"]


def test_an_unconnected_call_port_is_refused(built: Stage):
    built.add("add", AddShell, AddCore)
    with pytest.raises(MauveError, match="a required port is not connected") as refused:
        built.deploy()
    assert (refused.value.code, refused.value.component, refused.value.element) == (
        "not_connected",
        "add",
        "port add",
    )


def test_services_of_other_types_are_refused(built: Stage):
    built.add("add", AddShell, AddCore)
    built.architecture.add_resource("ledger", Ledger())
    with pytest.raises(MauveError, match="does not fit") as refused:
        built.architecture.connect("add", "add", "ledger", "visit")
    assert refused.value.code == "type_mismatch"
    with pytest.raises(MauveError, match="one of add, visit"):
        built.architecture.connect("add", "add", "ledger", "subtract")


def require(stage: Stage, *plugins: tuple[str, str]) -> None:
    loader = PluginLoader(stage.registry, PluginIndex.installed())
    for kind, name in plugins:
        loader.require(kind, f"mauve_examples/{name}")


def test_a_component_in_cpp_may_not_call_a_service_in_python(built: Stage):
    require(built, ("shell", "GuidanceShell"), ("core", "Guidance"), ("fsm", "GuidanceFsm"))
    name = "mauve_examples/Guidance"
    built.add("guidance", f"{name}Shell", name, f"{name}Fsm")
    port = next(item for item in built.describe("guidance").ports if item.name == "map_get")
    fake = type("Fake", (Resource,), {"get": service(port.type)(lambda _self: None)})
    built.architecture.add_resource("map", fake())
    with pytest.raises(MauveError, match="in different ways") as refused:
        built.architecture.connect("guidance", "map_get", "map", "get")
    assert refused.value.code == "type_mismatch"
    assert "Python at map.get" in refused.value.found
    assert "shared_data" in refused.value.remedy


def test_a_component_in_python_may_not_call_a_service_in_cpp(built: Stage):
    require(built, ("resource", "OccupancyMap"))
    built.architecture.add_resource("map", kind="mauve_examples/OccupancyMap")
    offered = next(item for item in built.architecture.resources()[0].services if item.kind == "call")

    class MapShell(Shell):
        visit = call_port(offered.type)

    built.add("python", MapShell, IdleCore, ActFsm)
    with pytest.raises(MauveError, match="in different ways"):
        built.architecture.connect("python", "visit", "map", offered.name)


def test_a_resource_can_be_registered_by_name(built: Stage):
    built.registry.resource("test/Ledger", Ledger)
    built.architecture.add_resource("one", kind="test/Ledger")
    built.architecture.add_resource("two", kind="test/Ledger")
    assert [item.kind for item in built.architecture.resources()] == ["test/Ledger"] * 2
    assert len(built.registry.describe_resource("test/Ledger", "").services) == 2


def test_an_overridden_service_stays_one():
    class Audited(Ledger):
        def add(self, number: int, *, times: int = 1) -> int:
            return super().add(number, times=times)

    assert dict(Audited()._services()) == dict(Ledger()._services())


def test_what_is_no_service_cannot_be_called_through_a_port():
    with pytest.raises(TypeError, match="lacks @service"):
        call_port(Ledger.configure)
