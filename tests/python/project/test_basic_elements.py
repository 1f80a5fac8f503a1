"""The page of the basic elements has the ports and properties that the libraries register."""

import re

import pytest
from pages import PAGES

from mauve_rt._kernel import PluginRegistry, PropertyDescription, ShellDescription
from mauve_rt.model.plugins import PluginIndex, PluginLoader

PAGE = PAGES["docs/concepts/basic_elements.md"]
ELEMENTS = re.findall(r"^### `mauve_rt/(\w+)`$", PAGE, re.MULTILINE)
# In the page's text numbers are code: they repeat what is registered, and promise nothing.
NUMBER = re.compile(r"\b\d[\d.]*\b")


def registered_shell(element: str) -> ShellDescription:
    """The shell of an element, by the library that the index names; or that of this name."""
    registry = PluginRegistry()
    loader, name = PluginLoader(registry, PluginIndex.installed()), f"mauve_rt/{element}"
    if element.endswith("Shell"):
        loader.require("shell", name)
        return registry.describe_shell(name)
    loader.require("core", name)
    return registry.describe_shell(registry.core_shell(name))


def _row(entry: PropertyDescription) -> str:
    unit = f"`{entry.unit}`" if entry.unit else ""
    value = str(entry.value).lower() if isinstance(entry.value, bool) else entry.value
    default = f"`{value}`" if value != "" else ""
    meaning = NUMBER.sub(r"`\g<0>`", entry.description)
    return f"| `{entry.name}` | {unit} | {default} | {meaning} |"


def tables(shell: ShellDescription) -> str:
    """Write the tables of an element: ports, then properties but the period of an update."""
    ports = [f"| `{port.name}` | {port.kind} | `{port.type}` |" for port in shell.ports]
    rows = [_row(entry) for entry in shell.properties if entry.description != "from one update to the next"]
    written = ["| port | | type |", "| --- | --- | --- |", *ports, ""]
    if rows:
        written += ["| property | unit | default | meaning |", "| --- | --- | --- | --- |", *rows, ""]
    return "\n".join(written)


@pytest.mark.parametrize("element", ELEMENTS)
def test_the_page_has_the_ports_and_properties_that_are_registered(element: str) -> None:
    shell = registered_shell(element)
    assert "period_us" in {entry.name for entry in shell.properties}
    section = PAGE.partition(f"### `mauve_rt/{element}`\n")[2].partition("\n#")[0]
    assert tables(shell) in f"{section}\n", f"expected in the section of {element}:\n{tables(shell)}"


def test_the_page_has_each_element_that_is_no_template_of_a_type() -> None:
    listed = PluginIndex.installed().names("core")
    names = {name.removeprefix("mauve_rt/") for name in listed if name.startswith("mauve_rt/")}
    of_a_type = re.compile(
        r"(?:Bool|Int64|Float64|Point|Pose|Pose2D|Twist)(?:Relay|Multiplexer|PriorityMultiplexer)"
    )
    assert {name for name in names if not of_a_type.fullmatch(name)} <= {*ELEMENTS}
