"""YAML 1.2 as the project reads and writes it, held against ruamel.yaml, and the limits of what is read."""

import datetime as dt
import io
import math
import re
import string
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import assume, given
from hypothesis import strategies as st
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from mauve_rt.yaml import text as yaml_text
from mauve_rt.yaml.text import MAX_BYTES, MAX_DEPTH, YamlError, parse_yaml, read_yaml
from mauve_rt.yaml.writer import write_yaml

ROOT = Path(__file__).resolve().parents[3]
WORDS = ["true", "False", "TRUE", "tRue", "on", "off", "yes", "No", "y", "n", "null", "~", "Null", "nULL"]
NUMBERS = ["010", "0o17", "0x1F", "0b101", "-0", "+5", "1_000", "1e-3", "1.5E+3", "1.", "-.5", ".5"]
SPECIAL = [
    ".inf",
    "-.INF",
    ".nan",
    "1:30",
    "1.2.3",
    "1e",
    "0x",
    "08",
    "09",
    "-",
    "12e03",
    "1__0",
    "+.5",
    "0.1e1",
]
# What numbers, names, paths and durations in files are made of.
SCALARS = st.sampled_from(WORDS + NUMBERS + SPECIAL) | st.text("012789+-.eExob_af", min_size=1, max_size=8)
PLAIN = SCALARS | st.text(string.ascii_letters + string.digits + "_/.$()~=", min_size=1, max_size=12)
NO_CHARACTERS = ["Cc", "Cs", "Co", "Cn", "Zl", "Zp"]
TEXTS = PLAIN | st.text(st.characters(codec="utf-8", exclude_categories=NO_CHARACTERS), max_size=20)
FLOATS = st.floats(allow_nan=False) | st.sampled_from([1e-7, 1e22, math.inf, -math.inf])
VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | FLOATS | TEXTS,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(TEXTS, inner, max_size=4),
    max_leaves=20,
)


@pytest.fixture(params=["libyaml", "Python"], autouse=True)
def _parser(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Both of PyYAML's parsers; which one there is must not matter."""
    if request.param == "Python":
        monkeypatch.delattr(yaml, "CSafeLoader", raising=False)
    elif not yaml.__with_libyaml__:
        pytest.skip("this PyYAML has no libyaml")


def by_ruamel(text: str) -> Any:
    try:
        return YAML(typ="safe", pure=True).load(text)
    except (ValueError, IndexError, TypeError):
        assume(False)  # what ruamel.yaml itself stumbles over, such as `-_`


@given(text=PLAIN)
def test_a_plain_scalar_means_what_ruamel_reads(text: str):
    try:
        expected = by_ruamel(f"a: {text}")["a"]
    except YAMLError:
        assume(False)  # not plain, such as `-`
    assume(not isinstance(expected, dt.date))  # text in YAML 1.2's core schema, as here
    # To ruamel.yaml `-_1`, `._1` and `0x_1` are numbers and `.5e3` is none.
    assume(not re.match(r"[-+.0box]+_|[-+]?\..*e", text, re.IGNORECASE))
    assert repr(read_yaml(f"a: {text}")["a"]) == repr(expected)


@given(value=VALUES, flow=st.booleans())
def test_what_ruamel_writes_is_read_as_ruamel_reads_it(value: Any, flow: bool):  # noqa: FBT001
    text = _written_by_ruamel(value, flow=flow)
    # PyYAML refuses `[:a]` and, where it has no libyaml, `[a?b]`.
    assume(not flow or not re.search(r"[\[{ ]:|\?", text))
    assume(not re.search(r"\.[0-9]*e", text, re.IGNORECASE))  # to ruamel.yaml `.5e3` is no number
    assert repr(read_yaml(text)) == repr(by_ruamel(text))


@given(value=VALUES)
def test_what_is_written_reads_back_the_same_everywhere(value: Any):
    text = write_yaml(value)
    assert repr(read_yaml(text)) == repr(value)
    assert repr(by_ruamel(text)) == repr(value)
    assert repr(yaml.safe_load(text)) == repr(value), "YAML 1.1"


def _written_by_ruamel(value: Any, *, flow: bool) -> str:
    writer = YAML(typ="safe", pure=True)
    writer.default_flow_style = flow
    out = io.StringIO()
    writer.dump(value, out)
    return out.getvalue()


def _files() -> Iterator[Path]:
    for folder in ("mauve_examples", "tests", "benchmarks", "docs"):
        yield from (ROOT / folder).rglob("*.yaml")


@pytest.mark.parametrize("path", sorted(_files()), ids=lambda path: path.stem)
def test_the_files_of_the_project_mean_what_ruamel_reads(path: Path):
    text = path.read_text(encoding="utf-8")
    assert repr(read_yaml(text)) == repr(by_ruamel(text))


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("on", "on"),
        ("No", "No"),
        ("2001-01-01", "2001-01-01"),
        ("12:30:45", "12:30:45"),
        ("010", 10),
        ("0o10", 8),
        ("1e-3", 0.001),
        (".5e3", 500.0),
        ("-_", "-_"),
        ("TRUE", True),
        ("", None),
        ("'1'", "1"),
        ("!!str 1", "1"),
        ("!!float 1", 1.0),
        ("# only a remark", None),
    ],
)
def test_scalars_of_yaml_1_2(text: str, value: object):
    assert repr(read_yaml(text)) == repr(value)


def test_keys_are_text_whatever_they_look_like():
    assert read_yaml("{1: a, true: b, on: c, ~: d}") == {"1": "a", "true": "b", "on": "c", "~": "d"}


@pytest.mark.parametrize(
    "text",
    [
        "base: &base {x: 1, y: 2}\nit: {y: 3, <<: *base}\n",
        "one: &one {x: 1}\ntwo: &two {x: 2, z: 3}\nit: {<<: [*one, *two], w: 4}\n",
        "list: &list [1, 2]\nit: [*list, *list]\n",
    ],
)
def test_anchors_and_merged_mappings_are_read_as_ruamel_reads_them(text: str):
    assert read_yaml(text) == by_ruamel(text)


def test_places_are_those_of_the_text():
    root = parse_yaml("a: &a\n  b: 1\nc:\n  - 2\n  - {d: é, e: 3}\n  - *a\n")
    a, c = root.children["a"], root.children["c"]
    assert (root.key_places["c"], c.children[0].place) == ((3, 1), (4, 5))
    assert (c.children[1].key_places["e"], c.children[1].children["e"].place) == ((5, 12), (5, 15))
    assert c.children[2] is a, "what an alias stands for is where its anchor is"


@pytest.mark.parametrize(
    ("text", "place", "words"),
    [
        ("a: 1\nb: 2\n'a': 3", (3, 1), "key 'a' given twice; remove one; the first is in line 1"),
        ("x: {1: a, '1': b}", (1, 11), "key '1' given twice"),
        ("<<: {a: 1}\n<<: {b: 1}", (2, 1), "key '<<' given twice"),
        ("<<: 5", (1, 5), "expected a mapping or list of mappings for merging"),
        ("a: *b", (1, 4), "undefined alias 'b'"),
        ("? [a]\n: b", (1, 3), "expected text as a key"),
        ("a: !foo x", (1, 4), "the tag !foo does not fit"),
        ("a: !!int x", (1, 4), "the tag !!int does not fit"),
        ("a: !!python/name:os.system x", (1, 4), "the tag !!python/name:os.system does not fit"),
        ("a: !!set {x}", (1, 4), "unknown tag"),
        ("a: 1\n---\na: 2", (2, 1), "expected a single document"),
        ("%YAML 1.1\n---\na: on", (1, 1), "not YAML 1.2, but 1.1"),
        ("a: x\n\tb: 1", (2, 1), "found character '\\t'"),
        ("a: [1, 2", (1, 9), "expected ',' or ']', but got '<stream end>'"),
        ("a: b\x07", (1, 5), "the character U+0007 is not allowed"),
        ("a: \ud800", (1, 4), "the character U+D800 is not allowed"),
        (f"a: {'1' * 5000}", (1, 4), "too many digits"),
        ("[" * 5000, (1, MAX_DEPTH + 2), "nested too deeply"),
        ("- " * 5000, (1, 2 * MAX_DEPTH + 3), "nested too deeply"),
        ("x" * (MAX_BYTES + 1), (1, 1), "too large"),
    ],
    ids=lambda value: value[:20] if isinstance(value, str) else None,
)
def test_what_is_refused_and_where(text: str, place: tuple[int, int], words: str):
    with pytest.raises(YamlError) as caught:
        read_yaml(text)
    assert (caught.value.line, caught.value.column) == place
    assert words in str(caught.value)


def test_aliases_of_aliases_are_refused_before_they_fill_the_memory():
    lines = ["a: &a [1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    for before, name in zip("abcdefgh", "bcdefghi", strict=True):
        lines.append(f"{name}: &{name} [{', '.join([f'*{before}'] * 9)}]")
    with pytest.raises(YamlError, match="nested too deeply; do its aliases"):
        read_yaml("\n".join(lines))
    long = "x" * 100_000
    with pytest.raises(YamlError, match="do its aliases"):
        read_yaml(f"a: &a {long}\nb: [{', '.join(['*a'] * 200)}]")
    with pytest.raises(YamlError, match="do its aliases"):
        read_yaml(f"a: &a {{? {long}\n: 1}}\nb: [{', '.join(['*a'] * 200)}]")


def test_merging_the_same_again_and_again_is_refused_before_it_takes_its_time():
    many = ", ".join(["*a"] * 10_000)
    with pytest.raises(YamlError, match="do its aliases"):
        read_yaml(f"a: &a {{x: 1}}\nb: &b [{many}]\nc:\n" + "- {<<: *b}\n" * 10_000)


def test_an_alias_within_its_own_anchor_stands_for_nothing():
    assert read_yaml("a: &a [1, *a]") == {"a": [1, None]}


def test_bytes_that_could_be_values_are_the_limit():
    text = "[" + "1, " * 1000 + "1]"
    assert len(read_yaml(text, max_bytes=len(text) * yaml_text.BYTES_PER_VALUE)) == 1001
    with pytest.raises(YamlError, match="too large"):
        read_yaml(text, max_bytes=100)
