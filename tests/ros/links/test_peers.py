"""Two machines that find each other by ROS_STATIC_PEERS, without multicast."""

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from ros_processes import PATIENCE_S, ExecutorProcess

from mauve_examples.mission.hosts import ADDRESS, Hosts, HostsError
from mauve_rt.parts.ament_index import share_folder


@pytest.fixture
def hosts() -> Iterator[Hosts]:
    try:
        made = Hosts(["robot", "desk"])
    except HostsError as error:
        pytest.skip(str(error))
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
