"""The demo in simulated time: the results of the real one, faster, and the same bits for equal seeds."""

import json
import os
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from bag_reading import messages, topics
from bag_rules import assert_rosbag2_reads
from demo_harness import Demo, Starter
from rosbags.highlevel import AnyReader
from scipy.spatial.transform import Rotation

from mauve_rt.trace.reading.reader import open_trace

LOCAL, USUAL = "mauve_examples/LocalExploration", "mauve_examples/Exploration"
ROBOTS = ("robot_1", "robot_2")
TIMES = ("--duration", "16", "--link-loss-at", "4", "--link-back-at", "8")
SHORT = ("--simulated-time", *TIMES, "--drop-share", "0.1")


def simulate(start: Starter, name: str, *arguments: str) -> Demo:
    demo = start(*SHORT, *arguments, out=start.folder / name)
    demo.finish()
    return demo


def records(demo: Demo, robot: str) -> bytes:
    of_components = open_trace(demo.out / "bag" / robot).records
    return b"".join(name.encode() + rows.tobytes() for name, rows in of_components.items())


def contents(demo: Demo, robot: str) -> list[tuple[str, int, object]]:
    """Every message: as bytes, or in words where rclpy serialized it, which leaves padding as it finds it."""
    words = ("executor/state", "executor/events", "supervisor/decisions", "radio/link")
    with AnyReader([demo.out / "bag" / robot]) as reader:
        return [
            (
                connection.topic,
                time_ns,
                str(reader.deserialize(data, connection.msgtype))
                if connection.topic.endswith(words)
                else data,
            )
            for connection, time_ns, data in reader.messages()
        ]


def timed(bag: Path, topic: str) -> dict[int, Any]:
    """The messages of a topic by their times."""
    with AnyReader([bag]) as reader:
        connections = [connection for connection in reader.connections if connection.topic == topic]
        return {
            time_ns: reader.deserialize(data, connection.msgtype)
            for connection, time_ns, data in reader.messages(connections)
        }


def figures(demo: Demo) -> dict[str, Any]:
    summary: dict[str, Any] = json.loads((demo.out / "summary.json").read_text(encoding="utf-8"))
    return summary


@pytest.fixture(scope="module")
def mission(start_once: Starter) -> Demo:
    return simulate(start_once, "first")


def test_it_succeeds_without_any_process_of_its_own(mission: Demo):
    assert mission.status == 0, mission.lines[-5:]
    assert mission.errors == ""
    assert not (mission.out / "log").exists()
    assert {path.name for path in mission.out.iterdir()} >= {"summary.json", "report.html", "bag"}
    text = "\n".join(mission.lines)
    assert "SUCCESS." in text
    assert "   4.0 s  the radio link is LOST" in text
    assert "   8.0 s  the radio link is back" in text


def test_its_last_words_work_in_the_shell_it_was_started_from(mission: Demo):
    """One that nothing was sourced in, as after scripts/demo."""
    first = mission.lines.index("To look closer:")
    commands = "\n".join(["set -e", *mission.lines[first + 1 :]])
    bare = {"PATH": os.defpath, "HOME": str(mission.out.parent)}
    done = subprocess.run(
        ["bash", "-c", commands], env=bare, capture_output=True, text=True, check=False, cwd="/"
    )
    assert done.returncode == 0, commands + done.stderr
    page = (mission.out / "bag" / "report.html").read_text(encoding="utf-8")
    assert all(f"{robot}/exploration" in page for robot in ROBOTS)
    assert "exploration" in done.stdout


def test_both_robots_swap_there_and_back_and_miss_nothing(mission: Demo):
    for robot in ROBOTS:
        there, back = figures(mission)["robots"][robot]["reconfigurations"]
        assert (there["from"], there["to"]) == (USUAL, LOCAL)
        assert (back["from"], back["to"]) == (LOCAL, USUAL)
        assert there["cause"].startswith(f"link_lost: nothing on /{robot}/radio/in for ")
        assert there["silence_ms"] > 1000.0
        for swap in (there, back):
            assert swap["missed_releases"] == 0
            assert swap["phase_nominal_ns"] == 0
            assert swap["phase_actual_ns"] == 0


def test_the_bags_hold_what_those_of_the_real_demo_hold(mission: Demo):
    own = ("pose", "odometry", "goal", "done", "map_updates", "radio/out", "radio/in", "supervisor/decisions")
    executor = (
        "executor/state",
        "executor/events",
        "executor/decisions",
        "executor/trace/batches",
        "executor/trace/names",
    )
    for robot in ROBOTS:
        bag = mission.out / "bag" / robot
        assert_rosbag2_reads(bag)
        assert {
            *(f"/{robot}/{name}" for name in own + executor),
            "/radio/link",
            "/tf",
            "/tf_static",
        } <= topics(bag).keys()
        decisions = [one.decision for one in messages(bag, f"/{robot}/executor/decisions")]
        assert decisions[-6:] == ["condition_true", "do", "done", "condition_false", "undo", "done"]


def matrix(transform: Any) -> npt.NDArray[np.float64]:
    """Of a geometry_msgs/msg/Transform."""
    found = np.eye(4)
    at, turn = transform.translation, transform.rotation
    found[:3, :3] = Rotation.from_quat([turn.x, turn.y, turn.z, turn.w]).as_matrix()
    found[:3, 3] = at.x, at.y, at.z
    return found


def test_the_frames_are_those_of_the_poses(mission: Demo):
    for robot in ROBOTS:
        bag = mission.out / "bag" / robot
        [fixed] = messages(bag, "/tf_static")
        static = {
            (each.header.frame_id, each.child_frame_id): matrix(each.transform) for each in fixed.transforms
        }
        assert static.keys() == {("map", f"{robot}/odom"), (f"{robot}/base", f"{robot}/scan")}
        poses = timed(bag, f"/{robot}/pose")
        moving = timed(bag, "/tf")
        assert moving.keys() == poses.keys()
        assert len(poses) > 1000
        for time_ns, message in moving.items():
            [base] = message.transforms
            assert (base.header.frame_id, base.child_frame_id) == (f"{robot}/odom", f"{robot}/base")
            stamp = base.header.stamp
            assert stamp.sec * 1_000_000_000 + stamp.nanosec == time_ns
            odom, scan = static["map", f"{robot}/odom"], static[f"{robot}/base", f"{robot}/scan"]
            found = odom @ matrix(base.transform) @ scan
            pose = poses[time_ns]
            expected = np.eye(4)
            expected[:3, :3] = Rotation.from_euler("z", pose.theta).as_matrix()
            expected[:2, 3] = pose.x, pose.y
            np.testing.assert_allclose(found, expected, atol=1e-9)


def test_the_components_kept_their_grids(mission: Demo):
    """In virtual time there is no jitter: every release on its instant, and as many as the periods say."""
    summary = figures(mission)
    for robot in ROBOTS:
        components = summary["robots"][robot]["components"]
        assert {one["overruns"] for one in components.values()} == {0}
        assert {one["wakeup_p99_ns"] for one in components.values()} == {0}
        assert components["robot"]["releases"] > 10 * components["exploration"]["releases"]


def test_it_says_how_fast_it_was(mission: Demo):
    run = figures(mission)["simulation"]
    assert run["virtual_s"] == pytest.approx(16.0) or run["virtual_s"] < 16.0
    assert run["speed_up"] == pytest.approx(run["virtual_s"] / run["wall_s"])
    assert any("times as fast as real time" in line for line in mission.lines)


def test_equal_seeds_make_equal_traces_and_figures(mission: Demo, start: Starter):
    again = simulate(start, "again")
    for robot in ROBOTS:
        assert len(records(mission, robot)) > 100_000
        assert records(again, robot) == records(mission, robot)
        assert contents(again, robot) == contents(mission, robot)
    first, second = figures(mission), figures(again)
    assert first.pop("simulation").keys() == second.pop("simulation").keys()
    assert first == second


def test_another_seed_makes_another_mission(mission: Demo, start: Starter):
    other = simulate(start, "other", "--seed", "2")
    for robot in ROBOTS:
        assert records(other, robot) != records(mission, robot)


def test_without_supervisors_it_fails(start: Starter):
    demo = simulate(start, "alone", "--no-supervisor")
    assert demo.status == 1
    assert "exploration was not replaced while the link was down" in "\n".join(demo.lines)


def test_without_supervisors_it_shows_what_they_would_have_saved(mission: Demo, start: Starter):
    """The comparison is the very mission that has them: same map, seed and times."""
    demo = simulate(start, "alone", "--no-supervisor")
    saved = figures(demo)["supervisors_saved"]
    assert (saved["without"], saved["with"]) == ("simulated", "simulated")
    assert saved["link_down_s"] == pytest.approx(4.0, abs=0.1)
    assert saved["explored_while_down"]["with"] >= saved["explored_while_down"]["without"]
    for robot in ROBOTS:
        compared = demo.out / "with_supervisors" / "bag" / robot
        assert_rosbag2_reads(compared)
        assert open_trace(compared).records["exploration"].tobytes() == (
            open_trace(mission.out / "bag" / robot).records["exploration"].tobytes()
        )
        assert 0.0 <= saved["stood_still_s"][robot] <= 4.0
    text = "\n".join(demo.lines)
    assert "What supervisors would have saved:" in text
    assert "With supervisors, same map and seed, they would have explored +" in text
    page = (demo.out / "report.html").read_text(encoding="utf-8")
    assert "What supervisors would have saved" in page
    assert (demo.out / "supervisors.png").read_bytes()[1:4] == b"PNG"
    assert figures(mission)["supervisors_saved"] is None
    assert not (mission.out / "with_supervisors").exists()


def test_it_says_whether_robots_ran_into_each_other(mission: Demo):
    found = figures(mission)["collisions"]
    assert (found["events"], found["pair_seconds"]) == (0, 0)
    assert found["nearest_m"] > 0.4
    assert any(line.startswith("Collisions: none; ") for line in mission.lines)


def test_it_refuses_what_makes_no_sense(start: Starter, tmp_path: Path):
    for arguments in (("--simulated-time=yes",), ("--simulated-time", "--link-back-at", "1")):
        demo = start(*arguments, out=tmp_path / "refused")
        assert demo.finish() == 2
        assert demo.errors.count("\n") == 1
        assert not demo.out.exists()
