"""The public names of Python that docs/public_api.md lists, with signatures and docstrings."""

import ast
import re

from _reference import ROOT
from _reference.python_source import (
    Definition,
    decorators,
    doc_of,
    file_of,
    find,
    signature,
    tree_of,
)
from _reference.tables import table

_LIST = re.compile(r"^`(mauve_rt[\w.]*)`: ((?:`\w+`[,\s]*)+)", re.MULTILINE)


def public_names() -> dict[str, list[str]]:
    """The names of each module, as docs/public_api.md lists them."""
    text = (ROOT / "docs" / "public_api.md").read_text(encoding="utf-8")
    names = {module: re.findall(r"`(\w+)`", listed) for module, listed in _LIST.findall(text)}
    for full in re.findall(r"`(mauve_rt\.[\w.]+\.\w+)`", text[text.index("Of other modules") :]):
        module, _, name = full.rpartition(".")
        names.setdefault(module, []).append(name)
    return names


def text() -> str:
    """A section for each module."""
    parts = []
    for module, names in public_names().items():
        parts.append(f"## {module}\n")
        parts += [_entry(module, name) for name in names]
    return "\n".join(parts)


def _entry(module: str, name: str) -> str:
    home, nodes = find(module, name)
    head = f"### `{name}`\n"
    first = nodes[0]
    if isinstance(first, ast.ClassDef):
        return f"{head}\n{_class(first)}"
    if isinstance(first, ast.FunctionDef):
        return f"{head}\n{_functions([node for node in nodes if isinstance(node, ast.FunctionDef)])}"
    return f"{head}\n`{ast.unparse(first)}`\n\n{below(home, nodes)}"


def _functions(nodes: list[ast.FunctionDef]) -> str:
    lines = [f"`{signature(node)}`" for node in nodes]
    says = next((doc_of(node) for node in nodes if doc_of(node)), "")
    return "\n\n".join([*lines, says]) + "\n"


def _class(node: ast.ClassDef) -> str:
    rows = [row for member in node.body if (row := _member(member))]
    functions = [each for each in node.body if isinstance(each, ast.FunctionDef)]
    made = next((each for each in functions if each.name == "__init__"), None)
    shown = [f"`{signature(made).replace('__init__', node.name).removesuffix(' -> None')}`"] if made else []
    says = [doc_of(node)] if doc_of(node) else []
    members = [table(("member", "meaning"), rows)] if rows else []
    return "\n\n".join([*shown, *says, *members]) + "\n"


def _member(member: ast.stmt) -> tuple[str, str] | None:
    if isinstance(member, ast.FunctionDef) and not member.name.startswith("_"):
        is_value = any(each in ("property", "cached_property") for each in decorators(member))
        returns = ast.unparse(member.returns) if member.returns else ""
        return f"`{f'{member.name}: {returns}' if is_value else signature(member)}`", doc_of(member)
    if isinstance(member, ast.AnnAssign) and isinstance(member.target, ast.Name):
        if member.target.id.startswith("_"):
            return None
        return f"`{member.target.id}: {ast.unparse(member.annotation)}`", ""
    return None


def below(module: str, nodes: list[Definition]) -> str:
    """The text below an assignment."""
    body = tree_of(file_of(module)).body
    following = body[body.index(nodes[-1]) + 1 :][:1] if nodes[-1] in body else []
    for node in following:
        if (
            isinstance(node, ast.Expr)
            and isinstance(node.value, ast.Constant)
            and isinstance(node.value.value, str)
        ):
            return " ".join(node.value.value.split()) + "\n"
    return ""
