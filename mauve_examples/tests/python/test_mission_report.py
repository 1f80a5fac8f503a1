"""Summary and report of a mission, from bags of a mission that never was: every figure in them is known."""

import json
import os
import shutil
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from synthetic_mission import (
    ALONE,
    BLACKOUT_NS,
    PEERS,
    PREPARE_NS,
    SILENCE_S,
    WAKEUP_NS,
    S,
    make_mission,
    office,
)

from mauve_examples.mission.evidence import CoverageHistory, read_robot, replay_coverage
from mauve_examples.mission.facts import MissionArea, MissionFacts
from mauve_examples.mission.results import write_results
from mauve_examples.mission.summary import build_summary, failure_reasons
from mauve_examples.mission.swaps import find_swaps


@pytest.fixture(scope="module")
def installed_messages(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    prefix = tmp_path_factory.mktemp("prefix")
    sources = Path(__file__).parents[3] / "mauve_msgs" / "msg"
    shutil.copytree(sources, prefix / "share" / "mauve_msgs" / "msg")
    with pytest.MonkeyPatch.context() as patch:
        before = os.environ.get("AMENT_PREFIX_PATH", "")
        patch.setenv("AMENT_PREFIX_PATH", os.pathsep.join(filter(None, (str(prefix), before))))
        yield


@dataclass
class Mission:
    out: Path
    area: MissionArea
    facts: MissionFacts


@pytest.fixture(scope="module")
def mission(tmp_path_factory: pytest.TempPathFactory, installed_messages: None) -> Mission:
    out = tmp_path_factory.mktemp("mission")
    area = office(120, 80)
    return Mission(out, area, make_mission(out, area, (4.0, 8.0, 14.0)))


@pytest.fixture(scope="module")
def summary(mission: Mission) -> dict[str, Any]:
    return write_results(mission.out, mission.facts, area=mission.area)


def judge(mission: Mission, **changes: Any) -> dict[str, Any]:
    """The summary of the same bags with other facts."""
    facts = replace(mission.facts, **changes)
    evidence = [read_robot(mission.out / "bag" / robot, robot, facts) for robot in facts.robots]
    return build_summary(facts, evidence, replay_coverage(facts, mission.area, evidence))


def test_the_summary_tells_what_was_measured(mission: Mission, summary: dict[str, Any]):
    assert summary["success"], summary["reasons"]
    assert json.loads((mission.out / "summary.json").read_text()) == summary
    assert summary["realtime"] == {"granted": True, "missing": []}
    away, back = summary["robots"]["robot_1"]["reconfigurations"]
    assert away == {
        "component": "exploration",
        "from": PEERS,
        "to": ALONE,
        "cause": "link_lost: peer silent for 1.0 s",
        "silence_ms": SILENCE_S * 1e3,
        "decided_by": "/robot_1/supervisor",
        "took_ms": None,
        "bound_ms": None,
        "prepare_us": PREPARE_NS / 1e3,
        "blackout_us": BLACKOUT_NS / 1e3,
        "missed_releases": 0,
        "phase_nominal_ns": 0,
        "phase_actual_ns": WAKEUP_NS,
    }
    assert (back["from"], back["to"], back["silence_ms"]) == (ALONE, PEERS, None)
    control = summary["robots"]["robot_2"]["components"]["control"]
    assert control == {
        "releases": 14 * 50,
        "overruns": 0,
        "wakeup_p50_ns": WAKEUP_NS,
        "wakeup_p99_ns": WAKEUP_NS,
        "policy": "SCHED_FIFO",
        "priority": 70,
        "cpus": [1],
    }


def test_of_decisions_with_the_same_cause_each_swap_has_its_own(mission: Mission):
    evidence = read_robot(mission.out / "bag" / "robot_1", "robot_1", mission.facts)
    away_ns, away = next(one for one in evidence.decisions if one[1].decision == "do")

    def told(after_s: float, took_s: float) -> list[tuple[int, Any]]:
        more = {"rule": away.rule, "reason": away.reason, "bound_s": 1.0, "silence_s": 1.0, "took_s": took_s}
        at_ns = away_ns + round(after_s * S)
        return [
            (at_ns, SimpleNamespace(decision="do", **more)),
            (at_ns + 1, SimpleNamespace(decision="done", **more)),
        ]

    decisions = [*told(-1.5, 0.1), *told(0.0, 0.2), *told(1.5, 0.3)]
    swaps = find_swaps(replace(evidence, decisions=decisions))
    assert [swap.took_ms for swap in swaps] == [200.0, None]


def test_coverage_is_that_of_the_robots_maps(mission: Mission, summary: dict[str, Any]):
    robots = {robot: summary["coverage"][robot] for robot in mission.facts.robots}
    assert all(0 < share < 1 for share in robots.values())
    assert max(robots.values()) < summary["coverage"]["union"] <= min(1.0, sum(robots.values()))


def test_the_report_is_one_page_with_everything_in_it(mission: Mission, summary: dict[str, Any]):
    page = (mission.out / "report.html").read_text(encoding="utf-8")
    assert page.count("data:image/png;base64,") == 2
    assert 'id="timeline"' in page
    for robot in mission.facts.robots:
        assert f"{robot}/exploration" in page
    assert "http://" not in page
    assert "https://" not in page
    assert "Mission succeeded" in page[: page.index("<nav>")]
    assert (
        '<p class="also good">Did the timing hold? Yes: no overrun, no fault' in page[: page.index("<nav>")]
    )
    assert f"{summary['coverage']['union']:.1%}" in page
    assert "no release missed" in page
    for name in ("map.png", "coverage.png"):
        image = (mission.out / name).read_bytes()
        assert image[:8] == b"\x89PNG\r\n\x1a\n"
        assert len(image) > 20_000


def test_a_robot_that_did_not_swap_is_a_failure(mission: Mission):
    early = mission.facts.started_ns
    found = judge(mission, link_down_ns=[(early, early + S)])
    assert not found["success"]
    assert "robot_1: exploration was not replaced while the link was down" in found["reasons"]


def test_a_robot_that_did_not_swap_back_is_a_failure(mission: Mission):
    start, _ = mission.facts.link_down_ns[0]
    found = judge(mission, link_down_ns=[(start, mission.facts.ended_ns)])
    assert not found["success"]
    assert f"robot_2: exploration was not swapped back to {PEERS} after the link's return" in found["reasons"]


def test_without_planned_swaps_there_need_be_none(mission: Mission):
    early = mission.facts.started_ns
    assert judge(mission, link_down_ns=[(early, early + S)], expected_swaps=False)["success"]
    assert judge(mission, link_down_ns=[], expected_swaps=False)["success"]


def test_a_fault_is_a_failure_and_said_as_it_is(mission: Mission):
    found = judge(mission, faults=["robot_1/control: std::runtime_error, out of range"])
    assert found["reasons"] == ["robot_1/control: std::runtime_error, out of range"]


def test_no_progress_without_the_link_is_a_failure(mission: Mission):
    late = mission.facts.ended_ns + 100 * S
    found = judge(mission, link_down_ns=[(late, late + S)], expected_swaps=False)
    assert found["reasons"] == ["the robots together explored nothing while the link was down"]


def test_on_a_map_already_whole_nothing_new_can_be_found(mission: Mission):
    late = mission.facts.ended_ns + 100 * S
    facts = replace(mission.facts, link_down_ns=[(late, late + S)], expected_swaps=False)
    whole = CoverageHistory(
        time_s=np.array([0.0]), robots={}, union=np.array([1.0]), explored={}, first=np.zeros((1, 1), np.intp)
    )
    assert failure_reasons(facts, [], whole, {}) == []


def test_a_missing_bag_is_a_reason_not_an_error(mission: Mission, tmp_path: Path):
    shutil.copytree(mission.out / "bag" / "robot_1", tmp_path / "bag" / "robot_1")
    found = write_results(tmp_path, mission.facts, area=mission.area)
    assert not found["success"]
    assert any(reason.startswith("robot_2: bag ") for reason in found["reasons"])
    assert "Why it failed" in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_no_bag_at_all_still_gives_a_report(mission: Mission, tmp_path: Path):
    found = write_results(tmp_path, mission.facts, area=mission.area)
    assert found["coverage"] == {"robot_1": 0.0, "robot_2": 0.0, "union": 0.0}
    assert (tmp_path / "report.html").exists()


def test_text_from_the_mission_is_escaped(mission: Mission, tmp_path: Path):
    facts = replace(mission.facts, faults=["<script>alert(1)</script>"])
    write_results(tmp_path, facts, area=mission.area)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "<script>alert" not in page
    assert "&lt;script&gt;alert(1)&lt;/script&gt;" in page
