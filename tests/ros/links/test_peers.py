"""Two machines that find each other by ROS_STATIC_PEERS, without multicast."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from needed_hosts import hosts_or_skip
from ros_processes import PATIENCE_S, ExecutorProcess

from mauve_examples.mission.hosts import ADDRESS, Hosts
from mauve_rt.cli.verb import BAD_USAGE
from mauve_rt.parts.ament_index import share_folder


@pytest.fixture
def hosts() -> Iterator[Hosts]:
    with hosts_or_skip():
        made = Hosts(["robot", "desk"])
    yield made
    made.close()


@pytest.fixture
def executor(hosts: Hosts, tmp_path: Path) -> Iterator[ExecutorProcess]:
    """On the machine `robot`; nobody but the machine `desk` is a peer of it."""
    share = share_folder("mauve_examples")
    assert share is not None
    process = ExecutorProcess(
        tmp_path,
        {"ROS_STATIC_PEERS": f"{ADDRESS}2"},
        ["-p", f"architecture:={share}/architecture/metronome.yaml"],
        wrapper=hosts.wrapper("robot"),
    )
    yield process
    process.process.kill()
    process.process.wait()


def list_from_desk(hosts: Hosts, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [*hosts.wrapper("desk"), sys.executable, "-P", "-m", "mauve_rt.cli", "list", "/executor"],
        env=os.environ | environment,
        capture_output=True,
        text=True,
        check=False,
        timeout=PATIENCE_S,
    )


def test_peers_that_name_each_other_need_no_multicast(hosts: Hosts, executor: ExecutorProcess) -> None:
    executor.wait_begun()
    found = list_from_desk(hosts, ROS_STATIC_PEERS=f"{ADDRESS}1")
    assert found.returncode == 0, found.stderr + executor.output
    assert "metronome" in found.stdout


def test_it_is_enough_that_one_names_the_other_if_that_one_is_open(
    hosts: Hosts, executor: ExecutorProcess
) -> None:
    """The executor has joined no multicast group: it is found because it asks."""
    executor.wait_begun()
    found = list_from_desk(hosts, ROS_AUTOMATIC_DISCOVERY_RANGE="SUBNET")
    assert found.returncode == 0, found.stderr + executor.output


def test_a_name_that_gets_its_address_after_the_start(hosts: Hosts, tmp_path: Path) -> None:
    """The desk names nobody: it hears of the executor only because that one announces itself later."""
    share = share_folder("mauve_examples")
    names = tmp_path / "hosts"
    names.write_text("127.0.0.1 localhost\n", encoding="utf-8")
    resolving = ("unshare", "-m", "sh", "-c", f'mount --bind {names} /etc/hosts && exec "$@"', "sh")
    process = ExecutorProcess(
        tmp_path,
        {"ROS_STATIC_PEERS": "desk.invalid"},
        ["-p", f"architecture:={share}/architecture/metronome.yaml"],
        wrapper=(*hosts.wrapper("robot"), *resolving),
    )
    try:
        process.await_output("ROS_STATIC_PEERS: no address is found for desk.invalid")
        process.await_output("activated: 1 component")
        missing = list_from_desk(hosts, ROS_AUTOMATIC_DISCOVERY_RANGE="SUBNET")
        assert missing.returncode == BAD_USAGE, missing.stdout
        with names.open("a", encoding="utf-8") as file:
            file.write(f"{ADDRESS}2 desk.invalid\n")
        process.await_output(f"static peer desk.invalid has an address now: {ADDRESS}2")
        found = list_from_desk(hosts, ROS_AUTOMATIC_DISCOVERY_RANGE="SUBNET")
        assert found.returncode == 0, found.stderr + process.output
        assert "metronome" in found.stdout
        assert process.end(signal.SIGTERM)[0] == 0
    finally:
        process.process.kill()
        process.process.wait()
