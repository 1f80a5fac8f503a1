"""Who discovers our programs: by the network itself, not by what they say."""

import contextlib
import os
import random
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest
from ros_processes import PATIENCE_S

RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
EXECUTOR = ("-m", "mauve_rt.node.executor.main", "--ros-args", "-p", "architecture:=FILE")
PROGRAMS = {
    "executor": EXECUTOR,
    "supervisor": ("-m", "mauve_rt.node.supervisor.main", "--ros-args", "-p", "rules:=RULES"),
    "mauve": ("-m", "mauve_rt.cli", "events", "/executor"),
    "radio": ("-m", "mauve_examples.mission.radio", "--ros-args", "-p", "robots:=[robot_1,robot_2]"),
}
RELAY = """\
mauve: 1
components:
  relay: {shell: mauve_rt/Float64RelayShell, core: mauve_rt/Float64Relay, fsm: mauve_rt/Float64RelayFsm}
resources:
  given: {kind: shared_data, type: std_msgs/msg/Float64, topic: {name: given, direction: subscribe}}
  passed: {kind: shared_data, type: std_msgs/msg/Float64}
connections:
  - [relay.input, given.read]
  - [relay.output, passed.write]
"""
RULES = """\
mauve: 1
rules:
  - name: silent
    when: {silence: {topic: spoken, type: std_msgs/msg/Empty, longer_than_s: 60.0}}
    do: [{kind: stop, target: relay}]
"""
OBSERVER = """\
import rclpy
rclpy.init(args=[])
node = rclpy.create_node("observer", enable_rosout=False, start_parameter_services=False)
while True:
    rclpy.spin_once(node, timeout_sec=0.1)
    nodes = node.get_node_names_and_namespaces()
    print(*(space.rstrip("/") + "/" + name for name, space in nodes), flush=True)
"""


@contextlib.contextmanager
def _running(
    folder: Path, words: Sequence[str], said: dict[str, str], *, wrapper: Sequence[str] = ()
) -> Iterator[tuple[subprocess.Popen[bytes], Path]]:
    """A program in an environment that says of discovery only what is `said`, and what it prints."""
    unsaid = {RANGE, "ROS_LOCALHOST_ONLY", "ROS_STATIC_PEERS"}
    environment = {name: value for name, value in os.environ.items() if name not in unsaid}
    log = folder / f"{time.monotonic_ns()}.log"
    with log.open("wb") as output:
        process = subprocess.Popen(
            [*wrapper, sys.executable, *words],
            env=environment | said,
            cwd=folder,
            stdout=output,
            stderr=subprocess.STDOUT,
        )
    try:
        yield process, log
    finally:
        process.kill()
        process.wait()


def _udp_ports(process_id: int) -> set[int]:
    """The ports of all UDP sockets that a process holds."""
    links = []
    for descriptor in Path(f"/proc/{process_id}/fd").iterdir():
        with contextlib.suppress(OSError):  # closed meanwhile
            links.append(str(descriptor.readlink()))
    sockets = {match[1] for link in links if (match := re.match(r"socket:\[(\d+)\]", link))}
    table = Path(f"/proc/{process_id}/net/udp").read_text("ascii").splitlines()[1:]
    rows = [line.split() for line in table]
    return {int(row[1].rpartition(":")[2], 16) for row in rows if row[9] in sockets}


@pytest.mark.parametrize("program", PROGRAMS)
@pytest.mark.parametrize(
    ("said", "reaches_out"),
    [({}, False), ({RANGE: "SUBNET"}, True), ({RANGE: "SUBNET", "ROS_LOCALHOST_ONLY": "1"}, False)],
)
def test_only_who_is_told_so_listens_to_the_network(
    program: str, said: dict[str, str], *, reaches_out: bool, domain: int, tmp_path: Path
) -> None:
    """A participant that is discovered from elsewhere is so by multicast, at a port that DDS prescribes."""
    (tmp_path / "relay.yaml").write_text(RELAY, encoding="utf-8")
    (tmp_path / "rules.yaml").write_text(RULES, encoding="utf-8")
    words = [word.replace("FILE", "relay.yaml").replace("RULES", "rules.yaml") for word in PROGRAMS[program]]
    multicast = 7400 + 250 * domain
    with _running(tmp_path, words, said | {"ROS_DOMAIN_ID": str(domain)}) as (process, log):
        deadline = time.monotonic() + PATIENCE_S
        # The port of its data, which it opens last: the odd ones from 11 on.
        data = set(range(multicast + 11, multicast + 250, 2))
        ports: set[int] = set()
        while not ports & data:
            assert time.monotonic() < deadline, f"no participant in domain {domain}: {ports}"
            time.sleep(0.02)
            assert process.poll() is None, log.read_text("utf-8")
            ports = _udp_ports(process.pid)
        assert (multicast in ports) == reaches_out


@pytest.fixture
def cable() -> Iterator[tuple[str, str]]:
    """Two machines' worth of network, joined by a cable; their names for `ip netns exec`."""
    names = ("mauve_a_", "mauve_b_")
    suffix = f"{random.SystemRandom().randrange(1 << 16):04x}"
    here, there = (name + suffix for name in names)
    commands = [
        f"netns add {here}",
        f"netns add {there}",
        f"link add a{suffix} netns {here} type veth peer name b{suffix} netns {there}",
    ]
    for number, (name, link) in enumerate(((here, f"a{suffix}"), (there, f"b{suffix}")), start=1):
        commands += [
            f"-n {name} addr add 10.77.0.{number}/24 dev {link}",
            f"-n {name} link set lo up",
            f"-n {name} link set {link} up",
            f"-n {name} route add default dev {link}",
        ]
    if shutil.which("ip") is None:
        pytest.skip("needs the program `ip`, of iproute2")
    try:
        for command in commands:
            done = subprocess.run(["ip", *command.split()], capture_output=True, text=True, check=False)
            if done.returncode:
                pytest.skip(f"needs the right to make network namespaces (root): {done.stderr.strip()}")
        yield here, there
    finally:
        for name in (here, there):
            subprocess.run(["ip", "netns", "delete", name], capture_output=True, check=False)


def _seen(log: Path) -> set[str]:
    lines = log.read_text("utf-8").splitlines()
    return set(lines[-1].split()) if lines else set()


def _wait_until_seen(wanted: set[str], process: subprocess.Popen[bytes], log: Path) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while not wanted <= _seen(log):
        assert process.poll() is None, log.read_text("utf-8")
        assert time.monotonic() < deadline, f"expected {wanted}, seen {_seen(log)}"
        time.sleep(0.05)


def test_another_machine_sees_an_executor_only_where_it_was_opened(
    cable: tuple[str, str], domain: int, tmp_path: Path
) -> None:
    here, there = (("ip", "netns", "exec", name) for name in cable)
    (tmp_path / "relay.yaml").write_text(RELAY, encoding="utf-8")
    own = {"ROS_DOMAIN_ID": str(domain)}
    opened = own | {RANGE: "SUBNET"}
    words = [word.replace("FILE", "relay.yaml") for word in EXECUTOR]
    both = {"/opened/executor", "/untold/executor"}
    with (
        _running(tmp_path, [*words, "-r", "__ns:=/untold"], own, wrapper=here) as (_, untold_says),
        _running(tmp_path, [*words, "-r", "__ns:=/opened"], opened, wrapper=here) as (_, opened_says),
    ):
        with _running(tmp_path, ["-c", OBSERVER], opened, wrapper=here) as neighbour:
            _wait_until_seen(both, *neighbour)
        with _running(tmp_path, ["-c", OBSERVER], opened, wrapper=there) as stranger:
            _wait_until_seen({"/opened/executor"}, *stranger)
            time.sleep(1.0)  # what discovers one does not take longer for the other
            assert "/untold/executor" not in _seen(stranger[1])
        assert untold_says.read_text("utf-8").count("discovery on this machine only") == 1
        assert opened_says.read_text("utf-8").count(f"discovery beyond this machine ({RANGE}=SUBNET)") == 1
