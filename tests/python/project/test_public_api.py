"""docs/public_api.md lists what programs may rely on: a name that comes or goes has to be entered there."""

import ast
import re
from importlib import import_module
from operator import attrgetter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
TEXT = (ROOT / "docs" / "public_api.md").read_text(encoding="utf-8")
LISTED = {
    module: re.findall(r"`(\w+)`", names)
    for module, names in re.findall(r"^`(mauve_rt[\w.]*)`: ((?:`\w+`[,\s]*)+)", TEXT, re.MULTILINE)
}
OTHERS = re.findall(r"`(mauve_rt\.[\w.]+\.\w+)`", TEXT[TEXT.index("Of other modules") :])


def test_the_lists_are_found():
    assert list(LISTED) == [
        "mauve_rt",
        "mauve_rt.api",
        "mauve_rt.driver",
        "mauve_rt.trace",
        "mauve_rt.trace.report",
    ]
    assert OTHERS


@pytest.mark.parametrize("module", LISTED)
def test_what_a_module_offers_is_listed(module: str):
    assert LISTED[module] == import_module(module).__all__


@pytest.mark.parametrize("name", OTHERS)
def test_what_other_modules_offer_is_there(name: str):
    module, _, attribute = name.rpartition(".")
    assert attrgetter(attribute)(import_module(module))


def test_the_headers_are_those_of_the_one_door():
    door = (ROOT / "mauve_rt/kernel/include/mauve_rt/mauve_rt.hpp").read_text(encoding="utf-8")
    included = re.findall(r'^#include "(.*)"$', door, re.MULTILINE)
    assert sorted(re.findall(r"`(mauve_rt/\w+/\w+\.hpp)`", TEXT)) == sorted(included)


def test_readme_shows_what_is_listed():
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    shown = set()
    for code in re.findall(r"```python\n(.*?)```", readme, re.DOTALL):
        for node in ast.walk(ast.parse(code)):
            if isinstance(node, ast.ImportFrom) and str(node.module).startswith("mauve_rt"):
                shown |= {f"{node.module}.{name.name}" for name in node.names}
            elif isinstance(node, ast.Attribute) and ast.unparse(node).startswith("mauve_rt."):
                shown.add(ast.unparse(node))
    modules = {name for name in shown if any(module.startswith(f"{name}.") for module in (*LISTED, *shown))}
    listed = {f"{module}.{name}" for module, names in LISTED.items() for name in names} | set(OTHERS)
    assert shown
    assert shown - modules - listed == set()
