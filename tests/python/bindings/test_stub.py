"""`_kernel.pyi` is written by hand; here its signatures are held against those of the compiled module.

Its names are: mypy's stubtest looks at them (parts/test_typing), but knows no signatures of pybind11.
"""

import ast
import inspect
import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

from mauve_rt import _kernel

STUB = ast.parse((Path(inspect.getfile(_kernel)).parent / "_kernel.pyi").read_text(encoding="utf-8"))
CLASSES = {node.name: node for node in STUB.body if isinstance(node, ast.ClassDef)}


class Parameter(NamedTuple):
    name: str
    default: object  # its source in Python, or None


Signature = list[Parameter]


def named(body: list[ast.stmt]) -> Iterator[tuple[str, ast.stmt]]:
    for node in body:
        if isinstance(node, ast.ClassDef | ast.FunctionDef):
            yield node.name, node
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            yield node.target.id, node


def value_of(source: str | None) -> object:
    try:
        return None if source is None else repr(ast.literal_eval(source))
    except (ValueError, SyntaxError):
        return source


def told(function: ast.FunctionDef) -> Signature:
    """As the stub has it."""
    spec = function.args
    both = [*spec.posonlyargs, *spec.args]
    defaults = [None] * (len(both) - len(spec.defaults)) + [ast.unparse(each) for each in spec.defaults]
    found = [Parameter(arg.arg, value_of(text)) for arg, text in zip(both, defaults, strict=True)]
    if spec.vararg or spec.kwonlyargs:
        found.append(Parameter("*args" if spec.vararg else "*", None))
    for arg, default in zip(spec.kwonlyargs, spec.kw_defaults, strict=True):
        found.append(Parameter(arg.arg, value_of(ast.unparse(default) if default else None)))
    if spec.kwarg:
        found.append(Parameter("**kwargs", None))
    return [each for each in found if each.name != "self"]


def split(text: str) -> Iterator[str]:
    """At the commas that are in no bracket."""
    depth, begin = 0, 0
    for at, letter in enumerate(text):
        depth += (letter in "[(<{") - (letter in "])}" or (letter == ">" and text[at - 1] != "-"))
        if letter == "," and depth == 0:
            yield text[begin:at].strip()
            begin = at + 1
    if text[begin:].strip():
        yield text[begin:].strip()


def compiled(function: object, name: str) -> list[Signature]:
    """As pybind11 writes it first in the docstring; one for each overload."""
    found = []
    for parameters in re.findall(rf"^(?:\d+\. )?{name}\((.*)\) -> ", function.__doc__ or "", re.MULTILINE):
        signature = []
        for parameter in split(parameters):
            declared, _, default = parameter.partition(" = ")
            signature.append(Parameter(declared.partition(":")[0], value_of(default or None)))
        found.append([each for each in signature if each.name != "self"])
    return found


def stubs() -> Iterator[tuple[str, object, list[Signature]]]:
    for scope, body in [("", STUB.body), *((f"{name}.", one.body) for name, one in CLASSES.items())]:
        overloads: dict[str, list[Signature]] = {}
        for name, node in named(body):
            is_property = isinstance(node, ast.FunctionDef) and any(
                isinstance(mark, ast.Name) and mark.id == "property" for mark in node.decorator_list
            )
            if isinstance(node, ast.FunctionDef) and not is_property and not name.startswith("__eq"):
                overloads.setdefault(name, []).append(told(node))
        for name, signatures in overloads.items():
            owner = getattr(_kernel, scope[:-1]) if scope else _kernel
            yield f"{scope}{name}", getattr(owner, name), signatures


STUBS = list(stubs())


@pytest.mark.parametrize(("name", "function", "signatures"), STUBS, ids=[name for name, _, _ in STUBS])
def test_functions_have_the_signatures_of_their_stubs(name: str, function: object, signatures: object):
    assert signatures == compiled(function, name.rpartition(".")[2])


def test_settings_of_a_task_have_the_names_of_their_stub():
    assert {name for name, _ in named(CLASSES["TaskSettings"].body)} == {*_kernel.TASK_SETTINGS, "states"}
