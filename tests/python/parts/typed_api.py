"""Uses the public API with every type said aloud; checked by mypy --strict, never run.

A line with `type: ignore[code]` is a mistake that mypy must find: strict checking refuses an ignore that
hides nothing.
"""

from collections.abc import Callable
from typing import assert_type

from mauve_msgs.srv import LookupTransform
from mauve_rt.api import (
    FOREVER,
    NOT_MEASURED,
    ActionClient,
    ActionClientPorts,
    ActionServer,
    ActionServerPorts,
    AnyResource,
    Architecture,
    ArchitectureDescription,
    CallPort,
    Component,
    ComponentDescription,
    Core,
    Deployer,
    Duration,
    EventCounter,
    EventPort,
    Fsm,
    GoalEvent,
    GoalReason,
    GoalSender,
    GoalState,
    Host,
    LatestValue,
    MauveError,
    ModelCore,
    PeriodicFsm,
    PluginRegistry,
    Property,
    ReadPort,
    RealtimeStatus,
    RequestPort,
    Resource,
    RingBuffer,
    Sample,
    SharedData,
    Shell,
    SimulatedHost,
    Simulation,
    State,
    StepReport,
    TraceDrain,
    Transaction,
    TransactionReport,
    TransformBuffer,
    TransformedReadPort,
    TransformedSample,
    TransformLookup,
    TransformTree,
    WritePort,
    action_client,
    action_server,
    call_port,
    event_port,
    monotonic_ns,
    ms_to_ns,
    open_architecture,
    parameter,
    property,  # noqa: A004
    read_port,
    read_resource,
    request_port,
    s_to_ns,
    service,
    times,
    transformed_read_port,
    us_to_ns,
    write_port,
)


class Pose:
    """Stands for a message class that has types."""

    x: float = 0.0


class DriveGoal:
    x: float = 0.0


class DriveResult:
    reached: bool = False


class DriveFeedback:
    left: float = 0.0


class Drive:
    """Stands for a class of an action that has types."""

    Goal = DriveGoal
    Result = DriveResult
    Feedback = DriveFeedback


class Map(Resource):
    size = parameter(1, unit="cells", minimum=1)

    def configure(self) -> bool | None:
        self.cells = [0] * self.size
        return True

    @service
    def get(self, cell: int, *, default: float = 0.0) -> float:
        return float(self.cells[cell]) or default

    @service("package/Visitor")
    def visit(self, visitor: Callable[[list[int]], None]) -> None:
        visitor(self.cells)


class HoverShell(Shell):
    pose = read_port(Pose)
    start = read_port(Pose, default=Pose())
    target = write_port(Pose, on_commit="hold", on_stop="set_zero", frame="map", child_frame="base")
    seen = read_port(Pose, frame="map", child_frame="base")
    get = call_port(Map.get)
    visit = call_port("package/Visitor")
    look = request_port(LookupTransform)
    goal = transformed_read_port(Pose, to="map", lookup=look, frame="base")
    reached = event_port()
    height = property(1.0, unit="m", description="above ground", minimum=0.0, maximum=9.0)
    tries = property(3)
    eager = property(initial=True)
    frame = property("map", structural="core")
    pace = property(10, structural=("core", "fsm"))
    wrong = write_port(Pose, on_commit="default")  # type: ignore[arg-type]


class HoverCore(Core[HoverShell]):
    def configure(self) -> None:
        self.height = self.shell.height.value
        assert_type(self.shell.height, Property[float])
        assert_type(self.shell.tries.value, int)
        assert_type(self.shell.eager.value, bool)
        assert_type(self.shell.frame.value, str)

    def adopt(self, old: object) -> bool:
        return isinstance(old, HoverCore)

    def take(self, old: "HoverCore") -> None:
        self.height = old.height

    def follow(self) -> None:
        assert_type(self.shell.pose, ReadPort[Pose])
        sample = self.shell.pose.read()
        assert_type(sample, Sample[Pose])
        assert_type(sample.age_ns(self.shell.clock_ns + self.shell.period_ns), int)
        if sample.is_new and sample.status == "new":
            assert_type(self.shell.target.write(sample.value), bool)
        assert_type(self.shell.get(3, default=1.0), float)
        self.shell.visit(print)
        assert_type(self.shell.look, RequestPort)
        assert_type(self.shell.goal, TransformedReadPort[Pose])
        goal = self.shell.goal.read()
        assert_type(goal, TransformedSample[Pose])
        if goal and goal.outcome == "done":
            assert_type(goal.value, Pose)
        self.shell.look(LookupTransform.Request(target="map", source="base"))
        self.shell.reached.raise_()
        self.shell.target.write(3)  # type: ignore[arg-type]
        self.shell.get("three")  # type: ignore[arg-type]
        self.shell.poze  # type: ignore[attr-defined]  # noqa: B018

    def is_high(self) -> bool:
        return self.height > 1.0


class DriveShell(Shell):
    drive = action_server(Drive)
    other = action_client(Drive)


class DriveCore(Core[DriveShell]):
    def act(self) -> None:
        drive, other = self.shell.drive, self.shell.other
        assert_type(drive, ActionServerPorts[DriveGoal, DriveResult, DriveFeedback])
        assert_type(other, ActionClientPorts[DriveGoal, DriveResult, DriveFeedback])
        assert_type(drive.goal(), Sample[DriveGoal])
        assert_type(other.result(), Sample[DriveResult])
        assert_type(other.feedback().value.left, float)
        assert_type(other.reason(), GoalReason)
        if drive.state() == GoalState.CANCELING and not drive.state().is_final:
            assert_type(drive.cancel(), bool)
        drive.feedback(Drive.Feedback())
        drive.succeed(Drive.Result())
        other.send(Drive.Goal())
        drive.succeed(Drive.Goal())  # type: ignore[arg-type]
        other.send(Drive.Result())  # type: ignore[arg-type]


def send(host: Host) -> None:
    sender = GoalSender(host, "drive", Drive)
    assert_type(sender.ask(Drive.Goal()), int)
    assert_type(sender.events(), list[GoalEvent[DriveResult, DriveFeedback]])
    sender.ask(Drive.Feedback())  # type: ignore[arg-type]


class OtherCore(Core[HoverShell]):
    def act(self) -> None: ...


class HoverFsm(Fsm[HoverShell, HoverCore]):
    def define(self) -> None:
        follow = self.execution(
            "Follow", HoverCore.follow, max_execution_ns=us_to_ns(500), wcet_ns=us_to_ns(200)
        )
        again = self.execution("Again", "follow")
        rest = self.wait("Rest", ms_to_ns(20) if self.shell.eager.value else s_to_ns(1))
        assert_type(follow, State)
        self.set_initial(follow)
        self.transition(follow, HoverCore.is_high, rest)
        self.transition(follow, "is_high", rest)
        self.next(follow, again)
        self.next(again, rest)
        self.next(rest, follow)
        self.execution("Other", OtherCore.act)  # type: ignore[arg-type]
        self.transition(follow, HoverCore.follow, rest)  # type: ignore[arg-type]
        self.next(follow, "Rest")  # type: ignore[arg-type]


class NativeCore(Core):
    """For a shell in C++, whose members only the kernel knows."""

    def tick(self) -> None:
        self.shell.beat.write(None)


def look_up(buffer: TransformBuffer) -> list[float]:
    buffer.set("map", "base", [1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], time_ns=1)
    found = buffer.lookup("map", "base")
    assert_type(found, TransformLookup)
    assert_type(found.outcome, str)
    return found.translation


def members(shell: HoverShell) -> tuple[WritePort[Pose], CallPort[[int], float], EventPort]:
    return shell.target, shell.get, shell.reached


class EventFsm(Fsm[HoverShell, HoverCore]):
    def define(self) -> None:
        heard = self.wait_event("Heard", self.shell.pose, ms_to_ns(100), ms_to_ns(1))
        assert_type(times(2, self.shell.tries), Duration)
        self.wait_event("Again", self.shell.pose, times(9, self.shell.tries), Duration(5, "5 * tries"))
        self.wait("Rest", times(1, self.shell.height))  # type: ignore[arg-type]
        also = self.wait_event("Also", "pose", timeout_ns=s_to_ns(1), min_interarrival_ns=1)
        self.set_initial(heard)
        self.next(heard, also)
        self.next(also, heard)
        self.wait_event("Wrong", self.shell.target, 1, 1)  # type: ignore[arg-type]


class Modelled(ModelCore[HoverShell]):
    actions = ("follow",)

    def follow(self) -> None: ...


class Periodic(PeriodicFsm[HoverShell, Modelled]):
    def define(self) -> None:
        self.period(times(5, self.shell.tries))
        follow = self.periodic_state("Follow", Modelled.follow, max_execution_ns=us_to_ns(500))
        assert_type(follow, State)
        self.set_initial(follow)
        self.next(follow, follow)
        self.periodic_state("Wrong", OtherCore.act)  # type: ignore[arg-type]


def change(architecture: Architecture, host: Host) -> TransactionReport:
    before = architecture.describe()
    assert_type(before, ArchitectureDescription)
    transaction = (
        Transaction()
        .add_resource("extra", SharedData(Pose), longest_hold_ns=2_000)
        .add_resource("named", kind="event")
        .add_component("new", HoverShell, HoverCore, "package/Fsm", priority=3, properties={"height": 2.0})
        .connect("new", "pose", "extra", "read")
        .start("new")
        .replace_core("hover", OtherCore)
        .replace_fsm("hover", EventFsm)
        .replace_shell("hover", "package/HoverShell")
        .set_property("hover", "tries", 4)
        .disconnect("hover", "pose")
        .stop("mixed")
        .remove_component("mixed")
        .remove_resource("count")
    )
    host.commit(transaction, dry_run=True)
    assert_type(str(architecture.describe()), str)
    report = host.commit(transaction, idle=True, idle_within_ns=ms_to_ns(20))
    assert_type(report.is_idle, bool)
    return host.commit(transaction, expected_revision=architecture.revision(), commit_timeout_ns=ms_to_ns(50))


def simulate(architecture: Architecture) -> TraceDrain:
    simulation = Simulation(trace=True, begin_ns=s_to_ns(1))
    host = simulation.add(architecture)
    assert_type(host, SimulatedHost)
    simulation.deploy()
    simulation.at(simulation.epoch_ns() + ms_to_ns(10), lambda: host.stop("hover"))
    simulation.every(simulation.now_ns(), ms_to_ns(1), lambda: host.get_time("hover"))
    simulation.run_until(s_to_ns(2))
    host.start("hover")
    host.commit(Transaction().stop("hover"))
    simulation.shutdown()
    return host.drain_trace()


def run(registry: PluginRegistry) -> StepReport:
    registry.load_library("libplugins.so")
    registry.shell("package/HoverShell", HoverShell)
    registry.core("package/HoverCore", HoverCore, "package/HoverShell")
    registry.fsm("package/HoverFsm", HoverFsm, "package/HoverShell")
    registry.resource("package/Map", Map)
    architecture = Architecture(registry)
    resources: dict[str, AnyResource] = {
        "pose": SharedData(Pose),
        "queue": RingBuffer(Pose, 8, overwrite=True, max_bytes=100),
        "latest": LatestValue("geometry_msgs/msg/Pose2D", max_readers=2),
        "count": EventCounter(),
        "frames": TransformTree(frames=8, history=10),
        "drive": ActionServer(Drive, goals=2, max_bytes=100),
        "other": ActionClient(Drive, answer_ns=1),
        "map": Map(),
    }
    for name, resource in resources.items():
        architecture.add_resource(name, resource)
    architecture.add_resource(
        "named", kind="ring_buffer", type="std_msgs/msg/Bool", capacity=3, longest_hold_ns=9
    )
    hover = architecture.add_component(
        "hover", HoverShell, HoverCore, HoverFsm, priority=40, cpus=[0], max_slew={"out.x": 2.0}
    )
    architecture.add_component("mixed", "package/Shell", NativeCore, "package/Fsm", overrun="catch_up")
    architecture.add_component("bad", HoverCore, HoverCore, HoverFsm)  # type: ignore[arg-type]
    assert_type(hover, Component)
    architecture.connect("hover", "pose", "pose", "read")
    architecture.set_property("hover", "height", 2.0)
    architecture.publish("pose")
    architecture.configure()
    deployer = Deployer(architecture, require_realtime=False, trace=True)
    deployer.deploy()
    assert_type(deployer.realtime_status(), RealtimeStatus)
    clock = deployer.get_time("hover")
    deployer.stop("hover", timeout_ns=FOREVER)
    hover.cleanup_core()
    hover.replace_core(OtherCore)
    hover.configure_core()
    deployer.start("hover", clock)
    assert_type(hover.describe(), ComponentDescription)
    assert_type(hover.describe().slew_limits[0].limited, int)
    assert_type(deployer.drain_trace(), TraceDrain)
    try:
        report = deployer.replace_core("hover", HoverCore, commit_timeout_ns=ms_to_ns(100))
    except MauveError as error:
        assert_type((error.code, error.component, error.remedy), tuple[str, str, str])
        raise
    finally:
        deployer.shutdown()
        architecture.cleanup()
    assert_type(report.phase_actual_ns != NOT_MEASURED, bool)
    assert_type(monotonic_ns(), int)
    return report


def test_a_file() -> None:
    """As a test of a package does."""
    architecture = assert_type(open_architecture("robot.yaml"), Architecture)
    host = Deployer(architecture)
    assert_type(read_resource(host, "pose", Pose), Sample[Pose])
    read_resource(host, "pose", "geometry_msgs/msg/Pose")  # type: ignore[arg-type]
