"""How far discovery reaches, as the environment says it."""

import os

import pytest

from mauve_rt.node.shared.discovery import limit_discovery

RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
HERE = f"discovery on this machine only; {RANGE} can widen it"
BEYOND = "discovery beyond this machine"


@pytest.mark.parametrize(
    ("said", "reach", "told"),
    [
        ({}, "LOCALHOST", HERE),
        ({RANGE: ""}, "LOCALHOST", HERE),
        ({"ROS_LOCALHOST_ONLY": "0"}, "LOCALHOST", HERE),
        ({RANGE: "LOCALHOST"}, "LOCALHOST", ""),
        ({RANGE: "OFF", "ROS_STATIC_PEERS": "10.0.0.7"}, "OFF", ""),
        ({RANGE: "SUBNET"}, "SUBNET", f"{BEYOND} ({RANGE}=SUBNET)"),
        ({RANGE: "SYSTEM_DEFAULT"}, "SYSTEM_DEFAULT", f"{BEYOND} ({RANGE}=SYSTEM_DEFAULT)"),
        (
            {"ROS_STATIC_PEERS": "10.0.0.7"},
            "LOCALHOST",
            f"{BEYOND} ({RANGE}=LOCALHOST, ROS_STATIC_PEERS=10.0.0.7)",
        ),
        # To rcl this one is above all others.
        ({"ROS_LOCALHOST_ONLY": "1", RANGE: "SUBNET"}, "SUBNET", ""),
        ({"ROS_LOCALHOST_ONLY": "1"}, None, ""),
    ],
)
def test_what_the_environment_says_holds(
    said: dict[str, str], reach: str | None, told: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in (RANGE, "ROS_LOCALHOST_ONLY", "ROS_STATIC_PEERS"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv(RANGE, "")  # so that what the call sets is undone
    monkeypatch.delenv(RANGE)
    for name, value in said.items():
        monkeypatch.setenv(name, value)
    answer = limit_discovery()
    assert (told in answer) if told else answer == ""
    assert os.environ.get(RANGE) == reach
