"""Who discovers our programs: by the network itself, not by what they say."""

import contextlib
import os
import random
import shutil
import socket
import struct
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest
from ros_processes import PATIENCE_S, RELAY
from udp_sockets import udp_sockets
from waiting import wait_until

from mauve_rt.parts.ament_index import share_folder

SO_TIMESTAMPNS = 35  # of Linux
RANGE, PROFILES = "ROS_AUTOMATIC_DISCOVERY_RANGE", "FASTRTPS_DEFAULT_PROFILES_FILE"
EXECUTOR = ("-m", "mauve_rt.node.executor.main", "--ros-args", "-p", "architecture:=FILE")
PROGRAMS = {
    "executor": EXECUTOR,
    "supervisor": ("-m", "mauve_rt.node.supervisor.main", "--ros-args", "-p", "rules:=RULES"),
    "mauve": ("-m", "mauve_rt.cli", "events", "/executor"),
    "radio": ("-m", "mauve_examples.mission.radio", "--ros-args", "-p", "robots:=[robot_1,robot_2]"),
    "world": ("-m", "mauve_examples.mission.world", "--ros-args", "-p", "robots:=[robot_1,robot_2]"),
}
RULES = """\
mauve: 1
rules:
  - name: silent
    when: {silence: {topic: spoken, type: std_msgs/msg/Empty, longer_than_s: 60.0}}
    do: [{kind: stop, target: relay}]
"""
OWN_PROFILE = """\
<dds xmlns="http://www.eprosima.com">
  <profiles>
    <participant profile_name="own" is_default_profile="true"><rtps><name>own</name></rtps></participant>
  </profiles>
</dds>
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
    unsaid = {RANGE, "ROS_LOCALHOST_ONLY", "ROS_STATIC_PEERS", PROFILES}
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


def _begin(process: subprocess.Popen[bytes], log: Path, domain: int) -> tuple[set[str], set[int]]:
    """The addresses and ports of a program's UDP sockets, as soon as it has a participant."""
    deadline = time.monotonic() + PATIENCE_S
    # The port of its data, which it opens last: the odd ones from 11 on.
    first = 7400 + 250 * domain
    data = set(range(first + 11, first + 250, 2))
    ports: set[int] = set()
    while not ports & data:
        assert time.monotonic() < deadline, f"no participant in domain {domain}: {ports}"
        time.sleep(0.02)
        assert process.poll() is None, log.read_text("utf-8")
        ports = {port for _, port in udp_sockets(process.pid)}
    time.sleep(0.3)  # and those that it sends by
    sockets = udp_sockets(process.pid)
    return {address for address, _ in sockets}, {port for _, port in sockets}


def _words(program: str, folder: Path) -> list[str]:
    (folder / "relay.yaml").write_text(RELAY, encoding="utf-8")
    (folder / "rules.yaml").write_text(RULES, encoding="utf-8")
    return [word.replace("FILE", "relay.yaml").replace("RULES", "rules.yaml") for word in PROGRAMS[program]]


@pytest.mark.parametrize("program", PROGRAMS)
@pytest.mark.parametrize(
    ("said", "reaches_out"),
    [
        ({}, False),
        ({RANGE: "LOCALHOST"}, False),
        ({RANGE: "SUBNET"}, True),
        ({RANGE: "SUBNET", "ROS_LOCALHOST_ONLY": "1"}, False),
    ],
)
def test_only_who_is_told_so_listens_to_the_network(
    program: str, said: dict[str, str], *, reaches_out: bool, domain: int, tmp_path: Path
) -> None:
    """Each UDP socket of a program that stays on this machine is bound to loopback, and to no group."""
    words = _words(program, tmp_path)
    with _running(tmp_path, words, said | {"ROS_DOMAIN_ID": str(domain)}) as (process, log):
        addresses, ports = _begin(process, log, domain)
        if reaches_out:
            assert "0.0.0.0" in addresses  # noqa: S104 - as Fast DDS has it
            assert 7400 + 250 * domain in ports  # of multicast
        else:
            assert addresses == {"127.0.0.1"}


@pytest.mark.parametrize(
    "said",
    [
        {RANGE: "OFF"},
        {RANGE: "LOCALHOST", "FASTDDS_BUILTIN_TRANSPORTS": "UDPv4"},
        {RANGE: "SYSTEM_DEFAULT", PROFILES: "local.xml"},
        {RANGE: "LOCALHOST", PROFILES: "local_udp.xml"},
    ],
)
def test_an_executor_is_bound_to_loopback_however_it_was_told_to_stay(
    said: dict[str, str], domain: int, tmp_path: Path
) -> None:
    if PROFILES in said:
        said = said | {PROFILES: f"{share_folder('mauve_rt')}/dds/{said[PROFILES]}"}
    words = _words("executor", tmp_path)
    with _running(tmp_path, words, said | {"ROS_DOMAIN_ID": str(domain)}) as (process, log):
        assert _begin(process, log, domain)[0] == {"127.0.0.1"}
        _wait_until_logged("on this machine only: UDP bound to 127.0.0.1", process, log)


@pytest.mark.parametrize("program", ["executor", "supervisor", "world"])
@pytest.mark.parametrize("reach", ["LOCALHOST", "SUBNET"])
def test_other_accounts_cannot_read_the_shared_memory_of_a_program(
    program: str, reach: str, domain: int, tmp_path: Path
) -> None:
    """The messages lie in it."""
    words = _words(program, tmp_path)
    said = {"ROS_DOMAIN_ID": str(domain), RANGE: reach}
    with _running(tmp_path, words, said) as (process, log):
        _begin(process, log, domain)
        mapped = Path(f"/proc/{process.pid}/maps").read_text("utf-8").split()
        files = {Path(word) for word in mapped if word.startswith("/dev/shm/fastrtps_")}  # noqa: S108
        assert any("port" in file.name for file in files)
        wait_until(lambda: {file.stat().st_mode & 0o077 for file in files} == {0})


@pytest.mark.parametrize(
    ("reach", "others"),
    [("LOCALHOST", ""), ("SUBNET", f", and every machine that reaches it ({RANGE}=SUBNET)")],
)
def test_list_says_who_may_change_an_executor(reach: str, others: str, domain: int, tmp_path: Path) -> None:
    said = {"ROS_DOMAIN_ID": str(domain), RANGE: reach}
    with _running(tmp_path, _words("executor", tmp_path), said) as (process, log):
        _begin(process, log, domain)
        call = [sys.executable, "-m", "mauve_rt.cli", "list", "/executor"]
        environment = os.environ | said
        shown = subprocess.run(
            call, env=environment, cwd=tmp_path, capture_output=True, text=True, check=False
        )
        assert f"may change it: every account of this machine{others}\n" in shown.stdout, shown


@pytest.mark.parametrize("program", PROGRAMS)
@pytest.mark.parametrize("can_write", [True, False], ids=["TMPDIR", "next folder"])
def test_a_program_announces_itself_from_the_last_port_to_the_first(
    program: str, *, can_write: bool, domain: int, tmp_path: Path
) -> None:
    """The next folder for temporary files serves where TMPDIR cannot be written."""
    said = {"ROS_DOMAIN_ID": str(domain), "TMPDIR": str(tmp_path) if can_write else "/proc"}
    with contextlib.ExitStack() as stack:
        first, last = (stack.enter_context(_port_of(domain, number)) for number in (3, 28))
        process, log = stack.enter_context(_running(tmp_path, _words(program, tmp_path), said))
        assert _received_ns(last) < _received_ns(first), log.read_text("utf-8")
        assert process.poll() is None, log.read_text("utf-8")
        assert "XMLPARSER" not in log.read_text("utf-8")
        wait_until(lambda: not list(tmp_path.glob("mauve_*.xml")))


def _port_of(domain: int, participant: int) -> socket.socket:
    """The socket at which a participant of a domain would receive discovery messages."""
    made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    made.bind(("127.0.0.1", 7410 + 250 * domain + 2 * participant))
    made.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
    made.settimeout(PATIENCE_S)
    return made


def _received_ns(port: socket.socket) -> int:
    """When the kernel received the first announcement there."""
    message, [(_, _, instant)], _, _ = port.recvmsg(1 << 16, 64)
    assert message.startswith(b"RTPS")
    seconds, nanoseconds = struct.unpack("=qq", instant)
    return int(seconds * 10**9 + nanoseconds)


@pytest.mark.parametrize("profile", [OWN_PROFILE, "", "no XML", None])
@pytest.mark.parametrize("said", [{}, {RANGE: "LOCALHOST"}])
def test_a_profile_that_opens_what_was_to_stay_here_ends_the_executor(
    profile: str | None, said: dict[str, str], domain: int, tmp_path: Path
) -> None:
    """One that is missing, empty, or says nothing of transports: Fast DDS listens on every address then."""
    own = tmp_path / "own.xml"
    if profile is not None:
        own.write_text(profile, encoding="utf-8")
    said = said | {PROFILES: str(own), "ROS_DOMAIN_ID": str(domain)}
    with _running(tmp_path, _words("executor", tmp_path), said) as (process, log):
        assert process.wait(PATIENCE_S) == 2
        text = log.read_text("utf-8")
        assert "executor: not on this machine only: UDP bound to 0.0.0.0" in text
        assert f"as {PROFILES}={own} takes the place of the project's profile" in text
        assert f"Set {RANGE}=SUBNET to let them in" in text


def test_a_profile_of_the_users_own_is_kept_where_others_may_come_in(domain: int, tmp_path: Path) -> None:
    own = tmp_path / "own.xml"
    own.write_text(OWN_PROFILE, encoding="utf-8")
    said = {RANGE: "SUBNET", PROFILES: str(own), "ROS_DOMAIN_ID": str(domain)}
    with _running(tmp_path, _words("executor", tmp_path), said) as (process, log):
        assert "0.0.0.0" in _begin(process, log, domain)[0]  # noqa: S104 - as Fast DDS has it
        _wait_until_logged(f"{PROFILES}={own} has no <non_blocking_send>true", process, log)


@pytest.mark.parametrize("program", sorted(PROGRAMS.keys() - {"mauve"}))  # loads the middleware before
def test_another_middleware_is_refused_with_what_to_set(program: str, domain: int, tmp_path: Path) -> None:
    said = {"RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp", "ROS_DOMAIN_ID": str(domain)}
    with _running(tmp_path, _words(program, tmp_path), said) as (process, log):
        assert process.wait(PATIENCE_S) == 2
        [line] = log.read_text("utf-8").splitlines()
        assert line.startswith(f"{program}: RMW_IMPLEMENTATION=rmw_cyclonedds_cpp cannot be bound")
        assert line.endswith(f"or {RANGE}=SUBNET to let other machines in.")


def _wait_until_logged(text: str, process: subprocess.Popen[bytes], log: Path) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while text not in log.read_text("utf-8"):
        assert process.poll() is None, log.read_text("utf-8")
        assert time.monotonic() < deadline, log.read_text("utf-8")
        time.sleep(0.05)


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
        assert untold_says.read_text("utf-8").count("on this machine only: UDP bound to 127.0.0.1;") == 1
        assert opened_says.read_text("utf-8").count(f"discovery beyond this machine ({RANGE}=SUBNET)") == 1
