"""Tables with numbers: what is folded in a narrow terminal are words, never a number or its unit."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from rich import box
from rich.console import Console, Group
from rich.measure import Measurement
from rich.table import Table

_LEAST = 12
"""Characters that a column of words keeps."""
_UNLIMITED = 10_000


def number_table(names: Sequence[str], words: Sequence[str], numbers: Sequence[str]) -> Table:
    """Return a table of names and numbers, which stay whole, and of words between, which may be folded."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    for name in names:
        table.add_column(name, no_wrap=True)
    for name in words:
        table.add_column(name, overflow="fold")
    for name in numbers:
        table.add_column(name, justify="right", no_wrap=True)
    return table


def dict_table(rows: Iterable[Mapping[str, Any]], columns: Sequence[str]) -> Table:
    """Return a table of these keys of each row; None is empty."""
    table = Table(*columns, box=box.SIMPLE_HEAD, pad_edge=False)
    for row in rows:
        table.add_row(*("" if row[column] is None else str(row[column]) for column in columns))
    return table


def print_tables(view: Group, out: Console) -> None:
    """Print tables; one that the terminal is too narrow for runs over its edge."""
    width = out.width
    for one in view.renderables:
        out.width = max(width, _fit(one, out, width)) if isinstance(one, Table) else width
        out.print(one)
    out.width = width


def _fit(table: Table, out: Console, width: int) -> int:
    """Share the room that names and numbers leave among the columns of words; returns the width it takes."""
    folding = [column for column in table.columns if not column.no_wrap]
    for column in folding:
        column.max_width = 1
    options = out.options.update(max_width=_UNLIMITED)
    fixed = Measurement.get(out, options, table).maximum - len(folding)
    each = max((width - fixed) // max(len(folding), 1), _LEAST)
    for column in folding:
        column.max_width = each
    return fixed + each * len(folding)
