"""Write kernel_tables.json: the tables of the native kernel that the documentation shows.

Run this file after a change of such a table, with install/setup.bash sourced:

    python docs/_reference/kernel_tables.py
"""

import json
from pathlib import Path
from typing import Any

FILE = Path(__file__).with_name("kernel_tables.json")


def tables() -> dict[str, list[dict[str, Any]]]:
    """The tables of the kernel that is installed."""
    from mauve_rt import _kernel  # noqa: PLC0415 - not needed to find this file

    settings = [{"name": name, **_fields(each)} for name, each in _kernel.TASK_SETTINGS.items()]
    resources = [_with_parameters(kind) for kind in _kernel.given_resource_kinds()]
    conditions = [_with_parameters(kind) for kind in _kernel.condition_kinds()]
    return {"task_settings": settings, "resource_kinds": resources, "condition_kinds": conditions}


def _with_parameters(kind: Any) -> dict[str, Any]:
    return {**_fields(kind), "parameters": [_fields(each) for each in kind.parameters]}


def _fields(row: Any) -> dict[str, Any]:
    return {name: getattr(row, name) for name in dir(row) if not name.startswith("_")}


def _text(all_tables: dict[str, list[dict[str, Any]]]) -> str:
    """JSON with one row a line, so that a change is easy to read."""
    tables = [
        f"{json.dumps(name)}: [\n" + ",\n".join(f"  {json.dumps(row)}" for row in rows) + "\n]"
        for name, rows in all_tables.items()
    ]
    return "{\n" + ",\n".join(tables) + "\n}\n"


if __name__ == "__main__":
    FILE.write_text(_text(tables()), encoding="utf-8")
