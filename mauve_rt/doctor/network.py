"""Checks of ROS and of how far it reaches: distribution, middleware, environment, discovery, participants."""

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

from mauve_rt.counts import counted
from mauve_rt.doctor.finding import Computer, Finding, error, ok, warning
from mauve_rt.errors import one_line
from mauve_rt.node.shared.discovery import RANGE, is_off, limit_discovery, opened_by
from mauve_rt.node.shared.domain import domain, domain_problem
from mauve_rt.node.shared.loopback import (
    LoopbackError,
    loopback_environment,
    users_profile,
    waiting_transport,
)
from mauve_rt.node.shared.rtps_ports import participants_by_domain

_DISTRIBUTION = "jazzy"
_PAGE = "docs/several_machines.md"
_PROGRAM = "mauve_rt.doctor.exchange_process"
EXCHANGE_S, _END_S = 20.0, 5.0


def check_distribution(_computer: Computer) -> Iterator[Finding]:
    """ROS 2, and its distribution."""
    named = os.environ.get("ROS_DISTRO", "")
    spec = find_spec("rclpy")
    if spec is None or spec.origin is None:
        yield error(
            "no rclpy is found",
            cost="executors, supervisors and most verbs of mauve do not start",
            remedy="source install/setup.bash, or /opt/ros/jazzy/setup.bash before it",
        )
    elif named not in ("", _DISTRIBUTION):
        yield error(
            f"ROS_DISTRO={named}",
            cost=f"MAUVE RT is built for ROS 2 {_DISTRIBUTION.capitalize()}: both do not fit together",
            remedy=f"open a new shell and source /opt/ros/{_DISTRIBUTION}/setup.bash only",
        )
    else:
        yield ok(f"{_DISTRIBUTION}, rclpy of {Path(spec.origin).parents[1]}")


def check_middleware(_computer: Computer) -> Iterator[Finding]:
    """The ROS middleware, and whether it can be kept on this computer."""
    name = os.environ.get("RMW_IMPLEMENTATION") or "rmw_fastrtps_cpp, the default"
    try:
        limit_discovery()  # as each program of the project does
        loopback_environment()
    except LoopbackError as problem:
        yield error(
            str(problem),
            cost="executors refuse to start",
            remedy="export RMW_IMPLEMENTATION=rmw_fastrtps_cpp",
        )
    else:
        yield ok(name)


def check_reach(_computer: Computer) -> Iterator[Finding]:
    """Profiles and variables that let other computers in, or that keep everything out."""
    limit_discovery()
    if problem := domain_problem():
        yield error(problem, cost="no program of ROS starts", remedy="export ROS_DOMAIN_ID=0")
        return
    if is_off():
        cost = "mauve, supervisors and other nodes find no executor"
        yield warning(f"{RANGE}=OFF", cost=cost, remedy=f"export {RANGE}=LOCALHOST")
    elif opened := opened_by():
        cost = "without DDS Security any computer that reaches this one can reconfigure an executor"
        yield warning(
            f"open to other computers ({opened})",
            cost=cost,
            remedy=f"unset {opened_names(opened)}, or: {_PAGE}",
        )
    elif profile := users_profile():
        cost = "this profile decides which computers reach an executor, and an executor may refuse to start"
        yield warning(f"a profile of your own ({profile})", cost=cost, remedy=_PAGE)
    else:
        yield ok(f"this computer only, ROS_DOMAIN_ID {domain()}")
    if users_profile() and (waits := waiting_transport()):
        cost = "a network interface that stands still can delay every message, also on this computer"
        yield warning(waits, cost=cost, remedy=_PAGE)


def opened_names(opened: str) -> str:
    """The names of the variables in `A=x, B=y`."""
    return " ".join(re.findall(r"(?:^|, )([A-Z_]+)=", opened))


def check_discovery(_computer: Computer) -> Iterator[Finding]:
    """A message from one process to another, in the domain of this shell."""
    if domain_problem() or is_off():
        yield warning(
            "not tried: discovery is off, or ROS_DOMAIN_ID is no domain",
            cost="no node finds another one",
            remedy=f"export {RANGE}=LOCALHOST ROS_DOMAIN_ID=0",
        )
        return
    where = f"ROS_DOMAIN_ID {domain()}"
    status, output, problem = exchange(EXCHANGE_S)
    if status == 0:
        yield ok(f"a message arrived in {where} {float(output):.2f} s after its receiver started")
    else:
        network = f"sudo ip link set lo up; no firewall on 127.0.0.1; {_PAGE}"
        yield error(
            f"no message arrived in {where}: {one_line(problem) or f'waited for {EXCHANGE_S:g} s'}",
            cost="mauve and supervisors do not reach executors, and topics carry nothing",
            remedy="correct what this line says" if problem else network,
        )


def exchange(limit_s: float) -> tuple[int, str, str]:
    """Start a sender and a receiver; the receiver's exit status, its output and its last line of stderr."""
    topic = f"/mauve_doctor_{os.getpid()}_{os.urandom(4).hex()}"
    command = [sys.executable, "-P", "-m", _PROGRAM]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(entry for entry in sys.path if entry)}
    words = (topic, f"{limit_s}")
    sender = subprocess.Popen(
        [*command, "send", *words], env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        done = subprocess.run(
            [*command, "receive", *words],
            env=environment,
            capture_output=True,
            text=True,
            timeout=2 * limit_s,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return 1, "", "the receiver hangs"
    finally:
        _end(sender)
    return done.returncode, done.stdout, (done.stderr.strip().splitlines() or [""])[-1]


def _end(sender: "subprocess.Popen[bytes]") -> None:
    """Let it remove its shared memory."""
    sender.terminate()
    try:
        sender.wait(_END_S)
    except subprocess.TimeoutExpired:
        sender.kill()
        sender.wait()


def check_participants(computer: Computer) -> Iterator[Finding]:
    """ROS domains that processes of this computer are in, by their UDP ports."""
    domains = participants_by_domain(computer.path("/proc/net/udp"))
    own = None if domain_problem() else domain()
    text = ", ".join(
        f"{counted(count, 'participant')} in domain {number}{' (this shell)' if number == own else ''}"
        for number, count in domains.items()
    )
    yield ok(text or "no participant")
