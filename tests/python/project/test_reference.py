"""docs/reference/: all that the programs know is on its page, with a description.

The pages are generated with a stub in the place of the native library. These tests ask the native library,
the generated messages and the programs themselves.
"""

import json
import re
import runpy
import subprocess
import sys
from collections.abc import Iterator, Mapping
from functools import cache
from importlib import import_module
from pathlib import Path

import pytest

from mauve_rt._kernel import ERROR_REPLIES, condition_kinds, given_resource_kinds
from mauve_rt.cli.main import build_parser
from mauve_rt.cli.verb import EXIT_STATUSES
from mauve_rt.control.requests import Code
from mauve_rt.file_schema.kinds import Kind, ListOf, TableOf, Text
from mauve_rt.file_schema.section import Part, Section, setting
from mauve_rt.model.plugins import KINDS
from mauve_rt.model.schema import FileModel
from mauve_rt.model.step_kinds import STEP_KINDS
from mauve_rt.model.steps import Change, StepForm
from mauve_rt.modelling.schema import ModelFile
from mauve_rt.node.executor.settings import help_text as executor_help
from mauve_rt.node.supervisor.settings import help_text as supervisor_help
from mauve_rt.supervision.rules import Rules
from mauve_rt.supervision.script import Script
from mauve_rt.supervision.when import COMBINATIONS, TIMES
from mauve_rt.trace.format.records import Kind as RecordKind

ROOT = Path(__file__).resolve().parents[3]
PAGES = ROOT / "docs" / "reference"
MARK = re.compile(r"^<!-- generated: (\w+) -->$", re.MULTILINE)
_GENERATE = (
    "import _reference, json; print(json.dumps({name: part() for name, part in _reference.parts().items()}))"
)


def _python(code: str) -> subprocess.CompletedProcess[str]:
    """Run in another process: the stub of the native library is not for this one."""
    command = [sys.executable, "-B", "-c", f"import sys; sys.path.insert(0, {str(ROOT / 'docs')!r}); {code}"]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@cache
def _parts() -> Mapping[str, str]:
    done = _python(_GENERATE)
    assert done.returncode == 0, done.stderr
    parts: Mapping[str, str] = json.loads(done.stdout)
    return parts


def _rows(part: str) -> list[list[str]]:
    return [
        re.split(r"(?<!\\) ?\| ?", line)[1:-1]
        for line in _parts()[part].splitlines()
        if line.startswith("| ")
    ]


def _described(part: str) -> set[str]:
    """The names in the first column of the rows whose last column says something."""
    return {row[0].strip("`") for row in _rows(part) if row[-1]}


def _headings(part: str) -> set[str]:
    return {line.lstrip("#").strip(" `") for line in _parts()[part].splitlines() if line.startswith("#")}


def _sections(kind: Kind) -> Iterator[type[Section]]:
    if isinstance(kind, Part):
        yield kind.section
        for each in kind.section.settings.values():
            yield from _sections(each.kind)
    elif isinstance(kind, ListOf | TableOf):
        yield from _sections(kind.kind)


def _keys(section: type[Section]) -> set[str]:
    return {key for each in _sections(Part(section)) for key in each.settings}


def test_each_page_is_in_the_contents_and_each_part_on_one_page() -> None:
    contents = (PAGES / "index.md").read_text(encoding="utf-8")
    pages = [page for page in PAGES.glob("*.md") if page.name != "index.md"]
    assert [page.stem for page in pages if f"\n{page.stem}\n" not in contents] == []
    marks = [name for page in pages for name in MARK.findall(page.read_text(encoding="utf-8"))]
    assert sorted(marks) == sorted(_parts())


def test_no_package_is_needed_but_those_of_docs_txt() -> None:
    """And neither the native library nor ROS 2, even where they are installed."""
    wanted = re.compile(r"^([\w-]+)==", re.MULTILINE)
    run, docs = (
        set(wanted.findall((ROOT / "requirements" / name).read_text(encoding="utf-8")))
        for name in ("run.txt", "docs.txt")
    )
    others = [*(run - docs), "numpy", "rclpy", "rcl_interfaces", "std_msgs"]
    assert "rich" in others
    absent = f"sys.modules.update(dict.fromkeys({others!r}))"
    is_stub = "assert sys.modules['mauve_rt._kernel'].is_stub"
    done = _python(f"{absent}; {_GENERATE}; {is_stub}")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == _parts()


def test_the_pages_in_the_repository_have_what_the_sources_say() -> None:
    code = (
        "from _reference import PAGES, filled, parts; known = parts(); "
        "texts = {page: page.read_text('utf-8') for page in PAGES}; "
        "print(*[page.name for page, text in texts.items() if filled(text, known) != text])"
    )
    done = _python(code)
    assert (done.stderr, done.stdout.strip()) == ("", ""), "run python docs/_reference/pages.py"


def test_the_stub_has_the_tables_of_the_kernel() -> None:
    module = runpy.run_path(str(ROOT / "docs" / "_reference" / "kernel_tables.py"))
    present = json.loads(json.dumps(module["tables"]()))
    assert json.loads(module["FILE"].read_text(encoding="utf-8")) == present, (
        "run python docs/_reference/kernel_tables.py"
    )


@pytest.mark.parametrize(
    ("part", "file"),
    [
        ("architecture_file", FileModel),
        ("model_file", ModelFile),
        ("rules_file", Rules),
        ("script_file", Script),
        ("steps_file", Change),
    ],
)
def test_each_key_of_a_file_is_described(part: str, file: type[Section]) -> None:
    keys = _keys(file) | (set(StepForm.settings) if file is Change else set())
    assert len(keys) > 1
    assert keys - _described(part) == set()


def test_each_kind_of_resource_has_its_keys() -> None:
    of_files = {
        each.name for kind in given_resource_kinds() for each in kind.parameters if each.file_key == each.name
    }
    assert {"capacity", "max_readers"} <= of_files
    assert of_files - _described("architecture_file") == set()
    assert {kind.name for kind in given_resource_kinds()} - _headings("architecture_file") == set()


def test_each_condition_has_its_keys() -> None:
    text = _parts()["rules_file"]
    for kind in condition_kinds():
        section = text.partition(f"### {kind.name}\n")[2].partition("###")[0]
        assert kind.summary in section
        assert {f"`{each.name}`" for each in kind.parameters} <= set(re.findall(r"`\w+`", section))
    assert {*COMBINATIONS, *TIMES} - _described("rules_file") == set()


def test_each_kind_of_step_is_described() -> None:
    assert set(STEP_KINDS) - _described("steps_file") == set()


def _commands() -> Iterator[tuple[str, str]]:
    """Each verb with what its --help prints."""
    pending = [build_parser()]
    while pending:
        parser = pending.pop()
        for action in parser._actions:
            if isinstance(action.choices, dict):
                pending += action.choices.values()
                yield from ((verb.prog, verb.format_help()) for verb in action.choices.values())


def test_each_verb_and_option_is_described() -> None:
    commands = dict(_commands())
    assert {"mauve list", "mauve record start", "mauve rules explain", "mauve trace stats"} <= set(commands)
    assert set(commands) - _headings("commands") == set()
    for command, printed in commands.items():
        section = re.split(r"^#+ ", _parts()["commands"].partition(f"# {command}\n")[2], flags=re.MULTILINE)[
            0
        ]
        options = set(re.findall(r"--\w[\w-]*", printed.partition("options:")[2])) - {"--help"}
        assert {option for option in options if not re.search(rf"`{option}\b", section)} == set(), command
    assert {str(status) for status in EXIT_STATUSES} - _described("commands") == set()


@pytest.mark.parametrize("printed", [executor_help(), supervisor_help()])
def test_each_parameter_is_described(printed: str) -> None:
    parameters = set(re.findall(r"^  -p ([a-z_]+):=", printed, re.MULTILINE))
    assert "rules" in parameters
    assert parameters - _described("node_parameters") == set()


@pytest.mark.parametrize(
    ("part", "module", "sections"),
    [
        ("messages", "mauve_msgs.msg", ()),
        ("services", "mauve_msgs.srv", ("Request", "Response")),
        ("actions", "mauve_msgs.action", ("Goal", "Result", "Feedback")),
    ],
)
def test_each_field_of_messages_services_and_actions_is_there(
    part: str, module: str, sections: tuple[str, ...]
) -> None:
    types = {
        name: each
        for name, each in vars(import_module(module)).items()
        if isinstance(each, type) and "_" not in name
    }
    assert set(types) - _headings(part) == set()
    for name, each in types.items():
        section = _parts()[part].partition(f"## {name}\n")[2].partition("\n## ")[0]
        bodies = [getattr(each, section) for section in sections] or [each]
        fields = {field for body in bodies for field in body.get_fields_and_field_types()}
        assert {field for field in fields if f"`{field}`" not in section} == set(), name


def test_each_error_code_has_meaning_remedy_and_reply() -> None:
    rows = {row[0].strip("`"): row for row in _rows("errors")}
    for code, reply in ERROR_REPLIES.items():
        name, meaning, remedy, answered = rows[code]
        assert meaning.endswith(".")
        assert remedy.endswith(".")
        assert answered == f"`{reply}`", name
    constants = {code.name for code in Code}
    assert constants - _described("errors") == set()


def test_each_kind_of_record_and_of_plug_in_is_there() -> None:
    kinds = {row[0].strip("`"): row for row in _rows("trace_records")}
    assert {kind.name: str(int(kind)) for kind in RecordKind} == {
        name: row[1] for name, row in kinds.items() if name in RecordKind.__members__
    }
    assert set(KINDS) - _described("plugin_kinds") == set()
    assert {"~/trace/batches", "~/state", "mauve_topics", "mauve_dropped_messages"} <= _described("bag")


@pytest.mark.parametrize("module", ["mauve_rt", "mauve_rt.api", "mauve_rt.trace", "mauve_rt.trace.report"])
def test_each_public_name_of_python_is_there(module: str) -> None:
    assert module in _headings("python_api")
    assert set(import_module(module).__all__) - _headings("python_api") == set()


def test_each_public_header_is_there() -> None:
    door = (ROOT / "mauve_rt/kernel/include/mauve_rt/mauve_rt.hpp").read_text(encoding="utf-8")
    assert set(re.findall(r'^#include "(.*)"$', door, re.MULTILINE)) - _headings("headers") == set()
    assert "void commit" in _parts()["headers"] or "commit(Transaction" in _parts()["headers"]


def test_a_key_cannot_be_declared_without_a_description() -> None:
    with pytest.raises(TypeError, match="what"):
        setting(Text())  # type: ignore[call-arg]


NO_HELP = (
    "import argparse; from _reference import commands; parser = argparse.ArgumentParser(prog='mauve');"
    "parser.add_subparsers(metavar='VERB').add_parser('list', help='show').add_argument('--json');"
    "commands.build_parser = lambda: parser"
)
NO_PARAMETER = (
    "from mauve_rt.node.executor.settings import PARAMETERS;"
    "PARAMETERS['rules'] = PARAMETERS['rules']._replace(description='')"
)
NO_KEY = "from mauve_rt.model.schema import ExecutorModel; ExecutorModel.settings['peers'].what = ''"
NO_STEP = "from mauve_rt.model.step_kinds import STEP_KINDS; vars(STEP_KINDS['start'])['what'] = ''"


@pytest.mark.parametrize(
    ("part", "change", "error"),
    [
        ("architecture_file", NO_KEY, "peers: expected a description"),
        ("steps_file", NO_STEP, "step start: expected a description"),
        ("node_parameters", NO_PARAMETER, "parameter rules: expected a description"),
        ("commands", NO_HELP, "mauve list json: expected a help text"),
    ],
)
def test_a_missing_description_ends_the_build(part: str, change: str, error: str) -> None:
    done = _python(f"import _reference; parts = _reference.parts(); {change}; parts[{part!r}]()")
    assert done.returncode != 0
    assert error in done.stderr


ERROR_CODES = ("errors", "errors._HEADER", "mauve_rt/kernel/include/mauve_rt/base/error.hpp")
REPLY_CODES = ("errors", "errors._REPLIES", "mauve_msgs/msg/ReplyCode.msg")
RECORDS = ("trace_records", "traces._RECORD", "mauve_msgs/msg/TraceRecord.msg")


@pytest.mark.parametrize(
    ("source", "comment", "name"),
    [
        (ERROR_CODES, r"  /// .*\n(?=  io,)", "io"),
        (REPLY_CODES, "# done", "OK"),
        (RECORDS, "(?<=START=2).*", "START"),
    ],
)
def test_a_missing_comment_ends_the_build(
    source: tuple[str, str, str], comment: str, name: str, tmp_path: Path
) -> None:
    part, path, file = source
    text = (ROOT / file).read_text(encoding="utf-8")
    changed = tmp_path / "changed"
    changed.write_text(re.sub(comment, "", text, count=1), encoding="utf-8")
    assert changed.read_text(encoding="utf-8") != text
    change = f"import pathlib; from _reference import errors, traces; {path} = pathlib.Path({str(changed)!r})"
    done = _python(f"import _reference; parts = _reference.parts(); {change}; parts[{part!r}]()")
    assert done.returncode != 0
    assert f"{name}: expected" in done.stderr
