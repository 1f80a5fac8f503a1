"""The tables that files are checked by: kinds of values, their bounds, sections of settings."""

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mauve_rt.errors import ArchitectureFileError
from mauve_rt.file_schema.kinds import Choice, Faults, Flag, Kind, ListOf, Real, TableOf, Text, Whole
from mauve_rt.file_schema.section import Part, Section, setting
from mauve_rt.model import load_architecture, schema, steps
from mauve_rt.supervision import rules

SECTIONS = sorted(
    {each for module in (schema, rules, steps) for each in vars(module).values() if isinstance(each, type)}
    & set(Section.__subclasses__() + schema.FileModel.__subclasses__()),
    key=lambda section: section.__name__,
)


def faults_of(kind: Kind, value: Any) -> list[str]:
    faults: Faults = []
    kind.read(value, (), faults)
    return [fault.what for fault in faults]


class Lamp(Section):
    """What the tests set."""

    name: str = setting(Text(r"\w+", "a word"), "its name")
    watts: float = setting(Real(above=0, most=100), "its power", default=5.0, hint="what it draws")
    rooms: list[int] | None = setting(
        ListOf(Whole(1, 9), few=1, many=2), "where", default=None, hint="1 to 9"
    )
    spare: "list[str]" = setting(ListOf(Text()), "parts", default=[])


class House(Section):
    """With a section in it."""

    lamp: Lamp = setting(Part(Lamp), "the first")
    lamps: dict[str, Lamp] = setting(
        TableOf(Part(Lamp), names=Text("[a-z]+", "small letters")), "others", default={}
    )


@pytest.mark.parametrize("section", SECTIONS, ids=lambda section: section.__name__)
def test_every_default_is_what_its_setting_takes(section: type[Section]):
    assert section.settings
    for key, each in section.settings.items():
        if not each.is_required:
            faults: Faults = []
            assert each.read(each.initial(), (key,), faults) == each.initial()
            assert faults == []


@pytest.mark.parametrize(
    ("kind", "value", "what"),
    [
        (Flag(), 1, "flag"),
        (Flag(), "true", "flag"),
        (Whole(0, 9), True, "whole"),
        (Whole(0, 9), "1", "whole"),
        (Whole(0, 9), 1.0, "whole"),
        (Whole(0, 9), None, "whole"),
        (Whole(0, 9), 10, "most"),
        (Real(), True, "number"),
        (Real(), "1", "number"),
        (Real(), float("nan"), "finite"),
        (Real(), float("inf"), "finite"),
        (Real(), 10**400, "finite"),
        (Real(above=0), 0, "more"),
        (Text(), 1, "text"),
        (Text(), False, "text"),
        (Choice(1), True, "choice"),
        (Choice(1), 1.0, "choice"),
        (Choice(1), "1", "choice"),
        (ListOf(Flag()), "ab", "list"),
        (ListOf(Flag()), {}, "list"),
        (TableOf(Flag()), [], "mapping"),
        (Part(Lamp), [], "mapping"),
    ],
)
def test_nothing_is_converted(kind: Kind, value: object, what: str):
    assert faults_of(kind, value) == [what]


def test_a_whole_number_is_a_number():
    read = Lamp(name="a", watts=7).watts
    assert (read, type(read)) == (7.0, float)


@given(st.integers() | st.floats(allow_nan=False))
def test_bounds_of_a_number_hold(value: float):
    inside = 0 < value <= 100
    assert (faults_of(Lamp.settings["watts"].kind, value) == []) == inside


def test_everything_wrong_is_told_at_once():
    bad = {"name": "x y", "wats": 1, "rooms": [0, "1", True], "watts": -1}
    faults: Faults = []
    House.read({"lamp": bad, "lamps": {"B": {}, "c": 5}}, (), faults)
    told = [(".".join(map(str, fault.place)), fault.what, fault.hint) for fault in faults]
    assert told == [
        ("lamp.name", "form", ""),
        ("lamp.watts", "more", "what it draws"),
        ("lamp.rooms", "many", "1 to 9"),
        ("lamp.rooms.0", "least", "1 to 9"),
        ("lamp.rooms.1", "whole", "1 to 9"),
        ("lamp.rooms.2", "whole", "1 to 9"),
        ("lamp.wats", "unknown", ""),
        ("lamps.B", "name", ""),
        ("lamps.B", "missing", ""),
        ("lamps.c", "mapping", ""),
    ]
    assert faults[6].known == ("name", "watts", "rooms", "spare")


def test_a_section_does_not_change_and_compares_by_value():
    lamp, same = Lamp(name="a", watts=5.0), Lamp(name="a")
    assert lamp == same, "given or by default"
    assert (lamp.given, same.given) == ({"name", "watts"}, {"name"})
    assert lamp.changed(watts=6) == Lamp(name="a", watts=6)
    assert repr(lamp.changed(watts=6)) == "Lamp(name='a', watts=6.0)"
    assert lamp != House(lamp=lamp)
    with pytest.raises(AttributeError, match="a Lamp does not change: watts"):
        lamp.watts = 6.0
    assert lamp.spare is not same.spare


def test_null_is_for_what_may_be_absent():
    assert Lamp(name="a", rooms=None).rooms is None
    with pytest.raises(ValueError, match="bad Lamp: name, watts"):
        Lamp(name=None, watts=None)


def test_a_program_cannot_make_what_no_file_may_say():
    with pytest.raises(ValueError, match=r"bad House: lamp\.watts"):
        House(lamp={"name": "a", "watts": 0})
    with pytest.raises(ValueError, match="bad QosModel: profile"):
        schema.QosModel(profile="relaible")  # type: ignore[arg-type]


def test_two_missing_keys_are_two_problems(tmp_path: Path):
    path = tmp_path / "robot.yaml"
    path.write_text("mauve: 1\ncomponents:\n  a: {shell: p/S}\n", encoding="utf-8")
    with pytest.raises(ArchitectureFileError) as caught:
        load_architecture(path)
    assert [problem.what for problem in caught.value.problems] == [
        "component 'a' has no 'core'",
        "component 'a' has no 'fsm'",
    ]
