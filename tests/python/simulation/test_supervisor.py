"""A supervisor in virtual time: what it tells when it is armed."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from rclpy.qos import QoSProfile
from std_msgs.msg import Float64

from mauve_rt._kernel import PluginRegistry, Simulation
from mauve_rt.control.runtime import Runtime
from mauve_rt.parts.ament_index import share_folder
from mauve_rt.simulation.executor import SimulatedExecutor
from mauve_rt.simulation.supervisor import SimulatedSupervisor
from mauve_rt.simulation.topics import SimulatedTopics

RULES = """\
mauve: 1
rules:
  - name: quiet
    when: WHEN
    do: [{kind: replace_core, target: metronome, name: mauve_examples/DO}]
    undo: {for_s: 0.5UNDO}
"""
SILENCE = "{silence: {topic: peer, type: std_msgs/msg/Float64, longer_than_s: 2.0}}"
VALUE = "{value: {topic: peer, type: std_msgs/msg/Float64, field: data, above: 1}}"


class Stage:
    """The metronome and its supervisor."""

    def __init__(self, folder: Path, *, do: str, undo: str, when: str = SILENCE) -> None:
        share = share_folder("mauve_examples")
        assert share is not None
        rules = folder / "rules.yaml"
        back = f", do: [{{kind: replace_core, target: metronome, name: mauve_examples/{undo}}}]"
        text = RULES.replace("UNDO", back if undo else "").replace("DO", do).replace("WHEN", when)
        rules.write_text(text, encoding="utf-8")
        self.time = Simulation()
        self.topics = SimulatedTopics()
        architecture = share / "architecture" / "metronome.yaml"
        self.executor = SimulatedExecutor(
            self.time, self.topics, architecture, folder / "bag", complain=pytest.fail
        )
        self.supervisor = SimulatedSupervisor(self.time, self.topics, self.executor, rules)
        self.decisions: list[Any] = []
        self.topics.listen(self.supervisor.decisions, lambda sample: self.decisions.append(sample.message()))
        self.executor.activate()

    def run(self, seconds: float, *, playing: bool = False, value: float = 0.0) -> None:
        for _ in range(round(seconds * 10)):
            if playing:
                now_ns = self.time.now_ns()
                message, qos = Float64(data=value), QoSProfile(depth=1)
                self.topics.say("/peer", "std_msgs/msg/Float64", message, time_ns=now_ns, qos=qos)
            self.time.run_until(self.time.now_ns() + 100_000_000)

    def said(self) -> list[str]:
        return [decision.decision for decision in self.decisions]

    def core(self) -> str:
        return self.executor.components()[0].core.removeprefix("mauve_examples/")


@pytest.fixture
def stage(tmp_path: Path, request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Iterator[Stage]:
    # Other tests load other packages into the one of the process, with C++ types of their own for Float64.
    monkeypatch.setattr(Runtime, "registry", PluginRegistry())
    stage = Stage(tmp_path, **request.param)
    yield stage
    stage.supervisor.close()
    stage.executor.close()
    stage.time.shutdown()


OF_THE_FILE = {"do": "Metronome", "undo": "Accelerando"}  # what the rule does is in effect from the start


@pytest.mark.parametrize("stage", [OF_THE_FILE], indirect=True)
def test_the_steps_of_undo_are_in_force_at_the_end(stage: Stage):
    stage.run(5.0)
    assert stage.said() == ["armed", "condition_true", "do", "done"]
    assert stage.core() == "Metronome"
    stage.run(1.0, playing=True)
    assert stage.said()[4:] == ["condition_false", "undo", "done"]
    assert stage.core() == "Accelerando"


@pytest.mark.parametrize("stage", [OF_THE_FILE | {"undo": ""}], indirect=True)
def test_what_the_file_put_in_stays(stage: Stage):
    stage.run(5.0)
    stage.run(2.0, playing=True)
    assert stage.said() == ["armed", "condition_true", "do", "done", "condition_false", "undo", "done"]
    assert stage.core() == "Metronome"


@pytest.mark.parametrize("stage", [{"do": "NoSuchCore", "undo": "Metronome"}], indirect=True)
def test_what_the_executor_would_refuse_is_told_when_it_is_armed(stage: Stage):
    stage.run(1.0, playing=True)
    assert stage.said() == ["armed", "refused"]
    assert stage.decisions[1].message.startswith("core 'mauve_examples/NoSuchCore' is not installed")


@pytest.mark.parametrize("stage", [{"do": "Accelerando", "undo": "Metronome"}], indirect=True)
def test_rules_that_the_executor_takes_are_armed_and_no_more(stage: Stage):
    stage.run(1.0, playing=True)
    assert stage.said() == ["armed"]
    assert stage.core() == "Metronome"


@pytest.mark.parametrize("stage", [{"do": "Accelerando", "undo": "Metronome", "when": VALUE}], indirect=True)
def test_the_value_of_a_field(stage: Stage):
    stage.run(1.0, playing=True, value=1.0)
    assert stage.said() == ["armed"]
    stage.run(1.0, playing=True, value=1.5)
    assert stage.said()[1:] == ["condition_true", "do", "done"]
    assert stage.core() == "Accelerando"
    stage.run(1.0, playing=True, value=1.0)
    assert stage.said()[4:] == ["condition_false", "undo", "done"]
