"""One check of what a property is set to: the kernel's, which files and requests ask."""

import math

import pytest
from python_parts import ActFsm, IdleCore

from mauve_rt._kernel import Architecture, MauveError, PluginRegistry, PropertyDescription
from mauve_rt.api import Shell, property  # noqa: A004
from mauve_rt.model.checks import property_mismatch
from mauve_rt.model.schema import PropertyValue


class PropertiesShell(Shell):
    gain = property(0.5)
    range = property(2.0, minimum=0.0, maximum=2.5, unit="m")
    size = property(3, minimum=1, unit="1")
    label = property("a")
    on = property(True)


@pytest.fixture(scope="module")
def known() -> dict[str, PropertyDescription]:
    architecture = Architecture(PluginRegistry())
    architecture.add_component("c", PropertiesShell, IdleCore, ActFsm)
    (component,) = architecture.components()
    return {item.name: item for item in component.properties}


@pytest.mark.parametrize(
    ("name", "value", "facts"),
    [
        ("range", 2.75, ("at least 0 m and at most 2.5 m", "2.75", "out_of_range")),
        ("range", 3, ("at least 0 m and at most 2.5 m", "3", "out_of_range")),
        ("range", "far", ("a number", "'far'", "type_mismatch")),
        ("gain", math.nan, ("a number", "nan", "out_of_range")),
        ("gain", 10**30, ("a number of at most 64 bits", str(10**30), "out_of_range")),
        ("size", 0, ("at least 1", "0", "out_of_range")),
        ("size", 1.5, ("a whole number", "1.5", "type_mismatch")),
        ("size", True, ("a whole number", "true", "type_mismatch")),
        ("label", 5, ("text", "5", "type_mismatch")),
        ("on", 1, ("true or false", "1", "type_mismatch")),
    ],
)
def test_what_a_property_does_not_take_is_told(
    known: dict[str, PropertyDescription], name: str, value: PropertyValue, facts: tuple[str, str, str]
):
    told = property_mismatch(known[name], value)
    assert (told["expected"], told["found"], told["code"]) == facts


@pytest.mark.parametrize(
    ("name", "value"),
    [("range", 2), ("range", 0.0), ("gain", -math.inf), ("size", 2**62), ("label", ""), ("on", False)],
)
def test_what_a_property_takes_is_not_told(
    known: dict[str, PropertyDescription], name: str, value: PropertyValue
):
    assert property_mismatch(known[name], value) == {}


def test_setting_it_asks_the_same(known: dict[str, PropertyDescription]):
    architecture = Architecture(PluginRegistry())
    component = architecture.add_component("c", PropertiesShell, IdleCore, ActFsm)
    with pytest.raises(MauveError) as refused:
        component.set_property("gain", math.nan)
    facts = property_mismatch(known["gain"], math.nan)
    assert (refused.value.expected, refused.value.code) == (facts["expected"], facts["code"])
