"""Parameters of kinds of resources: given ones, plug-ins' in C++ and in Python, in files and in programs."""

from pathlib import Path
from typing import Any

import pytest
from rclpy.serialization import deserialize_message
from std_msgs.msg import Float64

from mauve_rt._kernel import Architecture, MauveError, PluginRegistry, Simulation, Transaction
from mauve_rt.api import Resource, SharedData, parameter, service
from mauve_rt.errors import ArchitectureFileError
from mauve_rt.model import build, configure, load_architecture
from mauve_rt.model.resource_kinds import given_kinds

FLOAT = "std_msgs/msg/Float64"
WINDOW = "{kind: executor_tests/Window, length_s: 2, label: eyes}"
GOOD = f"""\
mauve: 1
components:
  counter: {{shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm,
            properties: {{step: 0}}}}
resources:
  window: {WINDOW}
  count: {{kind: shared_data, type: std_msgs/msg/Float64}}
connections:
  - [counter.set, window.read]
  - [counter.count, count.write]
"""


class Tally(Resource):
    """A kind written in Python."""

    least = parameter(3, unit="votes", description="how many it takes", minimum=1, maximum=9)
    name_of = parameter("", required=True)
    seen: tuple[int, str] = (0, "")

    def configure(self) -> None:
        Tally.seen = (self.least, self.name_of)

    @service
    def get(self) -> int:
        return self.least


@pytest.fixture
def registry() -> PluginRegistry:
    made = PluginRegistry()
    made.resource("test/Tally", Tally)
    return made


def built(folder: Path, text: str, registry: PluginRegistry) -> Architecture:
    path = folder / "robot.yaml"
    path.write_text(text, encoding="utf-8")
    model = load_architecture(path)
    architecture = build(model, registry)
    configure(model, architecture)
    return architecture


def first_count(architecture: Architecture) -> float:
    """What the counter starts from: what it read of its window."""
    simulation = Simulation()
    host = simulation.add(architecture)
    simulation.deploy()
    simulation.run_until(simulation.epoch_ns() + 50_000_000)
    count = float(deserialize_message(host.read_resource("count")[0], Float64).data)
    simulation.shutdown()
    return count


def test_the_given_kinds_tell_what_files_may_say_of_them() -> None:
    keys = {name: [each.file_key for each in kind.parameters] for name, kind in given_kinds().items()}
    assert keys == {
        "shared_data": ["max_bytes"],
        "ring_buffer": ["capacity", "overwrite", "max_bytes"],
        "latest_value": ["max_readers"],
        "event": [],
        "client": ["service.timeout_ms"],
        "action_server": ["goals", "action.answer_ms", "max_bytes"],
        "action_client": ["action.answer_ms", "max_bytes"],
        "transform_tree": ["frames", "history", "static_topic"],
    }
    assert all(each.description for kind in given_kinds().values() for each in kind.parameters)


def test_a_parameter_of_a_plugin_is_set_by_the_file(
    tmp_path: Path, plugin_prefix: Path, registry: PluginRegistry
) -> None:
    assert first_count(built(tmp_path, GOOD, registry)) == 2.0
    by_default = GOOD.replace("length_s: 2, ", "")
    assert first_count(built(tmp_path, by_default, registry)) == 0.5


def holds(architecture: Architecture) -> dict[str, int]:
    """The declared times of resources; the counter's ports tell the same."""
    found = {resource.name: resource.longest_hold_ns for resource in architecture.resources()}
    (counter,) = architecture.components()
    assert {port.resource: port.longest_hold_ns for port in counter.ports} == found
    return found


def test_the_hold_of_a_lock_in_the_file_takes_precedence_over_the_code(
    tmp_path: Path, plugin_prefix: Path, registry: PluginRegistry
) -> None:
    assert holds(built(tmp_path, GOOD, registry)) == {"window": 3_000_000, "count": 0}
    declared = GOOD.replace("length_s: 2", "length_s: 2, longest_hold_ns: 2000000")
    declared = declared.replace("msg/Float64}", "msg/Float64, longest_hold_ns: 5}")
    assert holds(built(tmp_path, declared, registry)) == {"window": 2_000_000, "count": 5}


def test_a_program_declares_the_hold_of_a_lock(registry: PluginRegistry) -> None:
    architecture = Architecture(registry)
    architecture.add_resource("count", SharedData(Float64), longest_hold_ns=5)
    architecture.add_resource("events", kind="event", longest_hold_ns=6)
    more = Transaction().add_resource("more", SharedData(Float64), longest_hold_ns=7)
    architecture.commit(more.add_resource("last", kind="event", topic="publish", longest_hold_ns=8))
    found = {resource.name: resource.longest_hold_ns for resource in architecture.resources()}
    assert found == {"count": 5, "events": 6, "more": 7, "last": 8}
    with pytest.raises(MauveError, match=r"resource bad, longest_hold_ns.*found -1"):
        architecture.add_resource("bad", kind="event", longest_hold_ns=-1)


BAD = {
    "too long": (
        "length_s: 2",
        "length_s: 61",
        "61",
        "bad length_s of resource 'window': expected at most 60 s, found 61; it says how far it looks back",
    ),
    "too short": ("length_s: 2", "length_s: 0.1", "0.1", "expected at least 0.25 s, found 0.1"),
    "no number": ("length_s: 2", "length_s: long", "long", "expected a number, found 'long'; it says"),
    "no text": ("label: eyes", "label: 5", "5", "bad label of resource 'window': expected text, found 5"),
    "unknown": (
        "length_s: 2",
        "lenght_s: 2",
        "lenght_s",
        "unknown key 'lenght_s' of resource 'window'; did you",
    ),
    "quite unknown": (
        "length_s: 2",
        "xxxx: 2",
        "xxxx",
        "unknown key 'xxxx' of resource 'window'; known: action, child_frame, frame, kind, label, length_s",
    ),
    "of another kind": (
        "length_s: 2",
        "capacity: 2",
        "capacity",
        "resource 'window' of kind executor_tests/Window has no capacity; only a ring_buffer has one",
    ),
    "missing": (
        ", label: eyes",
        "",
        "window: {",
        "resource 'window' has no label: expected label: what it is for",
    ),
    "of a kind in Python": (
        "kind: executor_tests/Window, length_s: 2, label: eyes",
        "kind: test/Tally, least: 10, name_of: eyes",
        "10",
        "bad least of resource 'window': expected at most 9 votes, found 10; it says how many it takes",
    ),
    "unknown to a kind in Python": (
        "kind: executor_tests/Window, length_s: 2, label: eyes",
        "kind: test/Tally, lesat: 2, name_of: eyes",
        "lesat",
        "unknown key 'lesat' of resource 'window'; did you mean least?",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_parameter_is_refused_at_its_place(
    case: str, tmp_path: Path, plugin_prefix: Path, registry: PluginRegistry
) -> None:
    before, after, culprit, message = BAD[case]
    text = GOOD.replace(before, after)
    assert text != GOOD
    with pytest.raises(ArchitectureFileError) as caught:
        built(tmp_path, text, registry)
    problem = caught.value.problems[0]
    assert message in str(caught.value)
    assert text.splitlines()[problem.line - 1][problem.column - 1 :].startswith(culprit)
    assert len(caught.value.problems) == 1


def test_a_kind_in_python_is_told_its_parameters_by_the_file(
    tmp_path: Path, plugin_prefix: Path, registry: PluginRegistry
) -> None:
    text = GOOD.replace("- [counter.set, window.read]", "- [counter.count, count.write]", 1)
    text = text[: text.rindex("  - ")].replace(WINDOW, "{kind: test/Tally, least: 7, name_of: ballot}")
    built(tmp_path, text, registry)
    assert Tally.seen == (7, "ballot")


def test_a_kind_in_python_is_told_its_parameters_by_the_program(registry: PluginRegistry) -> None:
    architecture = Architecture(registry)
    architecture.add_resource("tally", kind="test/Tally", name_of="ballot")
    architecture.configure()
    assert Tally.seen == (3, "ballot")
    of_the_program = Tally()
    of_the_program.least = 5
    assert (Tally().least, of_the_program.least) == (3, 5)


@pytest.mark.parametrize(
    ("told", "code", "message"),
    [
        ({"kind": "test/Tally"}, "invalid_argument", "a test/Tally needs a name_of"),
        ({"kind": "test/Tally", "name_of": "", "least": 0}, "out_of_range", "votes"),
        ({"kind": "test/Tally", "name_of": 3}, "type_mismatch", "found int 3"),
        ({"kind": "test/Tally", "name_of": "", "most": 0}, "invalid_argument", "one of least, name_of"),
        ({"kind": "event", "capacity": 0}, "invalid_argument", "of kind event has no such parameter"),
        ({"kind": "test/Tally", "type": FLOAT}, "unknown_resource", "leave type out"),
    ],
)
def test_a_bad_parameter_of_a_program_is_refused(
    told: dict[str, Any], code: str, message: str, registry: PluginRegistry
) -> None:
    architecture = Architecture(registry)
    with pytest.raises(MauveError, match=message) as refused:
        architecture.add_resource("tally", **told)
    assert refused.value.code == code
    assert architecture.resources() == []
    with pytest.raises(TypeError, match="parameter least: expected bool, int, float or str"):
        architecture.add_resource("tally", kind="test/Tally", least=[])  # type: ignore[call-overload]


def test_a_parameter_does_not_take_the_name_of_a_key() -> None:
    class Bad(Resource):
        topic = parameter("")

    with pytest.raises(MauveError, match="a parameter cannot have that name"):
        PluginRegistry().resource("test/Bad", Bad)
