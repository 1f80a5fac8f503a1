"""The how-to pages whose commands need an executor: they do what the page says."""

import os
import re
import shlex
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from page_blocks import blocks
from pages import PAGES
from preparations import NODE
from std_msgs.msg import Float64

from mauve_msgs.msg import ComponentInfo
from mauve_msgs.srv import ListComponents
from mauve_rt import _kernel

ROOT = Path(__file__).parents[3]
INSTALLED = Path(_kernel.__file__).resolve().parents[4]
ROBOT = ROOT / "mauve_examples" / "architecture" / "robot.yaml"
MAP = ROOT / "mauve_examples" / "maps" / "office.yaml"
HUNG = """\
mauve: 1
executor: {namespace: /robot_1}
components:
  counter: {shell: executor_tests/CounterShell, core: executor_tests/Hanging, fsm: executor_tests/CounterFsm,
            cpus: [0], priority: 20, properties: {period_ms: 20, label: loop}}
  guard: {shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm}
resources:
  set: {kind: shared_data, type: std_msgs/msg/Float64, topic: {name: set, direction: subscribe}}
connections:
  - [counter.set, set.read]
"""


def _texts(name: str) -> list[str]:
    return [block.text for block in blocks(PAGES[f"docs/howto/{name}.md"]) if not block.not_run]


class Commands:
    """Blocks of a page, run by a shell on the graph's domain."""

    def __init__(self, page: str, graph: Any, folder: Path) -> None:
        self.texts = _texts(page)
        self._graph = graph
        self._folder = folder

    def _block(self, begin: str) -> str:
        [found] = [text for text in self.texts if text.startswith(begin)]
        return found

    def run(self, begin: str, **names: str) -> str:
        """The one that begins so, with other names; everything it printed."""
        text = f'mauve() {{ {shlex.quote(sys.executable)} -m mauve_rt.cli "$@"; }}\n{self._block(begin)}'
        for old, new in names.items():
            text = re.sub(rf"\b(mauve_examples/)?{old}\b", new, text)
        environment = {**os.environ, "ROS_DOMAIN_ID": str(self._graph.node.context.get_domain_id())}
        environment["PYTHONPATH"] = os.pathsep.join([str(ROOT), environment.get("PYTHONPATH", "")])
        done = subprocess.run(
            ["bash", "-c", text],
            env=environment,
            cwd=self._folder,
            capture_output=True,
            text=True,
            check=False,
        )
        return done.stdout + done.stderr

    def part(self, name: str) -> Any:
        listed = self._graph.ask(ListComponents, f"{NODE}/list_components").components
        return next(part for part in listed if part.name == name)


NAMES = {"guidance": "counter", "Guidance": "executor_tests/Backwards"}


def test_a_faulted_component_is_repaired_as_the_page_says(executor: Any, graph: Any, tmp_path: Path) -> None:
    page = Commands("repair_a_faulted_component", graph, tmp_path)
    voice = graph.voice(Float64, "/robot_1/set")

    def fault() -> None:
        voice.publish(Float64(data=-1e9))
        graph.spin_until(lambda: page.part("counter").state == ComponentInfo.FAULTED, "the fault")
        voice.publish(Float64(data=0.0))

    fault()
    [shown] = [text for text in page.texts if text.startswith("refused")]
    assert shown.strip().replace("guidance", "counter") in page.run("mauve start", **NAMES)
    assert "2 steps are in force" in page.run("printf", **NAMES)
    assert page.part("counter").state == ComponentInfo.RUNNING
    fault()
    page.run("mauve replace-core", **NAMES)
    part = page.part("counter")
    assert (part.state, part.core) == (ComponentInfo.RUNNING, "executor_tests/Backwards")


def test_a_component_is_removed_and_added_as_the_page_says(
    start_executor: Callable[..., Any], graph: Any, tmp_path: Path
) -> None:
    start_executor("-p", f"architecture:={ROBOT}")
    page = Commands("repair_a_faulted_component", graph, tmp_path)
    [steps] = [text for text in page.texts if text.startswith("force: true")]
    (tmp_path / "anew.yaml").write_text(steps.replace("MAP.yaml", str(MAP)), encoding="utf-8")
    before = page.part("guidance")
    said = page.run("mauve reconfigure")
    assert "would be accepted" in said, said
    assert "14 steps are in force" in said, said
    after = page.part("guidance")
    assert after.state == ComponentInfo.RUNNING
    kept = ("core", "priority", "cpus", "period_ns")
    assert [getattr(after, name) for name in kept] == [getattr(before, name) for name in kept]
    assert [(port.name, port.resource) for port in after.ports] == [
        (port.name, port.resource) for port in before.ports
    ]


def test_a_hung_component_is_given_up_as_the_page_says(
    architecture: Path, start_executor: Callable[..., Any], graph: Any, tmp_path: Path
) -> None:
    architecture.write_text(HUNG, encoding="utf-8")
    start_executor("-p", f"architecture:={architecture}")
    page = Commands("repair_a_faulted_component", graph, tmp_path)
    graph.spin_until(lambda: page.part("counter").hung, "the component to hang")
    [shown] = [text for text in page.texts if text.startswith("component 'guidance'")]
    said = page.run("mauve stop", guidance="counter")
    assert shown.strip().replace("guidance", "counter") in said


class Manager:
    """What systemd is to a service of type notify."""

    def __init__(self, path: Path) -> None:
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.bind(str(path))
        self._socket.setblocking(False)
        self.heard: list[str] = []

    def hear(self, state: str) -> int:
        """How often a state was reported by now."""
        try:
            while True:
                self.heard.append(self._socket.recv(1000).decode())
        except BlockingIOError:
            return self.heard.count(state)

    def close(self) -> None:
        self._socket.close()


@pytest.fixture
def manager(tmp_path: Path) -> Iterator[Manager]:
    manager = Manager(tmp_path / "notify")
    yield manager
    manager.close()


def test_the_command_of_the_unit_file_starts_an_executor(
    manager: Manager, graph: Any, tmp_path: Path
) -> None:
    [unit] = [text for text in _texts("systemd") if "Type=notify" in text]
    command = re.search(r"^ExecStart=(.*)$", unit, re.MULTILINE)
    assert command is not None
    places = {
        "/opt/mauve_rt/install": str(INSTALLED),
        "/etc/mauve/robot.yaml": str(ROBOT),
        "/var/lib/mauve": str(tmp_path),
    }
    text = command[1].replace("%%", "%").replace("$$", "$")
    for old, new in places.items():
        text = text.replace(old, new)
    environment = {
        **os.environ,
        "ROS_DOMAIN_ID": str(graph.node.context.get_domain_id()),
        "NOTIFY_SOCKET": str(tmp_path / "notify"),
        "WATCHDOG_USEC": "2000000",
    }
    with subprocess.Popen(shlex.split(text), env=environment, cwd=tmp_path) as process:
        try:
            graph.spin_until(lambda: manager.hear("READY=1") == 1, "that it is ready")
            graph.spin_until(lambda: manager.hear("WATCHDOG=1") > 0, "that it works")
        finally:
            process.send_signal(signal.SIGTERM)
        assert process.wait() == 0
    assert manager.hear("STOPPING=1") == 1
    assert len([*tmp_path.glob("bag_*/*.mcap")]) == 1


@pytest.mark.parametrize("program", ["executor", "mauve"])
def test_enforced_security_refuses_a_program_without_keys(program: str, tmp_path: Path) -> None:
    """Of the page about DDS Security: as far as it goes without security plug-ins."""
    variables = dict(re.findall(r"export (ROS_SECURITY_\w+)=(\S+)", PAGES["docs/howto/dds_security.md"]))
    assert set(variables) == {"ROS_SECURITY_KEYSTORE", "ROS_SECURITY_ENABLE", "ROS_SECURITY_STRATEGY"}
    (tmp_path / "keys" / "enclaves").mkdir(parents=True)
    environment = {**os.environ, **variables, "ROS_SECURITY_KEYSTORE": str(tmp_path / "keys")}
    if program == "executor":
        module, enclave = "mauve_rt.node.executor.main", "/robot_1"
        words = ["--ros-args", "--enclave", enclave, "-p", f"architecture:={ROBOT}"]
    else:
        module, enclave, words = "mauve_rt.cli", "/operator", ["nodes"]
        environment["ROS_SECURITY_ENCLAVE_OVERRIDE"] = enclave
    command = [sys.executable, "-m", module, *words]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode != 0
    missing = f"SECURITY ERROR: directory '{tmp_path}/keys/enclaves{enclave}' does not exist"
    assert missing in done.stdout + done.stderr


def _package(folder: Path, domain: int, files: dict[str, str], plugins: str) -> dict[str, str]:
    """Write a package `my_robot` with these files; the environment in which programs find it."""
    index = "share/ament_index/resource_index"
    listed = {f"{index}/packages/my_robot": "", f"{index}/mauve_rt_plugins/my_robot": plugins}
    for name, text in {"my_robot/__init__.py": "", **files, **listed}.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    environment = {**os.environ, "ROS_DOMAIN_ID": str(domain)}
    for name in ("AMENT_PREFIX_PATH", "PYTHONPATH"):
        environment[name] = os.pathsep.join([str(folder), environment.get(name, "")])
    return environment


def _executor(file: str) -> list[str]:
    """The command that runs an architecture file.

    In the page's folder the sources of the project are not on the path of `-m`.
    """
    return [sys.executable, "-m", "mauve_rt.node.executor.main", "--ros-args", "-p", f"architecture:={file}"]


@pytest.mark.parametrize("peer", ["rclpy", "component"])
def test_a_node_of_rclpy_and_its_component_do_the_same(peer: str, graph: Any, tmp_path: Path) -> None:
    node, component, plugins, file = _texts("coming_from")
    files = {"node.py": node, "my_robot/doubler.py": component, "robot.yaml": file}
    environment = _package(tmp_path, graph.node.context.get_domain_id(), files, plugins)
    command = [sys.executable, "node.py"] if peer == "rclpy" else _executor("robot.yaml")
    with subprocess.Popen(command, env=environment, cwd=tmp_path) as process:
        try:
            voice = graph.voice(Float64, "/given")
            passed = graph.hear(Float64, "/passed")
            voice.publish(Float64(data=21.0))
            graph.spin_until(lambda: any(message.data == 42.0 for message in passed), "the double")
        finally:
            process.send_signal(signal.SIGINT)
            process.wait()


def test_the_action_of_the_page_is_served(graph: Any, tmp_path: Path) -> None:
    file, core, plugins, send, replace = _texts("serve_an_action")
    files = {"drive.yaml": file, "my_robot/driver.py": core, "send.py": send}
    environment = _package(tmp_path, graph.node.context.get_domain_id(), files, plugins)
    page = Commands("serve_an_action", graph, tmp_path)
    with subprocess.Popen(_executor("drive.yaml"), env=environment, cwd=tmp_path) as process:
        try:
            with subprocess.Popen(
                [sys.executable, "send.py"], env=environment, cwd=tmp_path, stdout=subprocess.PIPE, text=True
            ) as client:
                assert client.stdout is not None
                first = client.stdout.readline()
                said = page.run(replace.strip())
                assert "took over driven_m, number" in said or "took over number, driven_m" in said, said
                lines = client.communicate(timeout=60)[0].splitlines()
            assert float(first.removesuffix(" m\n")) > 0.0
            assert lines[-1] == "reached: True"
            left = [float(line.removesuffix(" m")) for line in lines[:-1]]
            assert left == sorted(left, reverse=True), "the new core went on where the old one was"
        finally:
            process.send_signal(signal.SIGINT)
            process.wait()
