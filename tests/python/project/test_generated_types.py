"""mauve_generate_types(): C++ structs for installed interfaces, from a package that finds mauve_rt."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from mauve_rt import _kernel
from mauve_rt._kernel import PluginRegistry, Simulation
from mauve_rt.model import build, configure, load_architecture

ROOT = Path(__file__).resolve().parents[3]
INSTALLED = Path(_kernel.__file__).resolve().parents[4]
ARCHITECTURE = """\
mauve: 1
components:
  sum: {shell: mauve_downstream/SumShell, core: mauve_downstream/Sum, fsm: mauve_downstream/SumFsm}
resources:
  joints: {kind: shared_data, type: sensor_msgs/msg/JointState, capacity: {name: 3, position: 3, velocity: 3, effort: 3}}
  total: {kind: shared_data, type: std_msgs/msg/Float64}
connections:
  - [sum.joints, joints.read]
  - [sum.sum, total.write]
"""


def run(*words: str | Path) -> str:
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.timeout(300)  # it compiles
def test_a_package_uses_messages_by_one_line_of_cmake(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, prefix = tmp_path / "build", tmp_path / "install"
    options = [
        f"-DCMAKE_PREFIX_PATH={INSTALLED}",
        f"-DCMAKE_INSTALL_PREFIX={prefix}",
        f"-DPython3_EXECUTABLE={sys.executable}",
    ]
    run("cmake", "-G", "Ninja", "-S", ROOT / "tests" / "downstream", "-B", folder, *options)
    run("cmake", "--build", folder, "--target", "install")
    monkeypatch.setenv("AMENT_PREFIX_PATH", os.pathsep.join([str(prefix), os.environ["AMENT_PREFIX_PATH"]]))
    architecture = tmp_path / "sum.yaml"
    architecture.write_text(ARCHITECTURE, encoding="utf-8")
    model = load_architecture(architecture)
    built = build(model, PluginRegistry())
    configure(model, built)
    simulation = Simulation()
    host = simulation.add(built)
    simulation.deploy()
    assert host.write_resource("joints", serialize_message(JointState(position=[1.0, 2.0, 4.0])))
    simulation.run_until(simulation.now_ns() + 50_000_000)
    message, _, _ = host.read_resource("total")
    assert deserialize_message(message, Float64).data == 7.0
    assert not host.write_resource("joints", serialize_message(JointState(position=[1.0] * 4)))
