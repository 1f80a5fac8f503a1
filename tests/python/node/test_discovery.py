"""How far discovery reaches, as the environment says it, and what binds a program to loopback."""

import os
from pathlib import Path

import pytest

from mauve_rt.node.shared import loopback
from mauve_rt.node.shared.discovery import (
    OPEN_PROFILE,
    OPEN_UDP_PROFILE,
    PROFILE,
    PROFILES,
    UDP_PROFILE,
    opened_by,
    stays_on_this_machine,
)
from mauve_rt.node.shared.loopback import LoopbackError, keep_to_this_machine, reach, waiting_transport

RANGE, PEERS, SERVER = "ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_STATIC_PEERS", "ROS_DISCOVERY_SERVER"
ONLY, TRANSPORTS = "ROS_LOCALHOST_ONLY", "FASTDDS_BUILTIN_TRANSPORTS"
OTHERS = ("FASTDDS_DEFAULT_PROFILES_FILE", "RMW_IMPLEMENTATION")
BOUND = {RANGE: "SYSTEM_DEFAULT", PROFILES: str(PROFILE)}
BOUND_BY_UDP = {RANGE: "SYSTEM_DEFAULT", PROFILES: str(UDP_PROFILE)}
OPEN = {RANGE: "SUBNET", PROFILES: str(OPEN_PROFILE)}
OPEN_BY_UDP = {RANGE: "SUBNET", PROFILES: str(OPEN_UDP_PROFILE)}


@pytest.fixture
def environment(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> pytest.MonkeyPatch:
    """Without a word of discovery; what the case sets is undone."""
    for name in (RANGE, PEERS, SERVER, ONLY, TRANSPORTS, PROFILES, *OTHERS):
        monkeypatch.setenv(name, "")  # so that what the code sets is undone
        monkeypatch.delenv(name)
    monkeypatch.chdir(tmp_path)
    return monkeypatch


@pytest.mark.parametrize(
    ("said", "bound", "opened"),
    [
        ({}, BOUND, ""),
        ({RANGE: ""}, BOUND, ""),
        ({ONLY: "0"}, BOUND, ""),
        ({RANGE: "LOCALHOST"}, BOUND, ""),
        ({RANGE: "LOCALHOST", TRANSPORTS: "UDPv4"}, BOUND_BY_UDP, ""),
        ({RANGE: "OFF", PEERS: "10.0.0.7"}, {RANGE: "OFF", PROFILES: str(PROFILE)}, ""),
        ({RANGE: "SUBNET"}, OPEN, f"{RANGE}=SUBNET"),
        ({RANGE: "SUBNET", TRANSPORTS: "UDPv4"}, OPEN_BY_UDP, f"{RANGE}=SUBNET"),
        ({RANGE: "SUBNET", TRANSPORTS: "LARGE_DATA"}, {RANGE: "SUBNET"}, f"{RANGE}=SUBNET"),
        (
            {RANGE: "SYSTEM_DEFAULT"},
            {RANGE: "SYSTEM_DEFAULT", PROFILES: str(OPEN_PROFILE)},
            f"{RANGE}=SYSTEM_DEFAULT",
        ),
        ({PEERS: "10.0.0.7"}, {RANGE: "LOCALHOST"}, f"{RANGE}=LOCALHOST, {PEERS}=10.0.0.7"),
        ({SERVER: "10.0.0.7:11811"}, {RANGE: "LOCALHOST"}, f"{RANGE}=LOCALHOST, {SERVER}=10.0.0.7:11811"),
        # To rcl this one is above all others.
        ({ONLY: "1", RANGE: "SUBNET", PEERS: "10.0.0.7"}, BOUND, ""),
        ({ONLY: "1"}, BOUND, ""),
        # As a parent leaves it to its children.
        (BOUND, BOUND, ""),
        (BOUND_BY_UDP, BOUND, ""),
        (OPEN, OPEN, f"{RANGE}=SUBNET"),
    ],
)
def test_who_stays_on_this_machine_is_bound_to_loopback(
    said: dict[str, str], bound: dict[str, str], opened: str, environment: pytest.MonkeyPatch
) -> None:
    for name, value in said.items():
        environment.setenv(name, value)
    keep_to_this_machine()
    found = {name: os.environ[name] for name in (RANGE, PROFILES) if name in os.environ}
    assert found == bound
    assert opened_by() == opened
    assert stays_on_this_machine() == (bound in (BOUND, BOUND_BY_UDP))
    if stays_on_this_machine():
        assert os.environ.get(ONLY) != "1"


@pytest.mark.parametrize("name", [PROFILES, "FASTDDS_DEFAULT_PROFILES_FILE"])
def test_a_profile_of_the_users_own_is_left_alone(name: str, environment: pytest.MonkeyPatch) -> None:
    environment.setenv(name, "own.xml")
    keep_to_this_machine()
    assert os.environ[RANGE] == "LOCALHOST"
    assert os.environ[name] == "own.xml"


@pytest.mark.parametrize("reach_of", ["LOCALHOST", "SUBNET"])
@pytest.mark.parametrize(
    ("profile", "waits"),
    [
        (PROFILE.read_text("utf-8"), False),
        (PROFILE.read_text("utf-8") + " ", False),
        (PROFILE.read_text("utf-8").replace("<non_blocking_send>true</non_blocking_send>", ""), True),
        ("<dds/>", True),
        (None, True),
    ],
)
def test_a_send_that_may_wait_for_an_interface_is_warned_of(
    reach_of: str, profile: str | None, *, waits: bool, environment: pytest.MonkeyPatch
) -> None:
    environment.setenv(RANGE, reach_of)
    environment.setenv(PROFILES, "own.xml")
    if profile is not None:
        Path("own.xml").write_text(profile, encoding="utf-8")
    keep_to_this_machine()
    assert bool(waiting_transport()) == waits
    if waits:
        assert "own.xml has no <non_blocking_send>true" in waiting_transport()


@pytest.mark.parametrize(("transports", "waits"), [("", False), ("UDPv4", False), ("LARGE_DATA", True)])
def test_transports_of_the_users_own_may_wait(
    transports: str, *, waits: bool, environment: pytest.MonkeyPatch
) -> None:
    environment.setenv(RANGE, "SUBNET")
    environment.setenv(TRANSPORTS, transports)
    keep_to_this_machine()
    assert bool(waiting_transport()) == waits


@pytest.mark.parametrize("name", [PEERS, SERVER])
@pytest.mark.parametrize(("reach_of", "waits"), [("LOCALHOST", True), ("SUBNET", False)])
def test_with_the_range_localhost_a_send_to_peers_may_wait(
    name: str, reach_of: str, *, waits: bool, environment: pytest.MonkeyPatch
) -> None:
    environment.setenv(RANGE, reach_of)
    environment.setenv(name, "10.0.0.7")
    keep_to_this_machine()
    assert waiting_transport().endswith("; set ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET") == waits
    assert bool(waiting_transport()) == waits


def test_so_is_one_in_the_current_folder(environment: pytest.MonkeyPatch) -> None:
    Path("DEFAULT_FASTRTPS_PROFILES.xml").touch()
    keep_to_this_machine()
    assert PROFILES not in os.environ
    assert os.environ[RANGE] == "LOCALHOST"


@pytest.mark.parametrize("middleware", ["rmw_cyclonedds_cpp", "rmw_zenoh_cpp", "rmw_connextdds"])
def test_a_middleware_that_cannot_be_bound_is_refused(
    middleware: str, environment: pytest.MonkeyPatch
) -> None:
    environment.setenv("RMW_IMPLEMENTATION", middleware)
    expected = f"{middleware} cannot .* Set RMW_IMPLEMENTATION=rmw_fastrtps_cpp, or {RANGE}=SUBNET to let "
    with pytest.raises(LoopbackError, match=expected):
        keep_to_this_machine()
    environment.setenv(RANGE, "SUBNET")
    keep_to_this_machine()


def test_a_profile_that_binds_nothing_ends_the_program(environment: pytest.MonkeyPatch) -> None:
    """Whatever the reason, such as another Fast DDS, which reads another variable."""
    keep_to_this_machine()
    environment.setattr(loopback, "udp_sockets", lambda: {"7": "0.0.0.0"})  # noqa: S104 - as of Fast DDS
    with pytest.raises(LoopbackError, match=r"UDP bound to 0\.0\.0\.0 in spite of"):
        reach({})
    assert "no address" in reach({"7": "0.0.0.0"}).text  # noqa: S104 - it was there before
