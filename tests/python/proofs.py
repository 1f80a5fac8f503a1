"""The tests, constants and rows of benchmarks that prove a claim or run a block, with their sources.

A test of Python is `test_name`, or `folder/test_file.py::test_name` where several files have this name. A
case of GoogleTest is `Suite.Name`, a program that ctest runs `ctest: NAME`, a row of scripts/bench
`bench: WORDS`. A constant is `file::NAME`, with as many folders as make it the only one.
"""

import ast
import re
from collections import defaultdict
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
TESTS = (ROOT / "tests", ROOT / "mauve_examples" / "tests")
GTEST = re.compile(r"^(?:TYPED_)?TEST(?:_[FP])?\((\w+),\s*(\w+)\)", re.MULTILINE)


@cache
def _definitions(file: Path) -> dict[str, ast.stmt]:
    """The functions, classes and values of a module, by name."""
    found: dict[str, ast.stmt] = {}
    for node in ast.parse(file.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            found[node.name] = node
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            names = (each for target in targets for each in ast.walk(target))
            found |= {each.id: node for each in names if isinstance(each, ast.Name)}
    return found


@cache
def _python_tests() -> dict[str, list[Path]]:
    found = defaultdict(list)
    for file in sorted(file for folder in TESTS for file in folder.rglob("test_*.py")):
        for name in _definitions(file):
            if name.startswith("test_"):
                found[name].append(file)
    return found


@cache
def _cpp_cases() -> dict[str, list[Path]]:
    found = defaultdict(list)
    for file in sorted(file for folder in TESTS for file in folder.rglob("test_*.cpp")):
        for suite, name in GTEST.findall(file.read_text(encoding="utf-8")):
            found[f"{suite}.{name}"].append(file)
    return found


@cache
def _bench_words() -> frozenset[str]:
    """Every text in benchmarks/, of an f-string the pieces between its values."""
    files = (ROOT / "benchmarks").glob("*.py")
    nodes = (node for file in files for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))))
    return frozenset(
        node.value for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, str)
    )


@cache
def _programs_of_ctest() -> str:
    return "".join(file.read_text("utf-8") for file in (ROOT / "mauve_examples").glob("*/CMakeLists.txt"))


@cache
def _product_files(name: str) -> list[Path]:
    folders = ("mauve_rt", "mauve_examples", "benchmarks")
    return sorted(file for folder in folders for file in (ROOT / folder).rglob(name))


def _python_source(file: Path, test: str) -> str:
    """A test and everything of its module that it uses, directly or not."""
    definitions, lines = _definitions(file), file.read_text(encoding="utf-8").splitlines()
    wanted, pieces, seen = [test], [], set()
    while wanted:
        node = definitions[wanted.pop()]
        if node in seen:
            continue
        seen.add(node)
        first = min(each.lineno for each in (node, *getattr(node, "decorator_list", ())))
        pieces += lines[first - 1 : node.end_lineno]
        used = {each.id for each in ast.walk(node) if isinstance(each, ast.Name)}
        used |= {each.arg for each in ast.walk(node) if isinstance(each, ast.arg)}  # fixtures
        wanted += used & definitions.keys()
    return "\n".join(pieces)


def _balanced(text: str, begin: int) -> str:
    """The text from there to the end of the line at which all brackets are closed."""
    depth, lines = 0, []
    for line in text[begin:].split("\n"):
        lines.append(line)
        depth += sum(map(line.count, "([{")) - sum(map(line.count, ")]}"))
        if depth <= 0:
            break
    return "\n".join(lines)


def _cpp_source(file: Path, proof: str) -> str:
    """A case and the constants of its file that it uses."""
    text = file.read_text(encoding="utf-8")
    begin = next(found.start() for found in GTEST.finditer(text) if ".".join(found.groups()) == proof)
    body = text[begin : text.index("\n}", begin)]
    constants = re.findall(
        r"^(?:inline )?(?:static )?const(?:expr)? .*?(\w+)(?: =|\{).*$", text, re.MULTILINE
    )
    used = [name for name in constants if re.search(rf"\b{name}\b", body)]
    return "\n".join([body, *(_constant_source(text, name) for name in used)])


def _constant_source(text: str, name: str) -> str:
    """The definition of a constant: `NAME = ...`, `NAME{...}` or `"name": ...`; empty where there is none."""
    found = re.search(
        rf"^.*\b{re.escape(name)}\b[\"']?(?:, \w+)*\s*(?:: *\w+ *)?[=({{:].*$", text, re.MULTILINE
    )
    return _balanced(text, found.start()) if found else ""


def sources(proof: str) -> list[str]:
    """The source of each test, constant or row with this name: one where the name is right."""
    if proof.startswith("bench: "):
        return [proof] * (proof.removeprefix("bench: ") in _bench_words())
    if proof.startswith("ctest: "):
        name, text = proof.removeprefix("ctest: "), _programs_of_ctest()
        is_added = f"add_test(NAME {name} " in text or ("add_test(NAME ${name} " in text and name in text)
        files = sorted((ROOT / "mauve_examples").rglob(f"{name}.cpp"))
        return ["\n".join(file.read_text(encoding="utf-8") for file in files)] * is_added
    path, is_in_file, name = proof.rpartition("::")
    if is_in_file and not name.startswith("test_"):
        files = [file for file in _product_files(path.rpartition("/")[2]) if f"/{file}".endswith(f"/{path}")]
        texts = [_constant_source(file.read_text(encoding="utf-8"), name) for file in files]
        return [text for text in texts if text]
    if "." in name:
        return [_cpp_source(file, proof) for file in _cpp_cases().get(proof, ())]
    files = [file for file in _python_tests().get(name, ()) if not path or f"/{file}".endswith(f"/{path}")]
    return [_python_source(file, name) for file in files]


def is_there(proof: str) -> bool:
    """Whether the sources have one of this name."""
    return len(sources(proof)) == 1
