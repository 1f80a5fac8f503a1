"""max_slew of components with parts in Python: of messages that a library has a struct of."""

import pytest
from geometry_msgs.msg import PoseStamped
from python_parts import ActFsm, Stage
from std_msgs.msg import Float64

from mauve_rt.api import Core, Host, MauveError, SharedData, Shell, Simulation, read_resource, write_port
from mauve_rt.model.plugins import PluginIndex, PluginLoader


class TorqueShell(Shell):
    torque = write_port(Float64, optional=True)
    pose = write_port(PoseStamped, optional=True)


class TorqueCore(Core[TorqueShell]):
    """Writes 0 once, then 1 at each release."""

    def configure(self) -> None:
        self.target = 0.0

    def act(self) -> None:
        self.shell.torque.write(Float64(data=self.target))
        self.target = 1.0


@pytest.fixture
def slewed(built: Stage) -> Stage:
    # Its library has a struct of Float64: before Python makes a port of the type.
    PluginLoader(built.registry, PluginIndex.installed()).require("core", "mauve_rt/TwistRelay")
    built.architecture.add_component("drive", TorqueShell, TorqueCore, ActFsm, max_slew={"torque.data": 50.0})
    built.share("torque", SharedData(Float64), "drive.torque.write")
    return built


def newest(host: Host) -> float:
    value: float = read_resource(host, "torque", Float64).value.data
    return value


def test_a_python_core_moves_its_output_no_faster(slewed: Stage) -> None:
    deployer = slewed.deploy()
    slewed.until(lambda: slewed.describe("drive").slew_limits[0].limited >= 3)
    slewed.until(lambda: newest(deployer) == 1.0)
    (record,) = slewed.describe("drive").slew_limits
    assert (record.output, record.max_slew, record.not_limited) == ("torque.data", 50.0, 0)


def test_a_python_core_moves_its_output_no_faster_in_virtual_time(slewed: Stage) -> None:
    slewed.architecture.configure()
    simulation = Simulation()
    host = simulation.add(slewed.architecture)
    simulation.deploy()
    values = []
    for _ in range(4):
        simulation.run_until(max(simulation.epoch_ns(), simulation.now_ns() + 2_000_000))
        values.append(newest(host))
    assert values == pytest.approx([0.0, 0.1, 0.2, 0.3])
    host.stop("drive")
    assert slewed.describe("drive").state == "STOPPING"
    values = []
    while slewed.describe("drive").state == "STOPPING":
        simulation.run_until(simulation.now_ns() + 2_000_000)
        values.append(newest(host))
    assert values == pytest.approx([0.2, 0.1, 0.0])
    assert slewed.describe("drive").slew_limits[0].not_limited == 0
    simulation.shutdown()


def test_a_message_without_a_struct_is_refused(built: Stage) -> None:
    with pytest.raises(
        MauveError, match=r"max_slew pose: .*PoseStamped in serialized; let a plug-in"
    ) as caught:
        built.architecture.add_component(
            "drive", TorqueShell, TorqueCore, ActFsm, max_slew={"pose.pose.position.x": 1.0}
        )
    assert caught.value.code == "invalid_argument"
    assert caught.value.component == "drive"


@pytest.mark.parametrize("per_second", [0.0, -1.0, float("nan"), float("inf")])
def test_what_is_no_change_per_second_is_refused(built: Stage, per_second: float) -> None:
    with pytest.raises(MauveError, match="max_slew is no change per second"):
        built.architecture.add_component(
            "drive", TorqueShell, TorqueCore, ActFsm, max_slew={"torque.data": per_second}
        )
