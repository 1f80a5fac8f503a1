"""Signatures and docstrings of Python sources, without importing them."""

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from _reference import ROOT

Definition = ast.ClassDef | ast.FunctionDef | ast.Assign | ast.AnnAssign


@cache
def tree_of(file: Path) -> ast.Module:
    """The syntax tree of a file."""
    return ast.parse(file.read_text(encoding="utf-8"))


def file_of(module: str) -> Path:
    """The source of a module, or its stub where it is native."""
    base = ROOT / module.replace(".", "/")
    for file in (base / "__init__.py", base.with_suffix(".py"), base.with_suffix(".pyi")):
        if file.is_file():
            return file
    raise ValueError(f"module {module}: expected a source, found none")


def find(module: str, name: str) -> tuple[str, list[Definition]]:
    """The module that defines a name, and its definitions: several of a function with overloads."""
    found: list[Definition] = []
    for node in _statements(tree_of(file_of(module)).body):
        if isinstance(node, ast.ImportFrom) and name in [each.asname or each.name for each in node.names]:
            return find(str(node.module), name)
        if isinstance(node, Definition) and name in _names(node):
            found.append(node)
    if not found:
        raise ValueError(f"{module}.{name}: expected a definition, found none")
    return module, found


def _statements(body: list[ast.stmt]) -> Iterator[ast.stmt]:
    """Also those in the branches of `if TYPE_CHECKING`."""
    for node in body:
        yield node
        if isinstance(node, ast.If):
            yield from node.body


def _names(node: Definition) -> list[str]:
    if isinstance(node, ast.ClassDef | ast.FunctionDef):
        return [node.name]
    targets = node.targets if isinstance(node, ast.Assign) else [node.target]
    return [target.id for target in targets if isinstance(target, ast.Name)]


def doc_of(node: ast.AST) -> str:
    """The first paragraph of a docstring, in one line."""
    text = ast.get_docstring(node) if isinstance(node, ast.ClassDef | ast.FunctionDef) else None
    return " ".join((text or "").partition("\n\n")[0].split())


def signature(node: ast.FunctionDef) -> str:
    """`name(arguments) -> type`, without self."""
    arguments = ast.unparse(node.args).removeprefix("self, ").removeprefix("cls, ")
    arguments = "" if arguments in ("self", "cls") else arguments
    returns = f" -> {ast.unparse(node.returns)}" if node.returns is not None else ""
    return f"{node.name}({arguments}){returns}"


def decorators(node: ast.FunctionDef) -> list[str]:
    """Their names."""
    return [ast.unparse(each) for each in node.decorator_list]
