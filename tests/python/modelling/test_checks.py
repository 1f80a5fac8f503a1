"""What a model is refused for: each with its place, what was found, and the remedy."""

from pathlib import Path

import pytest

from mauve_rt.errors import ArchitectureFileError
from mauve_rt.modelling.loading import load_model
from mauve_rt.modelling.package_model import PackageModel

GUIDANCE = Path(__file__).with_name("guidance.yaml")
W1 = "W1: {wait: 1 * unit_ms, next: Idle}"


def model(*changes: tuple[str, str]) -> PackageModel:
    text = GUIDANCE.read_text(encoding="utf-8")
    for before, after in changes:
        assert before in text
        text = text.replace(before, after)
    return load_model("model.yaml", text=text)


def refusals(*changes: tuple[str, str]) -> list[str]:
    with pytest.raises(ArchitectureFileError) as caught:
        model(*changes)
    return caught.value.lines()


def test_the_papers_guidance_is_a_model() -> None:
    content = model().content
    assert [*content.fsms] == ["GuidanceFsm", "GuidancePsm"]
    assert content.fsms["GuidanceFsm"].states["W5"].wait.factor == 5  # type: ignore[union-attr]
    assert model().warnings == []


@pytest.mark.parametrize(
    ("before", "after", "told"),
    [
        ("goal: {read: Point2D}", "goal: {read: Pont2D}", "model.yaml:14:20: unknown type 'Pont2D'"),
        (
            "goal: {read: Point2D}",
            "goal: {read: mauve_msgs/action/DriveTo}",
            "an action is no type of values, found 'mauve_msgs/action/DriveTo': expected mauve_msgs",
        ),
        (
            "{x: float64, y: float64}",
            "{x: mauve_msgs/action/DriveTo_Goal}",
            "a message has no field of 'mauve_msgs/action/DriveTo_Goal', a message of an action; name its",
        ),
        (
            "Point2D[<=64]",
            "Point2D[]",
            "6:18: type 'Point2D[]' has no bound: expected one with a bound, such as",
        ),
        (
            "next: uint32",
            "next: string",
            "type 'string' has no bound: expected one with a bound, such as string<=32",
        ),
        (W1, f"{W1}\n      W9: {{wait: 1 ms, next: Idle}}", "35:7: state 'W9' is never reached from 'Idle'"),
        ("next: W2", "next: Idle", "31:7: the cycle Idle -> Following -> Idle has no wait"),
        ("wait: 1 * unit_ms", "wait: 1 * unit_m", "there is no property 'unit_m'; did you mean unit_ms?"),
        (
            "wait: 1 * unit_ms",
            "wait: 5",
            "expected a time such as 10 ms, or 5 * unit_ms of an integer property",
        ),
        ("wait: 1 * unit_ms", "wait: 0 ms", "bad wait in states.W1 of fsm 'GuidanceFsm': expected a time"),
        (
            "minimum: 1, ",
            "",
            "property 'unit_ms' is no length of a wait: found type int64, unit 'ms', no minimum",
        ),
        ("unit: ms, ", "unit: m, ", "give it the type int64 and one of the units ns, us, ms or s"),
        (
            "unit: ms, read_by: fsm",
            "unit: ms",
            "add `read_by: fsm` to it: a machine reads it when it is configured",
        ),
        ("run: compute_path, next: W5", "run: has_path, next: W5", "'has_path'; 'has_path' is a guard"),
        (
            "guards: [has_new_goal, has_path]",
            "guards: [has_new_goal]",
            "core 'Guidance' has no guard 'has_path'",
        ),
        ("compute_path: 5 ms", "compute: 5 ms", "core 'Guidance' has no action or guard 'compute'"),
        (
            "compute_path: 5 ms",
            "compute_path: 5 * unit_ms",
            "a worst case is a time of its own: expected such as",
        ),
        ("position:", "lambda:", "13:7: 'lambda' is a keyword of Python"),
        ("position:", "int:", "'int' is a keyword of C++"),
        ("position:", "ports:", "every shell has a member 'ports'; rename it"),
        ("state: {current_goal", "state: {take", "every core has a method 'take'; rename it"),
        ("position:", "unit_ms:", "there are a port and a property 'unit_ms'; rename one of them"),
        ("  GuidancePsm:", "  GuidanceShell:", "there are two classes 'GuidanceShell'; rename one of them"),
        ("  GuidancePsm:", "  GuidanceCore:", "there are two classes 'GuidanceCore'"),
        ("{to: W1}", "{if: has_path, to: W1}", "the last branch of 'next' has a guard"),
        ("{to: W1}]", "{to: W1}, W2]", "the branches behind 'W1' are never taken"),
        ("{write: Point2D", "{write: Point2D, read: Point2D", "expected one of read, write, call and event"),
        ("goal: {read: Point2D}", "goal: {read: Point2D, frame: /map}", "bad frame in ports.goal of shell"),
        ("goal: {read: Point2D}", "goal: {read: Point2D, frame: $(name)/base}", "bad frame in ports.goal of"),
        (
            "goal: {read: Point2D}",
            "goal: {read: Point2D}\n      done: {event: true, child_frame: map}",
            "bad child_frame in ports.done of shell 'GuidanceShell': expected nothing: only a port that",
        ),
        ("default: 0.1", "default: 7", "bad default in properties.target_threshold of shell 'GuidanceShell'"),
        ("shell: GuidanceShell", "shell: GuidanceShel", "there is no shell 'GuidanceShel'; did you mean"),
        ("initial: Idle", "initial: Idl", "there is no state 'Idl'; did you mean Idle?"),
        ("path: Path", 'path: "Point2D[0]"', "type 'Point2D[0]' has no bound"),
        (
            "{x: float64, y: float64}",
            "{x: float64, y: Path}",
            "type 'Point2D' is within itself; break the cycle",
        ),
        ("budget: 0.1 ms", "budget: forever", "a worst case is a time of its own"),
        ("mauve_model: 1", "mauve_model: 2", "this program reads version 1 of the schema"),
        ("mauve_model: 1", "", "the file has no 'mauve_model'; write `mauve_model: 1` at its top"),
        ("package: my_robot", "package: my_robot\ncolor: red", "unknown key 'color'"),
        (W1, "W1: {wait: forever, next: Idle}", "a wait that is ended by a stop alone leads nowhere"),
        (
            W1,
            "W1: {wait_event: {inputs: gaol, timeout: 1 s, min_interarrival: 1 ms}, next: Idle}",
            "read port 'gaol'",
        ),
    ],
)
def test_what_cannot_be_is_refused_at_its_place(before: str, after: str, told: str) -> None:
    assert any(told in line for line in refusals((before, after))), refusals((before, after))


def test_a_property_that_is_no_length_is_named_once() -> None:
    assert len(refusals(("minimum: 1, ", ""))) == 1


def test_a_shell_that_no_core_uses_is_warned_of() -> None:
    text = GUIDANCE.read_text(encoding="utf-8").replace(
        "shells:", "shells:\n  Spare: {ports: {a: {event: true}}}"
    )
    [warning] = load_model("model.yaml", text=text).warnings
    assert (warning.line, warning.text()) == (
        8,
        "no core uses shell 'Spare'; remove it, or write a core for it",
    )


def test_a_machine_may_wait_for_an_event_and_for_ever() -> None:
    found = model(
        (W1, "W1: {wait_event: {inputs: goal, timeout: forever, min_interarrival: 1 * unit_ms}, next: End}"),
        (
            "W2: {wait: 2 * unit_ms, next: Idle}",
            "W2: {wait: 2 * unit_ms, next: Idle}\n      End: {wait: forever}",
        ),
    )
    states = found.content.fsms["GuidanceFsm"].states
    assert states["End"].wait is not None
    assert states["End"].wait.is_forever
    assert states["W1"].wait_event is not None
