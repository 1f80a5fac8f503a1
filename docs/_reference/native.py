"""A stand-in for the native library and our messages: the documentation needs no ROS, no native library.

It has the classes and functions of mauve_rt/_kernel.pyi, which the build writes. The tables of the kernel
(settings, kinds of resources and of conditions) come from kernel_tables.json, and
tests/python/project/test_reference.py compares that file with the kernel.
"""

import ast
import json
import re
import sys
import types
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
_CONSTANT = re.compile(r"^\w+ ([A-Z][A-Z0-9_]*)=(-?\d+)", re.MULTILINE)
TABLES = Path(__file__).with_name("kernel_tables.json")


class _Row(types.SimpleNamespace):
    """A row of a table, with the fields that the native class has."""


def install() -> None:
    """Put the stubs into sys.modules, where the imports of MAUVE RT find them."""
    if getattr(sys.modules.get("mauve_rt._kernel"), "is_stub", False):
        return
    messages = _package("mauve_msgs", ("action", "msg", "srv"))
    for file in sorted((ROOT / "mauve_msgs").glob("*/*.*")):
        setattr(getattr(messages, file.parent.name), file.stem, _message_class(file))
    for name in ("_kernel", "_bridge"):
        _add(f"mauve_rt.{name}", _of_stub_file(ROOT / "mauve_rt" / f"{name}.pyi"))
    kernel: Any = sys.modules["mauve_rt._kernel"]
    tables = json.loads(TABLES.read_text(encoding="utf-8"), object_hook=lambda row: _Row(**row))
    kernel.TASK_SETTINGS = {each.name: each for each in tables.task_settings}
    kernel.given_resource_kinds = lambda: tables.resource_kinds
    kernel.condition_kinds = lambda: tables.condition_kinds


def _of_stub_file(file: Path) -> dict[str, Any]:
    """The names of a .pyi file. Annotations stay text, and other modules of MAUVE RT are not imported."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    declared = [node for node in tree.body if isinstance(node, ast.AnnAssign) and node.value is None]
    values = [ast.unparse(node.target) for node in declared]
    tree.body = [
        node
        for node in tree.body
        if not (isinstance(node, ast.ImportFrom) and str(node.module).startswith(("mauve_rt", "typing")))
    ]
    space: dict[str, Any] = {
        **dict.fromkeys(values),
        "__name__": f"mauve_rt.{file.stem}",
        "type_check_only": lambda each: each,
    }
    code = "from __future__ import annotations\nfrom typing import *\n"
    exec(compile(code, str(file), "exec"), space)  # noqa: S102 - a file of our own
    exec(  # noqa: S102 - a file of our own
        compile(tree, str(file), "exec", flags=__import__("__future__").annotations.compiler_flag), space
    )
    return space


def _message_class(file: Path) -> type:
    """A class with the constants of a .msg or .srv file."""
    found = _CONSTANT.findall(file.read_text(encoding="utf-8"))
    return type(file.stem, (), {name: int(value) for name, value in found})


def _package(name: str, parts: tuple[str, ...]) -> Any:
    package = _add(name, {"__path__": []})
    for part in parts:
        setattr(package, part, _add(f"{name}.{part}", {}))
    return package


def _add(name: str, values: dict[str, Any]) -> types.ModuleType:
    module = types.ModuleType(name)
    vars(module).update({**values, "is_stub": True, "__name__": name})
    sys.modules[name] = module
    return module
