"""Robots on machines of their own: their link is a cable that is pulled out; no process is between them."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from bag_reading import messages
from demo_harness import DOMAIN, Starter

from mauve_examples.mission.hosts import Hosts, HostsError

LOCAL, USUAL = "mauve_examples/LocalExploration", "mauve_examples/Exploration"
ROBOTS = ("robot_1", "robot_2")
SHORT = ("--duration", "20", "--link-loss-at", "5", "--link-back-at", "10")


@pytest.fixture
def has_machines() -> None:
    try:
        Hosts([]).close()
    except HostsError as error:
        pytest.skip(str(error))


@pytest.mark.usefixtures("has_machines")
def test_a_real_link_is_cut_for_real(start: Starter) -> None:
    demo = start("--hosts", *SHORT)
    assert f"nsenter --target {demo.process.pid} --net" in demo.wait_for("All have met.")
    running = " ".join(demo.processes().values())
    assert "mission.world" in running
    assert "mission.radio" not in running
    look = ["nsenter", f"--target={demo.process.pid}", "--net", sys.executable, "-m", "mauve_rt.cli"]
    listed = subprocess.run(
        [*look, "list", "/robot_1/executor"],
        env=os.environ | {"ROS_DOMAIN_ID": str(DOMAIN), "ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert listed.returncode == 0, listed.stderr
    demo.wait_for("the radio link is LOST")
    assert demo.finish() == 0, (demo.lines[-30:], demo.errors)
    summary = json.loads((demo.out / "summary.json").read_text(encoding="utf-8"))
    assert summary["reasons"] == []
    for robot, peer in (ROBOTS, ROBOTS[::-1]):
        swaps = summary["robots"][robot]["reconfigurations"]
        assert [(swap["from"], swap["to"]) for swap in swaps] == [(USUAL, LOCAL), (LOCAL, USUAL)]
        assert f"nothing on /{peer}/radio/out for " in swaps[0]["cause"]
        assert swaps[0]["silence_ms"] > 1000.0
        links = [message.data for message in messages(demo.out / "bag" / robot, "/radio/link")]
        assert links == [False, True]
    assert demo.processes() == {}


def test_without_the_right_to_it_one_line_says_so(start: Starter, tmp_path: Path) -> None:
    if shutil.which("setpriv") is None:
        pytest.skip("needs the program `setpriv`, of util-linux")
    without = ["setpriv", "--bounding-set=-sys_admin", "--inh-caps=-sys_admin"]
    if subprocess.run([*without, "true"], check=False, capture_output=True).returncode:
        without = []  # then we have none of it
    demo = [
        sys.executable,
        "-P",
        "-m",
        "mauve_examples.mission.demo",
        "--hosts",
        "--out",
        str(tmp_path / "out"),
    ]
    done = subprocess.run([*without, *demo], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert re.fullmatch(
        r"demo: --hosts: needs the right to make network namespaces \(root\): .+\n", done.stderr
    )
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--robots", "3"), "--hosts --robots 3: expected 2"),
        (("--simulated-time",), "--hosts: leave out --simulated-time"),
        (("--drop-share", "0.1"), "--hosts: leave out --drop-share"),
    ],
)
def test_what_does_not_go_with_it(start: Starter, words: tuple[str, ...], said: str) -> None:
    demo = start("--hosts", *words)
    assert demo.finish() == 2
    assert said in demo.errors
