"""JSON Schemas of files: they accept what `mauve check` accepts, and refuse the forms that it refuses."""

import importlib.util
import json
import re
import sys
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from bad_architectures import BAD, GOOD
from hypothesis import given
from hypothesis import strategies as st
from jsonschema import Draft202012Validator

from mauve_rt.cli.main import main
from mauve_rt.errors import ArchitectureFileError
from mauve_rt.file_schema import kinds
from mauve_rt.file_schema.file_kind import FileKind
from mauve_rt.file_schema.json_schema import text_form
from mauve_rt.file_schema.kinds import Fault, Faults
from mauve_rt.file_schema.section import Part, Section
from mauve_rt.file_schema.yaml_file import YamlFile
from mauve_rt.model.architecture_file import ArchitectureModel, Overrides, element_problems
from mauve_rt.model.file_kinds import file_kind
from mauve_rt.model.schema import FileModel
from mauve_rt.model.step_kinds import STEP_KINDS
from mauve_rt.model.steps import STEPS, Change
from mauve_rt.modelling.schema import ModelFile
from mauve_rt.scaffold.schemas import file_schema
from mauve_rt.supervision.rules import Rules

ROOT = Path(__file__).resolve().parents[3]
TESTS = ROOT / "tests" / "python"
ONLY_A_FEW = 10

BEYOND: dict[str, Callable[[Fault], bool]] = {
    "two values of the file are compared": lambda fault: (
        re.search(
            r"than warn|at most max_execution_ns|than deadline_ms|its (mini|maxi)mum|than the maximum",
            str(fault.limit),
        )
        is not None
    ),
    "the count of at_least is compared with the length of its list": lambda fault: (
        fault.place[-1:] == ("count",)
    ),
    "a number of JSON Schema has no type: 1.0 is 1": lambda fault: (
        isinstance(fault.found, float) and fault.found.is_integer()
    ),
    "NaN is no number that JSON Schema compares": lambda fault: fault.found != fault.found,
    "a time is a whole number of ns, of 64 bits": lambda fault: (
        str(fault.limit).startswith("a time such as")
        and re.fullmatch(r"[\d.]+ *(ns|us|ms|s)", str(fault.found)) is not None
        and re.search("[1-9]", str(fault.found)) is not None
    ),
}
"""Faults that a schema cannot see, by reason."""
BEYOND_PROBLEMS = "is the name of a component and of a resource|asks for a CPU that this machine"


@cache
def validator(kind: FileKind) -> Draft202012Validator:
    return Draft202012Validator(file_schema(kind))


def faults_of(kind: FileKind, data: Any) -> Faults:
    faults: Faults = []
    tops: dict[FileKind, type[Section]] = {
        FileKind.ARCHITECTURE: FileModel,
        FileKind.RULES: Rules,
        FileKind.MODEL: ModelFile,
        FileKind.STEPS: Change,
    }
    if kind is FileKind.STEPS and isinstance(data, list):
        STEPS.read(data, (), faults)
    else:
        tops[kind].read(data, (), faults)
    return faults


def held_against_the_schema(kind: FileKind, file: YamlFile) -> None:
    """Fails where check and schema do not say the same of a file's form."""
    faults, problems = faults_of(kind, file.data), []
    if kind is FileKind.ARCHITECTURE and not faults:
        content = FileModel.read(file.data, (), [])
        problems = [each.text() for each in element_problems(ArchitectureModel(file, content, Overrides()))]
    seen = [fault for fault in faults if not any(is_beyond(fault) for is_beyond in BEYOND.values())]
    shown = [problem for problem in problems if not re.search(BEYOND_PROBLEMS, problem)]
    errors = [error.message for error in validator(kind).iter_errors(file.data)]
    told = [(fault.place, fault.what, fault.limit, fault.found) for fault in faults]
    if faults or problems:
        assert errors or not (seen or shown), f"check refuses, the schema accepts: {told} {problems}"
    else:
        assert not errors, f"check accepts, the schema refuses: {errors}"


def module_of(path: str) -> ModuleType:
    """A file of tests as a module; none of its tests runs."""
    name = f"corpus_{Path(path).stem}"
    if name not in sys.modules:
        spec = importlib.util.spec_from_file_location(name, TESTS / path)
        assert spec is not None
        assert spec.loader is not None
        sys.modules[name] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(sys.modules[name])
    return sys.modules[name]


def rows(function: Callable[..., None]) -> list[Any]:
    """The cases of a test."""
    return [*function.pytestmark[0].args[1]]  # type: ignore[attr-defined] # pytest puts it there


def corpus() -> Iterator[tuple[FileKind, str, str]]:
    """(kind, name, text) of the good and bad files of the tests."""
    yield FileKind.ARCHITECTURE, "good", GOOD
    for name, (before, after, *_) in BAD.items():
        yield FileKind.ARCHITECTURE, name, GOOD.replace(before, after, 1)
    for path in ("model/test_resource_kinds.py", "model/test_sequences.py"):
        module = module_of(path)
        yield FileKind.ARCHITECTURE, path, module.GOOD
        for name, (before, after, *_) in module.BAD.items():
            yield FileKind.ARCHITECTURE, name, module.GOOD.replace(before, after, 1)
    rules = module_of("supervision/test_rules_file.py")
    yield FileKind.RULES, "rules", rules.GOOD
    for before, after, *_ in rows(rules.test_bad_files_are_refused_in_one_line_that_points_at_the_place):
        yield FileKind.RULES, after, rules.GOOD.replace(before, after, 1)
    for text in rows(rules.test_what_is_no_rules_file_is_refused):
        yield FileKind.RULES, f"none: {text}", text
    leaves = module_of("supervision/test_condition_kinds.py")
    for text in [
        *(each for texts in leaves.GOOD.values() for each in texts),
        *(bad for bad, _ in leaves.BAD),
    ]:
        leaf = text.replace(leaves.MARK, "")
        yield FileKind.RULES, leaf, f"mauve: 1\nrules:\n- name: one\n  when: {{{leaf}}}\n  do: [{STOP}]\n"
    model = module_of("modelling/test_checks.py")
    guidance = model.GUIDANCE.read_text(encoding="utf-8")
    for before, after, *_ in rows(model.test_what_cannot_be_is_refused_at_its_place):
        yield FileKind.MODEL, after, guidance.replace(before, after)


STOP = "{kind: stop, target: camera}"
STEPS_FILES = [
    f"[{STOP}]",
    f"steps: [{STOP}]\nforce: true",
    "[{kind: resynchronise}]",
    "[{kind: set_property, target: a, name: b, value: 2.5}]",
    "[{kind: set_property, target: a, name: b}]",
    "[{kind: connect, target: a, name: b, value: c.read}]",
    "[{kind: add_resource, target: a, value: {kind: event}}]",
    "[{kind: add_component, target: a, value: {shell: a/B, core: a/C, fsm: a/D}}]",
    "[{kind: add_component, target: a, value: 'shell: a/B'}]",
    "[{kind: replace_core, target: a, name: b/C, value: {probation_s: 5, revert_on: [fault, nan]}}]",
    "[]",
    "steps: []",
    "{}",
    "[{kind: stop}]",
    "[{kind: stop, target: ''}]",
    "[{kind: stop, target: 'a b'}]",
    "[{kind: explode, target: a}]",
    "[{kind: resynchronise, target: a}]",
    "[{kind: replace_core, target: a}]",
    "[{kind: connect, target: a, name: b}]",
    "[{kind: connect, target: a, name: b, value: [1]}]",
    "[{kind: add_resource, target: a}]",
    "[{kind: stop, target: a, nmae: b}]",
    f"steps: [{STOP}]\nforce: maybe",
    f"steps: [{STOP}]\nfroce: true",
]


@pytest.mark.parametrize("kind", FileKind)
def test_a_schema_is_one(kind: FileKind) -> None:
    schema = file_schema(kind)
    Draft202012Validator.check_schema(schema)
    assert schema["$id"] == f"urn:mauve_rt:schema:{kind.value}:1"


@pytest.mark.parametrize("kind", FileKind)
def test_mauve_schema_prints_a_schema_of_each_kind(
    kind: FileKind, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["schema", kind.value]) == 0
    assert json.loads(capsys.readouterr().out) == file_schema(kind)


def test_mauve_schema_of_another_kind_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(["schema", "robot"])
    assert "choose from 'architecture', 'rules', 'steps', 'model'" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("kind", "name", "text"), [pytest.param(*each, id=f"{each[0].value}: {each[1]}") for each in corpus()]
)
def test_a_file_of_the_tests_has_the_same_verdict(kind: FileKind, name: str, text: str) -> None:
    try:
        file = YamlFile(name, text=text)
    except ArchitectureFileError:
        return  # no YAML
    held_against_the_schema(kind, file)


@pytest.mark.parametrize("text", STEPS_FILES)
def test_steps_have_the_same_verdict(text: str) -> None:
    held_against_the_schema(FileKind.STEPS, YamlFile("steps.yaml", text=text))


def test_each_kind_of_step_has_the_same_verdict_with_and_without_each_key() -> None:
    for name in STEP_KINDS:
        for keys in ("", "target", "name", "value", "target name", "target value", "target name value"):
            step = {"kind": name} | dict.fromkeys(keys.split(), "text")
            assert validator(FileKind.STEPS).is_valid([step]) == (not faults_of(FileKind.STEPS, [step])), step


FILES = [
    path
    for pattern in ("mauve_examples/**/*.yaml", "tests/downstream/**/*.yaml", "tests/python/**/*.yaml")
    for path in sorted(ROOT.glob(pattern))
    if "maps" not in path.parts
]


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_a_file_of_the_project_is_accepted(path: Path) -> None:
    kind, file = file_kind(path), YamlFile(path)
    assert not faults_of(kind, file.data)
    held_against_the_schema(kind, file)


def test_every_kind_of_file_is_in_the_corpus() -> None:
    assert {kind for kind, *_ in corpus()} | {FileKind.STEPS} == {*FileKind}
    assert {file_kind(path) for path in FILES} >= {FileKind.ARCHITECTURE, FileKind.RULES, FileKind.MODEL}


def test_every_key_is_described_with_its_unit_range_and_default() -> None:
    schema = file_schema(FileKind.ARCHITECTURE)
    settings = schema["$defs"]["ComponentModel"]["properties"]
    assert settings["stack_bytes"]["description"].endswith(
        "Unit: bytes. Range: 65,536 to 1,073,741,824. Default: 524288."
    )
    assert (settings["stack_bytes"]["minimum"], settings["stack_bytes"]["maximum"]) == (65536, 2**30)
    assert settings["overrun"]["default"] == "skip"
    assert settings["overrun"]["description"].endswith("Default: skip.")
    for kind in FileKind:
        schema = file_schema(kind)
        sections = [each for each in (schema, *schema["$defs"].values()) if each.get("type") == "object"]
        keys = {key: each for section in sections for key, each in section["properties"].items()}
        assert len(keys) > ONLY_A_FEW
        assert [key for key, each in keys.items() if not each.get("description", "").endswith(".")] == []


@pytest.mark.parametrize("pattern", [r"\w+", r"[\w./+-]+", r"(?P<a>\d)\s*x"])
def test_a_pattern_is_of_ascii_and_whole(pattern: str) -> None:
    form = text_form(pattern, without="__")["pattern"]
    assert "?P" not in form
    for text in ("a", "1x", "1 x", "a\n", "é", "a__b", "x y", "\u0661x"):
        whole = re.fullmatch(pattern, text, re.ASCII) is not None and "__" not in text
        assert (re.search(form, text) is not None) == whole, text


JUNK = st.sampled_from(
    [
        None,
        True,
        0,
        1,
        -1,
        1.5,
        10**30,
        float("inf"),
        "",
        "a b",
        "a__b",
        "a\n",
        "a/B",
        "x.y",
        "installed",
        [],
        ["a"],
        {},
        {"a": 1},
    ]
)


def values_of(kind: kinds.Kind) -> st.SearchStrategy[Any]:  # noqa: PLR0911 - one for each kind
    """Values of which most are good."""
    match kind:
        case kinds.Flag():
            return st.booleans()
        case kinds.Whole():
            return st.integers(kind.least, kind.most)
        case kinds.Real():
            low, most = max(kind.least, kind.above, -1e6), min(kind.most, 1e6)
            return st.floats(low, most) | st.integers(int(low) + 1, int(most))
        case kinds.Choice():
            return st.sampled_from(kind.values)
        case kinds.Scalar():
            return st.booleans() | st.integers() | st.text(max_size=3)
        case kinds.Text():
            return st.from_regex(re.compile(kind.pattern or "[a-z]*", re.ASCII), fullmatch=True)
        case kinds.ListOf():
            most = kind.few + 2 if kind.many is None else kind.many
            return st.lists(values_of(kind.kind), min_size=kind.few, max_size=most)
        case kinds.TableOf():
            return st.dictionaries(values_of(kind.names), values_of(kind.kind), min_size=kind.few, max_size=2)
        case Part():
            return sections_of(kind.section)
    raise TypeError(kind)


@cache
def sections_of(section: type[Section]) -> st.SearchStrategy[Any]:
    needed = {key: values_of(each.kind) for key, each in section.settings.items() if each.is_required}
    others = {
        key: values_of(each.kind) | (st.none() if each.default is None else st.nothing())
        for key, each in section.settings.items()
        if not each.is_required
    }
    return st.fixed_dictionaries(needed, optional=others)


def places(value: Any) -> Iterator[tuple[Any, Any]]:
    """(container, key) of each value in another."""
    entries = (
        value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    )
    for key, each in list(entries):
        yield value, key
        yield from places(each)


@given(st.data())
def test_a_random_architecture_has_the_same_verdict(data: st.DataObject) -> None:
    content = data.draw(sections_of(FileModel))
    for _ in range(data.draw(st.integers(0, 2))):
        container, key = data.draw(st.sampled_from(list(places(content))))
        if data.draw(st.booleans()):
            container[key] = data.draw(JUNK)
        elif isinstance(container, dict):
            container[data.draw(st.sampled_from(["kind", "capacity", "wran", "offers"]))] = data.draw(JUNK)
    file = YamlFile("robot.yaml", text="{}")
    file.data = content
    held_against_the_schema(FileKind.ARCHITECTURE, file)
