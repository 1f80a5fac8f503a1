"""The demo, shortened: what it says, what it writes, and that both agree with the bags."""

import json
import os
import re
import struct
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from bag_reading import messages, topics
from bag_rules import assert_rosbag2_reads
from demo_harness import DOMAIN, Demo, Starter

LOCAL, USUAL = "mauve_examples/LocalExploration", "mauve_examples/Exploration"
ROBOTS = ("robot_1", "robot_2")
SHORT = ("--duration", "25", "--link-loss-at", "6", "--link-back-at", "14")


@pytest.fixture(scope="module")
def mission(start_once: Starter) -> Demo:
    demo = start_once(*SHORT)
    demo.finish()
    return demo


@pytest.fixture(scope="module")
def summary(mission: Demo) -> dict[str, Any]:
    return json.loads((mission.out / "summary.json").read_text(encoding="utf-8"))


def test_it_succeeds_and_says_so(mission: Demo, summary: dict[str, Any]):
    assert summary["reasons"] == []
    assert mission.status == 0
    assert mission.errors == ""
    text = "\n".join(mission.lines)
    assert "SUCCESS." in text
    assert re.search(r"6\.\d s  the radio link is LOST", text)
    assert re.search(r"14\.\d s  the radio link is back", text)
    for robot in ROBOTS:
        assert f"{robot}: exploration: Exploration -> LocalExploration, blackout " in text
        assert f"{robot}: exploration: LocalExploration -> Exploration, blackout " in text
    assert mission.processes() == {}


def test_it_writes_what_it_promises(mission: Demo):
    assert {path.name for path in mission.out.iterdir()} >= {"summary.json", "report.html", "bag", "log"}
    assert list(mission.out.glob("*.png"))
    page = (mission.out / "report.html").read_text(encoding="utf-8")
    assert "http://" not in page.replace("http://www.w3.org", "")
    assert "https://" not in page.replace("https://www.w3.org", "")
    for kind in ("architecture", "supervisor"):
        assert {path.stem for path in (mission.out / kind).glob("*.yaml")} == set(ROBOTS)


def test_the_summary_tells_of_both_swaps_of_every_robot(summary: dict[str, Any]):
    for robot in ROBOTS:
        swaps = summary["robots"][robot]["reconfigurations"]
        assert [(swap["component"], swap["from"], swap["to"]) for swap in swaps] == [
            ("exploration", USUAL, LOCAL),
            ("exploration", LOCAL, USUAL),
        ]
        there, back = swaps
        assert there["cause"].startswith(f"link_lost: nothing on /{robot}/radio/in for ")
        assert there["silence_ms"] > 1000.0
        assert back["silence_ms"] is None, "the silence is over"
        for swap in swaps:
            assert swap["decided_by"] == f"/{robot}/executor"
            assert swap["took_ms"] > 0.0
            assert swap["bound_ms"] > 0.0
        for swap in swaps:
            assert swap["prepare_us"] > 0.0
            assert swap["blackout_us"] > 0.0
            assert swap["missed_releases"] == 0
            assert swap["phase_nominal_ns"] == 0


def test_coverage_is_a_share_and_grew(mission: Demo, summary: dict[str, Any]):
    assert summary["success"], "one that explored nothing without the link would have failed"
    coverage = summary["coverage"]
    assert set(coverage) == {*ROBOTS, "union"}
    assert all(0.0 < share <= 1.0 for share in coverage.values())
    assert coverage["union"] >= max(coverage[robot] for robot in ROBOTS)
    together = [int(shown[1]) for line in mission.lines if (shown := re.search(r"together +(\d+)%", line))]
    assert together[-1] > together[0]


def test_the_components_are_those_of_the_paper(summary: dict[str, Any]):
    for robot in ROBOTS:
        components = summary["robots"][robot]["components"]
        assert set(components) == {"robot", "control", "guidance", "mapping", "exploration"}
        for component in components.values():
            assert component["releases"] > 0
            assert component["wakeup_p50_ns"] <= component["wakeup_p99_ns"]
            assert component["policy"] in ("SCHED_FIFO", "SCHED_OTHER")
            assert component["cpus"]
        assert components["robot"]["releases"] > components["control"]["releases"] * 1.5


def test_the_bags_open_and_agree_with_the_summary(mission: Demo, summary: dict[str, Any]):
    for robot in ROBOTS:
        bag = mission.out / "bag" / robot
        assert_rosbag2_reads(bag)
        counts = topics(bag)
        names = (
            "pose",
            "goal",
            "map_updates",
            "executor/events",
            "executor/decisions",
            "supervisor/decisions",
        )
        assert {f"/{robot}/{name}" for name in names} <= counts.keys()
        events = [event for event in messages(bag, f"/{robot}/executor/events") if event.to_core]
        swaps = summary["robots"][robot]["reconfigurations"]
        assert [(event.from_core, event.to_core) for event in events] == [(s["from"], s["to"]) for s in swaps]
        assert [event.cause for event in events] == [swap["cause"] for swap in swaps]
        for event, swap in zip(events, swaps, strict=True):
            assert event.report[0].blackout_ns / 1e3 == pytest.approx(swap["blackout_us"], abs=1.0)
            assert event.requested_by == f"/{robot}/executor"
        decisions = [decision.decision for decision in messages(bag, f"/{robot}/executor/decisions")]
        assert decisions[-6:] == ["condition_true", "do", "done", "condition_false", "undo", "done"]


def test_real_time_rights_are_told(mission: Demo, summary: dict[str, Any]):
    realtime = summary["realtime"]
    assert realtime["granted"] == (realtime["missing"] == [])
    text = "\n".join(mission.lines)
    assert all(line in text for line in realtime["missing"])


def test_the_logs_have_no_traceback(mission: Demo):
    logs = {path.stem: path.read_text(encoding="utf-8") for path in (mission.out / "log").glob("*.log")}
    assert len(logs) == 5
    assert not [name for name, text in logs.items() if "Traceback" in text]


def test_without_supervisors_the_robots_stall(start: Starter):
    long = ("--duration", "36", "--link-loss-at", "6", "--link-back-at", "30")
    demo = start(*long, "--no-supervisor")
    assert demo.finish() == 1
    summary = json.loads((demo.out / "summary.json").read_text(encoding="utf-8"))
    assert summary["success"] is False
    assert all(robot["reconfigurations"] == [] for robot in summary["robots"].values())
    assert "FAILED:" in demo.lines
    # They end what they were about when the link was lost, then they stand.
    down = [re.search(r"together +(\d+)%", line) for line in demo.lines if "link DOWN" in line]
    late = [int(match[1]) for match in down[-2:] if match]
    assert late[0] == late[-1]
    assert demo.processes() == {}


def test_one_robot_needs_no_radio(start: Starter):
    demo = start("--robots", "1", "--duration", "6", "--map", "room")
    assert demo.finish() == 0
    summary = json.loads((demo.out / "summary.json").read_text(encoding="utf-8"))
    assert set(summary["coverage"]) == {"robot_1", "union"}
    assert summary["robots"]["robot_1"]["reconfigurations"] == []


def test_the_command_it_offers_works_in_another_terminal(start: Starter):
    """One that nothing was sourced in."""
    demo = start("--robots", "1", "--duration", "60", "--map", "room")
    command = demo.wait_for("from another terminal: ").partition("terminal: ")[2]
    bare = {"PATH": os.defpath, "HOME": str(demo.out.parent), "ROS_DOMAIN_ID": str(DOMAIN)}
    done = subprocess.run(["bash", "-c", command], env=bare, capture_output=True, text=True, check=False)
    assert done.returncode == 0, command + done.stderr
    assert "mauve_examples/Exploration" in done.stdout
    assert demo.interrupt() == 130


def shared_map(name: str) -> Path:
    """A map of the folder beside the clone, where there is one."""
    path = Path(__file__).resolve().parents[3].parent / "shared" / "maps" / name
    if not path.exists():
        pytest.skip(f"no {name} in shared/maps beside the clone")
    return path


@pytest.mark.parametrize("name", ["depot.yaml", "tb3_sandbox.yaml"])
def test_maps_of_others_work_as_they_are(start: Starter, name: str):
    demo = start("--simulated-time", "--map", str(shared_map(name)), *SHORT)
    assert demo.finish() == 0, demo.lines[-8:]


def room() -> tuple[int, int, bytes]:
    """Width, height and greys of the project's room."""
    content = (Path(__file__).resolve().parents[2] / "maps" / "room.pgm").read_bytes()
    _, _, size, _, pixels = content.split(b"\n", 4)
    width, height = map(int, size.split())
    return width, height, pixels


def write_as_slam_does(folder: Path) -> Path:
    """The room as a SLAM tool saves it: far more unknown cells around it than it has, in the walls, too."""
    width, height, pixels = room()
    margin, unknown = 60, b"\xcd"
    across = unknown * (width + 2 * margin)
    rows = [pixels[row * width : (row + 1) * width] for row in range(height)]
    walled = [row.replace(b"\0" * 8, b"\0\0" + unknown * 4 + b"\0\0") for row in rows]
    content = b"".join(
        [across * margin, *(unknown * margin + row + unknown * margin for row in walled), across * margin]
    )
    size = f"{width + 2 * margin} {height + 2 * margin}"
    header = f"P5\n# CREATOR: map_saver 0.050 m/pix\n{size}\n255\n"
    (folder / "m.pgm").write_bytes(header.encode() + content)
    text = "image: ./m.pgm\nmode: trinary\nresolution: 0.05\norigin: [-12.25, -8.5, 0]\nnegate: 0\n"
    (folder / "m.yaml").write_text(text + "occupied_thresh: 0.65\nfree_thresh: 0.25\n", encoding="utf-8")
    return folder / "m.yaml"


def write_turned_bmp(folder: Path) -> Path:
    """The project's room as a BMP of 8 bits, in mode scale and with a yaw."""
    width, height, pixels = room()
    rows = [pixels[row * width : (row + 1) * width] + bytes(-width % 4) for row in range(height)]
    palette = b"".join(bytes((grey, grey, grey, 0)) for grey in range(256))
    info = struct.pack("<IiiHHIIiiII", 40, width, -height, 1, 8, 0, 0, 0, 0, 256, 0)
    content = info + palette + b"".join(rows)
    start = 14 + len(info) + len(palette)
    (folder / "m.bmp").write_bytes(b"BM" + struct.pack("<IHHI", 14 + len(content), 0, 0, start) + content)
    text = "image: m.bmp\nmode: Scale\nresolution: 0.05\norigin: [-6.0, -4.0, 0.4]\nnegate: False\n"
    (folder / "m.yaml").write_text(text + "occupied_thresh: 0.65\nfree_thresh: 0.196\n", encoding="utf-8")
    return folder / "m.yaml"


@pytest.mark.parametrize("write", [write_as_slam_does, write_turned_bmp])
def test_maps_as_tools_write_them_work(start: Starter, write: Callable[[Path], Path]):
    demo = start("--simulated-time", "--map", str(write(start.folder)), *SHORT)
    assert demo.finish() == 0, demo.lines[-8:]


def test_its_rules_replayed_do_what_they_did(mission: Demo, tmp_path: Path):
    rules, bag = mission.out / "supervisor" / "robot_1.yaml", mission.out / "bag" / "robot_1"
    same, is_same = replayed(rules, bag)
    assert [*same] == ["do", "undo"]
    lateness_s = [then_s - replayed_s for then_s, replayed_s in same.values()]
    assert min(lateness_s) > -_REPLAY_TOLERANCE_S, (
        "it never acts before its rules say so; a busy machine delays it"
    )
    assert is_same == (max(lateness_s) <= _REPLAY_TOLERANCE_S)
    other = tmp_path / "other.yaml"
    other.write_text(rules.read_text(encoding="utf-8").replace("longer_than_s: 1.75", "longer_than_s: 2.45"))
    differing, is_same = replayed(other, bag)
    assert not is_same
    assert differing["do"][1] - same["do"][1] == pytest.approx(0.7, abs=0.01), "of one bag, whatever was late"


_REPLAY_TOLERANCE_S = 0.1


def replayed(rules: Path, bag: Path) -> tuple[dict[str, tuple[float, float]], bool]:
    """Instants of each act of the rule, then and replayed, and whether the command calls them the same."""
    command = [sys.executable, "-m", "mauve_rt.cli", "rules", "replay", rules, bag]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.stderr == ""
    row = r"^link_lost +(\w+) +([\d.]+) +([\d.]+) +([+-][\d.]+)(?:  differs)?$"
    found = re.findall(row, done.stdout, re.MULTILINE)
    differing = done.stdout.count("  differs\n")
    assert done.stdout.endswith(f"rules: 1, actions: {len(found)}, differing: {differing}\n")
    assert done.returncode == (1 if differing else 0)
    return {act: (float(then), float(when)) for act, then, when, _ in found}, not differing
