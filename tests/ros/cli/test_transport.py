"""Which ports the first participant of a `mauve` command announces itself to."""

import os
import re
import socket
import subprocess
import sys
from collections.abc import Iterator

import pytest
from ros_processes import PATIENCE_S

from mauve_rt.cli.rtps_ports import discovery_ports
from mauve_rt.cli.transport import profile_for_those_present
from mauve_rt.node.shared.discovery import PROFILES, UDP_PROFILE

PARTICIPANT = 7  # its number
CLIENT = """
import os
from mauve_rt.cli.client import connected
with connected(first=True) as client:
    print(os.environ["FASTRTPS_DEFAULT_PROFILES_FILE"], flush=True)
    input()
"""


@pytest.fixture
def other(domain: int) -> Iterator[socket.socket]:
    """The socket at which a participant of this computer receives discovery messages."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as made:
        made.bind(("127.0.0.1", discovery_ports(domain)[PARTICIPANT]))
        made.settimeout(PATIENCE_S)
        yield made


def test_the_profile_reaches_each_participant_and_no_port_beyond(domain: int, other: socket.socket) -> None:
    text = profile_for_those_present(domain)
    assert re.findall(r"<maxInitialPeersRange>(\d+)<", text) == [str(PARTICIPANT + 1)]
    assert text.replace(f"Range>{PARTICIPANT + 1}<", "Range>32<") == UDP_PROFILE.read_text("utf-8")
    other.close()
    assert "<maxInitialPeersRange>1<" in profile_for_those_present(domain)


@pytest.mark.parametrize("hindrance", ["", "import tempfile; tempfile.tempdir = '/proc'"])
def test_a_participant_receives_the_announcement_of_a_command(
    domain: int, other: socket.socket, hindrance: str
) -> None:
    variables = {name: value for name, value in os.environ.items() if name != PROFILES}
    variables |= {"ROS_DOMAIN_ID": str(domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    client = subprocess.Popen(
        [sys.executable, "-c", hindrance + CLIENT],
        env=variables,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert other.recv(1 << 16).startswith(b"RTPS")
    out, err = client.communicate("\n", PATIENCE_S)
    assert (client.returncode, err) == (0, "")
    assert out == f"{UDP_PROFILE}\n", "as children of the command find it"
