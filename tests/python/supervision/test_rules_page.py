"""docs/rules.md: its tables are the engine's, and its examples are conditions, one of each kind at least."""

import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from mauve_rt._kernel import ConditionParameter
from mauve_rt.file_schema.kinds import Faults
from mauve_rt.supervision.condition_table import choices, conditions
from mauve_rt.supervision.when import When, WhenPart
from mauve_rt.supervision.when_spec import refusal
from mauve_rt.yaml.text import read_yaml

PAGE = (Path(__file__).parents[3] / "docs/rules.md").read_text(encoding="utf-8")
_, EXAMPLES, _ = re.findall(r"```yaml\n(.*?)```", PAGE, re.DOTALL)


def _span(parameter: ConditionParameter) -> str:
    low, high = parameter.minimum, parameter.maximum
    if low is not None and high is not None:
        return f"{low:g} to {high:g}"
    return f"{low:g} or more" if low is not None else f"{high:g} or less" if high is not None else ""


def _otherwise(parameter: ConditionParameter) -> str:
    if parameter.required:
        return "required"
    initial = parameter.initial
    return "none" if initial is None else str(initial).lower() if isinstance(initial, bool) else str(initial)


def _row(*cells: str) -> str:
    return "|" + "|".join(f" {cell} " if cell else " " for cell in cells) + "|"


def _meanings() -> Iterator[str]:
    yield _row("condition", "holds while")
    yield _row("---", "---")
    for kind in conditions().values():
        yield _row(kind.name, kind.summary)


def _parameters() -> Iterator[str]:
    yield _row("condition", "parameter", "type", "unit", "range", "otherwise")
    yield _row(*["---"] * 6)
    for kind in conditions().values():
        for each in kind.parameters:
            type_ = ", ".join(choices(each)) or each.type
            yield _row(kind.name, each.name, type_, each.unit, _span(each), _otherwise(each))


@pytest.mark.parametrize("table", [_meanings, _parameters])
def test_the_tables_are_the_engine_s(table: Callable[[], Iterator[str]]) -> None:
    rows = list(table())
    lacking = [row for row in rows if f"{row}\n" not in PAGE]
    assert not lacking, "docs/rules.md lacks\n" + "\n".join(lacking)
    assert "\n".join(["", *rows, "", ""]) in PAGE, (
        "docs/rules.md has more, or in another order, than\n" + "\n".join(rows)
    )


def test_there_is_an_example_of_each_kind() -> None:
    read = read_yaml(EXAMPLES)
    faults: Faults = []
    trees = [WhenPart().read(each, (), faults) for each in read]
    assert not faults
    assert all(isinstance(tree, When) and refusal(tree) is None for tree in trees)
    lacking = set(conditions()) - {tree.kind for tree in trees}
    assert not lacking, f"docs/rules.md has no example of {lacking}"
