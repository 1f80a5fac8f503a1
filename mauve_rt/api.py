"""The kernel's concepts in Python, under the names they have in C++.

    from mauve_rt.api import Architecture, Core, Deployer, Fsm, PluginRegistry, SharedData, Shell

Shells, cores, fsms and resources may be written in Python or come by name from libraries, mixed at will.
"""

from mauve_rt._kernel import (
    NOT_MEASURED,
    Architecture,
    ArchitectureDescription,
    Component,
    ComponentDescription,
    Deployer,
    Duration,
    ExecutionTimeDescription,
    Host,
    MauveError,
    PluginRegistry,
    PortDescription,
    PropertyDescription,
    RealtimeStatus,
    ResourceDescription,
    ServiceDescription,
    SimulatedHost,
    Simulation,
    StepReport,
    TraceDrain,
    Transaction,
    TransactionReport,
    monotonic_ns,
)
from mauve_rt.model.build import open_architecture
from mauve_rt.parts.cores import Core
from mauve_rt.parts.declarations import call_port, event_port, property, read_port, write_port  # noqa: A004
from mauve_rt.parts.fsms import Fsm, PeriodicFsm, State, times
from mauve_rt.parts.model_core import ModelCore
from mauve_rt.parts.ports import CallPort, EventPort, Property, ReadPort, Sample, WritePort
from mauve_rt.parts.resources import (
    AnyResource,
    EventCounter,
    LatestValue,
    Resource,
    RingBuffer,
    SharedData,
    parameter,
    read_resource,
    service,
)
from mauve_rt.parts.shells import NativeShell, Shell
from mauve_rt.parts.time import FOREVER, ms_to_ns, s_to_ns, us_to_ns

__all__ = [
    "FOREVER",
    "NOT_MEASURED",
    "AnyResource",
    "Architecture",
    "ArchitectureDescription",
    "CallPort",
    "Component",
    "ComponentDescription",
    "Core",
    "Deployer",
    "Duration",
    "EventCounter",
    "EventPort",
    "ExecutionTimeDescription",
    "Fsm",
    "Host",
    "LatestValue",
    "MauveError",
    "ModelCore",
    "NativeShell",
    "PeriodicFsm",
    "PluginRegistry",
    "PortDescription",
    "Property",
    "PropertyDescription",
    "ReadPort",
    "RealtimeStatus",
    "Resource",
    "ResourceDescription",
    "RingBuffer",
    "Sample",
    "ServiceDescription",
    "SharedData",
    "Shell",
    "SimulatedHost",
    "Simulation",
    "State",
    "StepReport",
    "TraceDrain",
    "Transaction",
    "TransactionReport",
    "WritePort",
    "call_port",
    "event_port",
    "monotonic_ns",
    "ms_to_ns",
    "open_architecture",
    "parameter",
    "property",
    "read_port",
    "read_resource",
    "s_to_ns",
    "service",
    "times",
    "us_to_ns",
    "write_port",
]
