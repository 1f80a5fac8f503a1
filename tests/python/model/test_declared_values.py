"""Values by their declared types: text that looks like a number stays text, and a number in quotes is one."""

import math

import pytest

from mauve_rt.model.declared_values import declared_value, read_declared
from mauve_rt.yaml.text import YamlError


@pytest.mark.parametrize(
    ("text", "type_name", "value"),
    [
        *(
            (text, "str", text)
            for text in ("007", "1e3", "on", "true", "null", "~", "0x10", "robot 2", "1_0")
        ),
        ("'007'", "str", "007"),
        ("!!int 7", "str", 7),
        ("[x]", "str", ["x"]),
        ("007 # a comment", "str", "007"),
        ("5e-06", "float", 5e-06),
        ('"5e-06"', "float", 5e-06),
        ("-1e-3", "float", -1e-3),
        ("-.inf", "float", -math.inf),
        ("1", "float", 1),
        ("true", "float", True),
        ('"1"', "int", 1),
        ('"true"', "bool", True),
        ('"1"', "bool", "1"),
        ("far", "float", "far"),
    ],
)
def test_a_text_is_read_as_the_declared_type(text: str, type_name: str, value: object) -> None:
    found = read_declared(text, type_name)
    assert (found, type(found)) == (value, type(value))


def test_text_that_is_no_yaml_is_refused() -> None:
    with pytest.raises(YamlError):
        read_declared("[", "str")


def test_a_number_of_too_many_digits_stays_text() -> None:
    assert declared_value("1" * 5000, "int") == "1" * 5000
