"""The stubs of the compiled modules: the build writes them, for mypy and the reference pages."""

import ast
import inspect
from importlib import import_module
from pathlib import Path
from types import ModuleType

import pytest

MODULES = [
    import_module(name) for name in ("mauve_rt._kernel", "mauve_rt._bridge", "mauve_examples._mission")
]
KERNEL = MODULES[0]


def stub_of(module: ModuleType) -> ast.Module:
    file = Path(inspect.getfile(module)).with_name(f"{module.__name__.rpartition('.')[2]}.pyi")
    return ast.parse(file.read_text(encoding="utf-8"))


def names(body: list[ast.stmt]) -> set[str]:
    found = {node.name for node in body if isinstance(node, ast.ClassDef | ast.FunctionDef)}
    return found | {ast.unparse(node.target) for node in body if isinstance(node, ast.AnnAssign)}


def described(body: list[ast.stmt], prefix: str = "") -> dict[str, str]:
    found = {}
    for node in body:
        if isinstance(node, ast.ClassDef | ast.FunctionDef):
            found[f"{prefix}{node.name}"] = ast.get_docstring(node) or ""
        if isinstance(node, ast.ClassDef):
            found |= described(node.body, f"{node.name}.")
    return found


@pytest.mark.parametrize("module", MODULES, ids=lambda module: module.__name__)
def test_a_stub_has_all_names_of_its_module(module: ModuleType):
    stub = stub_of(module)
    assert {name for name in vars(module) if not name.startswith("_")} <= names(stub.body)
    for node in stub.body:
        if isinstance(node, ast.ClassDef) and hasattr(module, node.name):
            own = {name for name in vars(getattr(module, node.name)) if not name.startswith("_")}
            assert own <= names(node.body), node.name


@pytest.mark.parametrize("module", MODULES, ids=lambda module: module.__name__)
def test_a_stub_types_all_that_it_names(module: ModuleType):
    tree = stub_of(module)
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef):
            assert node.returns is not None, node.name
            every = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
            every += [each for each in (node.args.vararg, node.args.kwarg) if each]
            assert [each.arg for each in every if not each.annotation] in ([], ["self"]), node.name
    assert "Incomplete" not in ast.unparse(tree)


def test_a_stub_has_the_docstrings_of_its_module():
    for name, text in described(stub_of(KERNEL).body).items():
        owner, _, member = name.rpartition(".")
        if hasattr(KERNEL, owner or member):
            compiled = getattr(getattr(KERNEL, owner) if owner else KERNEL, member).__doc__ or ""
            assert text in inspect.cleandoc(compiled), name


def test_the_keywords_of_a_component_are_the_settings_of_the_kernel():
    classes = {node.name: node for node in stub_of(KERNEL).body if isinstance(node, ast.ClassDef)}
    assert names(classes["TaskSettings"].body) == {*KERNEL.TASK_SETTINGS, "states", "max_slew"}
    assert names(classes["StateTimes"].body) == {*KERNEL.STATE_TIMES}
