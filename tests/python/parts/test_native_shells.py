"""What a core written in Python sees of a shell in C++."""

from types import SimpleNamespace
from typing import Any

import pytest
from geometry_msgs.msg import Point
from rclpy.serialization import deserialize_message, serialize_message
from std_msgs.msg import Float64

from mauve_rt.parts.cores import Core
from mauve_rt.parts.shells import NativeShell


class View:
    """Stands in for the kernel's view of a shell."""

    def __init__(self) -> None:
        self.written: dict[str, bytes] = {}
        self.status = 0

    def read(self, _port: str) -> tuple[bytes, int, int]:
        return serialize_message(Float64(data=2.5)), self.status, 1000

    def write(self, port: str, data: bytes) -> bool:
        self.written[port] = data
        return True

    def property(self, name: str) -> float:
        return {"gain": 3.0}[name]

    def ports(self) -> list[Any]:
        return [
            SimpleNamespace(name="input", kind="read", type="std_msgs/msg/Float64"),
            SimpleNamespace(name="output", kind="write", type="geometry_msgs/msg/Point"),
            SimpleNamespace(name="private", kind="read", type="some_package/Private"),
            SimpleNamespace(name="map", kind="call", type="void(some_package/Visitor)"),
        ]

    def properties(self) -> list[Any]:
        return [SimpleNamespace(name="gain", value=3.0)]

    def clock(self) -> int:
        return 5_000

    def period(self) -> int:
        return 100


def test_read_gives_value_status_and_age() -> None:
    view = View()
    shell = NativeShell(view)
    sample = shell.input.read()
    assert (sample.status, sample.is_new, sample.age_ns(9999)) == ("none", False, 0)
    view.status = 2
    sample = shell.input.read()
    assert (sample.value.data, sample.status, sample.is_new) == (2.5, "new", True)
    assert sample.age_ns(shell.clock_ns) == 4_000
    view.status = 1
    assert shell.input.read().status == "old"


def test_write_takes_only_the_port_s_type() -> None:
    view = View()
    shell = NativeShell(view)
    assert shell.output.write(Point(x=1.5))
    assert deserialize_message(view.written["output"], Point).x == 1.5
    with pytest.raises(TypeError, match="port 'output' takes geometry_msgs/msg/Point, not Float64"):
        shell.output.write(Float64())


def test_properties_clock_and_period() -> None:
    shell = NativeShell(View())
    assert (shell.gain.value, shell.clock_ns, shell.period_ns) == (3.0, 5_000, 100)


def test_what_the_shell_has_not() -> None:
    shell = NativeShell(View())
    with pytest.raises(AttributeError, match="no port or property 'inptu'; it has gain, input, output"):
        _ = shell.inptu
    with pytest.raises(
        TypeError, match="'some_package/Private' is no installed ROS message; use a core in C"
    ):
        shell.private.read()


def test_core_keeps_its_shell() -> None:
    shell = NativeShell(View())
    core = Core(shell)
    assert core.shell is shell
    assert core.configure() is None
