"""The commands of models: check, analyze, generate and model, before any algorithm exists."""

import json
from pathlib import Path

import pytest
from page_blocks import blocks

from mauve_rt.cli.main import main
from mauve_rt.modelling.loading import load_model

ROOT = Path(__file__).parents[3]
GUIDANCE = ROOT / "tests/python/modelling/guidance.yaml"
ROBOT = """\
mauve: 1
executor: {{wakeup_us: 0, overhead_ns: 0}}
components:
  guidance:
    shell: my_robot/GuidanceShell
    core: my_robot/{core}
    fsm: my_robot/GuidanceFsm
    alternatives: [my_robot/StraightGuidance]
    priority: 60
    cpus: [0]
    properties: {{unit_ms: {unit_ms}}}
resources:
  position: {{kind: shared_data, type: my_robot/msg/Point2D, topic: {{name: position, direction: subscribe}}}}
  goal: {{kind: shared_data, type: my_robot/msg/Point2D}}
  target: {{kind: shared_data, type: my_robot/msg/Point2D}}
connections:
  - [guidance.position, position.read]
  - [guidance.goal, goal.read]
  - [guidance.target, target.write]
"""


@pytest.fixture
def model(tmp_path: Path) -> Path:
    """The paper's Guidance; all its guards have a worst case."""
    path = tmp_path / "model.yaml"
    text = GUIDANCE.read_text(encoding="utf-8")
    straight = "follow_path: 0.2 ms}}"
    assert straight in text
    path.write_text(text.replace(straight, "follow_path: 0.2 ms, has_new_goal: 1 us, has_path: 1 us}}"))
    return path


def robot(folder: Path, *, core: str = "PlannedGuidance", unit_ms: int = 10) -> str:
    path = folder / "robot.yaml"
    path.write_text(ROBOT.format(core=core, unit_ms=unit_ms), encoding="utf-8")
    return str(path)


def test_the_page_shows_the_model_of_the_tests() -> None:
    page = (ROOT / "docs/howto/start_from_a_model.md").read_text(encoding="utf-8")
    shown, *_ = [block.text for block in blocks(page) if block.language == "yaml"]
    whole = GUIDANCE.read_text(encoding="utf-8").partition("\n")[2]
    assert shown.strip() == whole.partition("  GuidancePsm:")[0].strip()


def test_a_model_alone_is_checked(model: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(model)]) == 0
    assert capfd.readouterr().out == f"{model}: 1 shell, 1 core, 2 fsms: no error found\n"
    model.write_text(model.read_text().replace("next: W5", "next: W6"))
    assert main(["check", str(model)]) == 2
    assert capfd.readouterr().err.startswith(f"{model}:32:44: there is no state 'W6'; known: Following")


def test_an_architecture_is_checked_with_a_model(model: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = robot(model.parent)
    assert main(["check", path]) == 2
    assert "package 'my_robot' is not found" in capfd.readouterr().err
    assert main(["check", path, str(model)]) == 0
    assert "1 component, 3 resources, 3 connections: no error found" in capfd.readouterr().out
    Path(path).write_text(Path(path).read_text().replace("guidance.goal", "guidance.gaol"))
    assert main(["check", path, str(model)]) == 2
    assert "component 'guidance' has no port 'gaol'; did you mean goal?" in capfd.readouterr().err


def verdict(path: str, model: Path, capfd: pytest.CaptureFixture[str]) -> tuple[int, dict]:  # type: ignore[type-arg]
    status = main(["analyze", path, "--model", str(model), "--json"])
    return status, json.loads(capfd.readouterr().out)


def test_a_model_alone_is_proved_schedulable(model: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Planning and what is asked before it take 5.204 ms; it is released every 50 ms."""
    status, told = verdict(robot(model.parent), model, capfd)
    assert (status, told["verdict"]["outcome"]) == (0, "schedulable")
    [guidance] = told["components"]
    times = {state["name"]: state["time_ns"] for state in guidance["states"]}
    assert times == {"Idle": 202_000, "Planning": 5_000_000, "Following": 200_000}
    assert guidance["states"][0]["origin"] == "declared by core my_robot/PlannedGuidance"

    status, told = verdict(robot(model.parent, core="StraightGuidance"), model, capfd)
    assert [state["time_ns"] for state in told["components"][0]["states"]] == [202_000, 300_000, 200_000]

    status, told = verdict(robot(model.parent, unit_ms=1), model, capfd)
    assert (status, told["verdict"]["outcome"]) == (1, "not schedulable")


def test_the_guards_of_a_wait_have_the_times_of_the_model(
    model: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """Two guards of 1 us are asked when W1 ends, before Idle."""
    branch = "next: [{if: has_new_goal, to: Planning}, {if: has_path, to: Following}, Idle]}"
    text = model.read_text()
    assert "W1: {wait: 1 * unit_ms, next: Idle}" in text
    model.write_text(
        text.replace("W1: {wait: 1 * unit_ms, next: Idle}", f"W1: {{wait: 1 * unit_ms, {branch}")
    )
    status, told = verdict(robot(model.parent), model, capfd)
    assert (status, told["verdict"]["outcome"]) == (0, "schedulable")
    [w1] = [state for state in told["components"][0]["states"] if state["name"] == "W1"]
    assert (w1["time_ns"], w1["origin"]) == (2_000, "declared by core my_robot/PlannedGuidance")

    model.write_text(
        model.read_text().replace("follow_path: 0.2 ms, has_new_goal: 1 us,", "follow_path: 0.2 ms,")
    )
    status, told = verdict(robot(model.parent), model, capfd)
    assert (status, told["verdict"]["outcome"]) == (3, "not provable")


def test_a_latest_value_of_a_type_of_the_model_is_checked(
    model: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """Its struct in C++ is not generated yet."""
    path = Path(robot(model.parent))
    whole = path.read_text().replace(
        "target: {kind: shared_data,", "target: {kind: latest_value, max_readers: 1,"
    )
    path.write_text(whole)
    assert main(["check", str(path), str(model)]) == 0
    capfd.readouterr()
    status, told = verdict(str(path), model, capfd)
    assert (status, told["verdict"]["outcome"]) == (0, "schedulable")

    path.write_text(whole.replace("[guidance.goal, goal.read]", "[guidance.goal, target.read]"))
    path.write_text(
        path.read_text().replace("[guidance.position, position.read]", "[guidance.position, target.read]")
    )
    assert main(["check", str(path), str(model)]) == 2
    assert "too many readers of resource 'target' of kind latest_value" in capfd.readouterr().err


RULES = """\
mauve: 1
rules:
  - name: slow_planner
    when: {overruns: {component: guidance, at_least: 3, within_s: 1.0}}
    do:
      - {kind: replace_core, target: guidance, name: my_robot/StraightGuidance}
"""
STEPS = """\
steps:
  - {kind: replace_core, target: guidance, name: my_robot/StraightGuidance}
  - {kind: set_property, target: guidance, name: target_threshold, value: 0.5}
"""


def test_rules_and_steps_are_tried_with_a_model(model: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """No code exists."""
    path = robot(model.parent)
    rules, steps = model.parent / "rules.yaml", model.parent / "steps.yaml"
    rules.write_text(RULES, encoding="utf-8")
    steps.write_text(STEPS, encoding="utf-8")
    files = [path, str(rules), str(steps), str(model)]
    assert main(["check", *files]) == 0, capfd.readouterr().err
    told = capfd.readouterr().out
    assert f"{steps}: 2 steps, checked with {path}: no error found" in told
    assert f"{rules}: 1 rule, checked with {path}: no error found" in told
    assert main(["graph", path, str(model), "--steps", str(steps)]) == 0
    assert "StraightGuidance" in capfd.readouterr().out

    steps.write_text(STEPS.replace("StraightGuidance", "StraitGuidance"), encoding="utf-8")
    rules.write_text(RULES.replace("StraightGuidance", "StraitGuidance"), encoding="utf-8")
    assert main(["check", *files]) == 2
    told = capfd.readouterr().err
    assert "component 'guidance' takes my_robot/PlannedGuidance, my_robot/StraightGuidance" in told
    assert f"{steps}:2:" in told
    assert f"{rules}:6:" in told


ARM = """\
mauve_model: 1
package: my_arm
cores:
  Follower:
    shell: my_robot/GuidanceShell
    actions: [follow]
    implementations: {Eager: {wcet: {follow: 2 ms}}}
fsms:
  FollowerFsm:
    core: Follower
    initial: Follow
    states: {Follow: {run: follow, next: Rest}, Rest: {wait: 2 * unit_ms, next: Follow}}
"""


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    """A model that uses a shell of the Guidance's."""
    path = tmp_path / "arm.yaml"
    path.write_text(ARM, encoding="utf-8")
    return path


def arm_robot(folder: Path) -> Path:
    path = Path(robot(folder, core="Eager"))
    text = path.read_text().replace("my_robot/Eager", "my_arm/Eager")
    text = text.replace("    alternatives: [my_robot/StraightGuidance]\n", "")
    path.write_text(text.replace("my_robot/GuidanceFsm", "my_arm/FollowerFsm"))
    return path


def test_a_model_uses_parts_of_another_one(model: Path, arm: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = arm_robot(model.parent)
    assert main(["check", str(arm)]) == 2
    assert f"{arm}:5:12: package 'my_robot' is not found" in capfd.readouterr().err
    assert main(["check", str(path), str(arm), str(model)]) == 0
    assert f"{arm}: 0 shells, 1 core, 1 fsm: no error found\n" in capfd.readouterr().out

    assert main(["analyze", str(path), "--model", str(arm), "--model", str(model), "--json"]) == 0
    [component] = json.loads(capfd.readouterr().out)["components"]
    assert component["states"][0]["time_ns"] == 2_000_000

    assert main(["graph", str(arm), str(model)]) == 0
    assert "my_robot/GuidanceShell" in capfd.readouterr().out
    assert main(["graph", str(arm), str(model), "--fsm", "FollowerFsm"]) == 0
    assert "2 * unit_ms" in capfd.readouterr().out

    assert main(["generate", str(arm), str(model)]) == 0
    assert (arm.parent / "build/generated/include/my_arm/model/follower_core.hpp").is_file()


def test_a_model_uses_parts_of_an_installed_package_in_cpp(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """The shell is the installed one; the core is not written yet."""
    model = tmp_path / "model.yaml"
    text = ARM.replace("my_robot/GuidanceShell", "mauve_examples/ControlShell")
    model.write_text(text.replace("2 * unit_ms", "10 ms"), encoding="utf-8")
    examples = ROOT / "mauve_examples"
    text = (examples / "architecture/robot.yaml").read_text(encoding="utf-8")
    text = text.replace("core: mauve_examples/Control\n", "core: my_arm/Eager\n")
    text = text.replace("fsm: mauve_examples/ControlFsm\n", "fsm: my_arm/FollowerFsm\n")
    path = tmp_path / "robot.yaml"
    path.write_text(text.replace("../maps", str(examples / "maps")), encoding="utf-8")
    assert main(["check", str(path), str(model)]) == 0
    assert "5 components, 15 resources, 32 connections: no error found" in capfd.readouterr().out
    status, told = verdict(str(path), model, capfd)
    assert (status, told["verdict"]["outcome"]) == (0, "schedulable")


def test_a_wrong_model_is_told_once(model: Path, arm: Path, capfd: pytest.CaptureFixture[str]) -> None:
    model.write_text(model.read_text().replace("next: W5", "next: W6"))
    assert main(["check", str(arm), str(model)]) == 2
    assert capfd.readouterr().err.count("there is no state 'W6'") == 1


def test_a_missing_worst_case_is_not_provable(model: Path, capfd: pytest.CaptureFixture[str]) -> None:
    model.write_text(model.read_text().replace("compute_path: 5 ms, ", ""))
    status, told = verdict(robot(model.parent), model, capfd)
    assert (status, told["verdict"]["outcome"]) == (3, "not provable")


def test_code_is_generated(model: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert main(["generate", str(model)]) == 0
    told = capfd.readouterr().out.splitlines()
    assert told[0] == f"{model.parent}/build/generated: 8 files generated"
    assert told[1] == f"{model.parent}/src/planned_guidance.hpp: written, yours from now on"
    assert main(["generate", str(model)]) == 0
    assert len(capfd.readouterr().out.splitlines()) == 1
    model.write_text(model.read_text().replace("next: W5", "next: W6"))
    assert main(["generate", str(model)]) == 2
    assert "there is no state 'W6'" in capfd.readouterr().err


def test_an_installed_package_is_read_as_a_model(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Generated parts of the mission, and hand-written ones of the tutorials."""
    assert main(["model", "mauve_examples"]) == 0
    told = capfd.readouterr()
    assert "type Scan: its struct and its header are guesses" in told.err
    path = tmp_path / "model.yaml"
    path.write_text(told.out, encoding="utf-8")
    assert main(["check", str(path)]) == 0
    content, mission = load_model(path).content, load_model(ROOT / "mauve_examples/model.yaml").content
    fsms = {name: fsm.changed(description="") for name, fsm in mission.fsms.items()}
    assert content.fsms | fsms == content.fsms
    assert content.cores["Metronome"].actions == ["tick", "beat"]
    assert main(["model", "no_robot"]) == 2
    assert "'no_robot'" in capfd.readouterr().err
