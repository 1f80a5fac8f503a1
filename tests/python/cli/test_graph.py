"""`mauve graph` on files and bags: architectures, changes, rules, fsms and models as drawings."""

import argparse
import re
import shlex
import shutil
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest
from page_blocks import blocks
from readable_drawings import checked_texts
from synthetic_traces import record

from mauve_rt.cli.completion import complete_components, complete_executors_and_files
from mauve_rt.cli.completion_cache import CachedComponent
from mauve_rt.cli.main import main
from mauve_rt.trace.recording.synthetic import SyntheticSource

Graph = Callable[..., tuple[int, str, str]]
NEEDS_DOT = pytest.mark.skipif(shutil.which("dot") is None, reason="no Graphviz")
ROOT = Path(__file__).parents[3]
MODEL = ROOT / "tests/python/modelling/guidance.yaml"
ROBOT = """\
mauve: 1
executor: {namespace: /robot}
components:
  counter: {shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm,
            alternatives: [executor_tests/PyCounter], priority: 40, cpus: [0], properties: {period_ms: 20}}
  guard: {shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/GuardedFsm}
resources:
  set: {kind: shared_data, type: std_msgs/msg/Float64, topic: {name: set, direction: subscribe}}
  count: {kind: shared_data, type: std_msgs/msg/Float64, topic: {name: count, direction: publish}}
connections:
  - [counter.set, set.read]
  - [counter.count, count.write]
"""
MODELLED = """\
mauve: 1
components:
  guidance: {shell: my_robot/GuidanceShell, core: my_robot/StraightGuidance, fsm: my_robot/GuidanceFsm,
             properties: {unit_ms: 10}}
resources:
  position: {kind: shared_data, type: my_robot/msg/Point2D}
  goal: {kind: shared_data, type: my_robot/msg/Point2D}
  target: {kind: shared_data, type: my_robot/msg/Point2D}
connections:
  - [guidance.position, position.read]
  - [guidance.goal, goal.read]
  - [guidance.target, target.write]
"""
STEPS = """\
- {kind: add_resource, target: other, value: {kind: shared_data, type: std_msgs/msg/Float64,
   topic: {name: wanted, direction: subscribe}}}
- {kind: disconnect, target: counter, name: set}
- {kind: connect, target: counter, name: set, value: other.read}
- {kind: replace_core, target: counter, name: executor_tests/PyCounter}
"""
RULES = """\
mauve: 1
rules:
  - name: lost
    when: {silence: {topic: set, type: std_msgs/msg/Float64, longer_than_s: 1.0}}
    do: [{kind: replace_core, target: counter, name: executor_tests/PyCounter}]
"""


@pytest.fixture
def graph(tmp_path: Path, plugin_prefix: Path, capsys: pytest.CaptureFixture[str]) -> Graph:
    """graph(WORD...): status, stdout, stderr; robot.yaml, steps.yaml and rules.yaml stand in the folder."""
    for name, text in (("robot.yaml", ROBOT), ("steps.yaml", STEPS), ("rules.yaml", RULES)):
        (tmp_path / name).write_text(text, encoding="utf-8")

    def run(*words: str) -> tuple[int, str, str]:
        known = {path.name: str(path) for path in tmp_path.iterdir()}
        status = main(["graph", *(known.get(word, word) for word in words)])
        said = capsys.readouterr()
        return status, said.out, said.err.replace(f"{tmp_path}/", "")

    return run


def labels(dot: str) -> dict[str, str]:
    """The label of each node of a DOT text, and the class."""
    found = re.findall(r'^ *n\d+ \[id="n\d+", label="(.*?)", class="(.*?)"', dot, re.MULTILINE)
    return dict(found)


def arrows(dot: str) -> dict[tuple[str, str], str]:
    """The class of each edge, by the first lines of both ends."""
    names = {
        number: text.split("\\n")[0] for number, text in re.findall(r'(n\d+) \[id="n\d+", label="(.*?)"', dot)
    }
    found = re.findall(r'(n\d+) -> (n\d+) \[id="e\d+", class="(.*?)"', dot)
    return {(names[start], names[end]): css for start, end, css in found}


def test_an_architecture_is_drawn_as_dot_on_the_standard_output(graph: Graph) -> None:
    status, out, err = graph("robot.yaml")
    assert (status, err) == (0, "")
    assert labels(out) == {
        r"counter\nCounter\n20 ms, priority 40": "component",
        r"guard\nCounter\n10 ms, priority 50\nnot connected: set, count": "component",
        r"set\nsubscribes /robot/set": "resource",
        r"count\npublishes /robot/count": "resource",
    }
    assert arrows(out) == {("set", "counter"): "data", ("counter", "count"): "data"}
    assert 'label="CPU 0"' in out


def test_parts_that_are_not_installed_leave_the_drawing_of_the_file(graph: Graph, tmp_path: Path) -> None:
    text = ROBOT.replace("executor_tests/Counter,", "executor_tests/Unwritten,", 1)
    (tmp_path / "robot.yaml").write_text(text, encoding="utf-8")
    status, out, err = graph("robot.yaml")
    assert status == 0
    assert r"counter\nUnwritten\npriority 40" in labels(out)
    assert err.startswith("robot.yaml:4:")
    assert "so rates and ports without a connection are not shown" in err


def test_models_give_an_architecture_its_parts(graph: Graph, tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_text(MODELLED, encoding="utf-8")
    status, out, _ = graph("robot.yaml", str(MODEL))
    assert status == 0
    assert any(label.startswith(r"guidance\nStraightGuidance\n10 ms") for label in labels(out))
    status, out, _ = graph("robot.yaml", str(MODEL), "--fsm", "guidance")
    assert r"W5\n5 * unit_ms\n50 ms" in labels(out)


def test_steps_are_drawn_with_their_differences(graph: Graph) -> None:
    status, out, err = graph("robot.yaml", "--steps", "steps.yaml")
    assert (status, err) == (0, "")
    found = labels(out)
    assert (
        found["counter\\nCounter \N{RIGHTWARDS ARROW} PyCounter\\n20 ms, priority 40"] == "component changed"
    )
    assert found[r"other\nsubscribes /robot/wanted"] == "resource added"
    assert found[r"set\nsubscribes /robot/set"] == "resource"
    assert arrows(out) == {
        ("other", "counter"): "data added",
        ("set", "counter"): "data removed",
        ("counter", "count"): "data",
    }


def test_a_refused_step_is_named_with_its_place(graph: Graph, tmp_path: Path) -> None:
    (tmp_path / "steps.yaml").write_text("- {kind: stop, target: contrl}\n", encoding="utf-8")
    status, out, err = graph("robot.yaml", "--steps", "steps.yaml")
    assert (status, out) == (2, "")
    assert err.startswith("steps.yaml:1:")
    assert "contrl" in err


def test_rules_are_dashed_arrows_from_what_they_watch_to_what_they_change(graph: Graph) -> None:
    status, out, err = graph("robot.yaml", "rules.yaml")
    assert (status, err) == (0, "")
    assert labels(out)[r"lost\nwhen silence set"] == "rule"
    assert arrows(out)["set", "lost"] == arrows(out)["lost", "counter"] == "rule"
    assert ">replace_core</TD>" in out
    assert ">PyCounter</TD>" in out
    assert out.count('style="dashed"') == 2


def test_the_fsm_of_a_component_has_its_states(graph: Graph) -> None:
    status, out, err = graph("robot.yaml", "--fsm", "counter")
    assert (status, err) == (0, "")
    assert {label.split("\\n")[0] for label in labels(out)} >= {"Count"}
    assert "20 ms" in out


def test_a_model_is_drawn_with_shells_cores_and_fsms(graph: Graph) -> None:
    status, out, err = graph(str(MODEL))
    assert (status, err) == (0, "")
    kinds = {label.split("\\n")[0]: css for label, css in labels(out).items()}
    assert kinds["GuidanceShell"] == "shell"
    assert kinds["Guidance"] == "core"
    assert kinds["GuidanceFsm"] == "fsm"
    assert arrows(out)["Guidance", "GuidanceShell"] == arrows(out)["GuidanceFsm", "Guidance"] == "use"


@NEEDS_DOT
@pytest.mark.parametrize(
    ("suffix", "start"),
    [(".svg", "<?xml"), (".html", "<!DOCTYPE html>"), (".dot", "digraph"), (".mmd", "flowchart")],
)
def test_the_name_of_the_file_says_its_form(graph: Graph, tmp_path: Path, suffix: str, start: str) -> None:
    out = tmp_path / f"drawing{suffix}"
    assert graph("robot.yaml", "--out", str(out)) == (0, f"{out}\n", "")
    assert out.read_text(encoding="utf-8").startswith(start)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            ["robot.yaml", "--out", "a.png"],
            "--out a.png: expected a name that ends with .svg, .html, .dot, .mmd",
        ),
        (["robot.yaml", "--out", "/no/such/a.dot"], "/no/such/a.dot: cannot be written (No such file"),
        (
            ["robot.yaml", "--fsm", "countr"],
            "robot.yaml: component 'countr' is unknown; did you mean counter?",
        ),
        ([str(MODEL), "--fsm", "GuidanceFsn"], "fsm 'GuidanceFsn' is unknown; did you mean GuidanceFsm?"),
        ([str(MODEL), "--steps", "steps.yaml"], "graph: --steps needs an architecture file"),
        (["steps.yaml"], "steps.yaml is a file of steps; write --steps"),
        (["rules.yaml"], "graph: expected an architecture file, a node or a bag"),
        (
            ["robot.yaml", "rules.yaml", "--fsm", "counter"],
            "graph: --fsm draws no rules; leave rules.yaml out",
        ),
        (["missing.yaml"], "missing.yaml"),
        (["robot.yaml", "--steps", "missing.yaml"], "missing.yaml"),
    ],
)
def test_bad_usage_is_one_sentence(graph: Graph, words: list[str], message: str) -> None:
    status, out, err = graph(*words)
    assert (status, out) == (2, "")
    assert message in err
    assert "Traceback" not in err


def test_two_architectures_are_refused(graph: Graph, tmp_path: Path) -> None:
    (tmp_path / "second.yaml").write_text(ROBOT, encoding="utf-8")
    status, _, err = graph("robot.yaml", "second.yaml")
    assert status == 2
    assert "expected one architecture, found several" in err


def test_without_graphviz_only_dot_and_mermaid_are_written(
    graph: Graph, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    status, _, err = graph("robot.yaml", "--out", str(tmp_path / "a.svg"))
    assert status == 2
    assert "apt-get install graphviz" in err
    assert graph("robot.yaml", "--out", str(tmp_path / "a.mmd"))[0] == 0


def test_a_bag_without_an_architecture_is_refused(graph: Graph, tmp_path: Path) -> None:
    record(SyntheticSource(["c"]), tmp_path / "bag")
    status, _, err = graph(str(tmp_path / "bag"))
    assert status == 2
    assert "record it again" in err


def test_a_bag_is_drawn_as_it_was_recorded(graph: Graph) -> None:
    bag = str(ROOT / "docs/sample/metronome")
    status, out, err = graph(bag)
    assert (status, err) == (0, "")
    assert any(label.startswith(r"metronome\nMetronome\n5 ms") for label in labels(out))
    status, out, _ = graph(bag, "--fsm", "metronome")
    assert {"Tick", "Beat"} <= {label.split("\\n")[0] for label in labels(out)}


def test_components_of_an_executor_are_completed(monkeypatch: pytest.MonkeyPatch) -> None:
    components = [CachedComponent(name=name) for name in ("control", "guidance")]
    executor = SimpleNamespace(name="/robot/executor", components=components)
    monkeypatch.setattr("mauve_rt.cli.completion._known", lambda _executor="": [executor])
    words = argparse.Namespace(subject=["robot/executor"])
    assert complete_components("", words) == ["control", "guidance"]
    assert complete_components("", argparse.Namespace(subject=["robot.yaml"])) == []


def test_files_and_folders_are_completed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "robot.yaml").touch()
    (tmp_path / "run").mkdir()
    monkeypatch.setattr("mauve_rt.cli.completion._known", lambda _executor="": [])
    found = complete_executors_and_files(f"{tmp_path}/r", None)  # type: ignore[arg-type]
    assert found == [f"{tmp_path}/robot.yaml", f"{tmp_path}/run/"]


@NEEDS_DOT
def test_the_commands_of_the_how_to_draw(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    page = (ROOT / "docs/howto/draw_an_architecture.md").read_text(encoding="utf-8")
    (tmp_path / "mauve_examples").symlink_to(ROOT / "mauve_examples")
    monkeypatch.chdir(tmp_path)
    commands = [shlex.split(block.text)[1:] for block in blocks(page) if "mauve_examples" in block.text]
    assert len(commands) == 3
    for words in commands:
        assert main(words) == 0
        out = words[-1]
        assert capsys.readouterr() == (f"{out}\n", "")
        assert checked_texts((tmp_path / out).read_text(encoding="utf-8"))
