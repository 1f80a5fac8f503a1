"""Write the stub of a compiled module: its types, from pybind11's signatures, and its docstrings.

    python write_stub.py FILE MODULE STUB        FILE (.so) is loaded as MODULE, such as mauve_rt._kernel

pybind11-stubgen reads the module. It ends with an error for a type of C++ in a signature: register the class
before the function that uses it. We print it: with short names, and members in the order of the sources.
"""

import inspect
import logging
import sys
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any

import pybind11_stubgen as stubgen
from pybind11_stubgen.printer import Printer
from pybind11_stubgen.structs import (
    Attribute,
    Class,
    Decorator,
    Docstring,
    Field,
    Function,
    Identifier,
    Module,
    QualifiedName,
    ResolvedType,
)

SOURCES = Path(__file__).resolve().parents[1]
UNIONS = ("typing.Optional", "typing.Union")


def main(file: str, name: str, stub: str) -> None:
    """Write the stub, or end with a line for each error."""
    logging.basicConfig(format=f"{name}: %(message)s")
    module = load(Path(file), name)
    parser = stub_parser()
    parsed = parser.handle_module(QualifiedName.from_str(name), module)
    parser.finalize()
    lines = StubPrinter().print_module(parsed)
    if hasattr(module, "TASK_SETTINGS"):
        lines += settings_types(module)
    text = "\n".join(line.rstrip() for line in lines)
    compile(text, stub, "exec")
    Path(stub).write_text(f"{text}\n", encoding="utf-8")


def load(file: Path, name: str) -> ModuleType:
    """The module of this build, though the sources may have one of an earlier build."""
    sys.path.insert(0, str(SOURCES))
    spec = spec_from_file_location(name, file)
    if spec is None or spec.loader is None:
        raise ImportError(f"{file}: expected a compiled module")
    module = module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    package, _, last = name.rpartition(".")
    setattr(import_module(package), last, module)
    return module


def named(name: str, *parameters: ResolvedType) -> ResolvedType:
    """A type by its full name."""
    return ResolvedType(QualifiedName.from_str(name), [*parameters] or None)


# What functions take by keyword, by their names: pybind11 says `**kwargs`.
KEYWORDS = {
    "add_component": ("settings", named("typing.Unpack", named("TaskSettings"))),
    "add_resource": ("parameters", named("bool | int | float | str")),
}


def stub_parser() -> Any:
    """The parser of pybind11-stubgen, corrected."""
    arguments = stubgen.arg_parser().parse_args(["--exit-code", "none"], namespace=stubgen.CLIArgs())
    base = type(stubgen.stub_parser_from_args(arguments))
    return type("StubParser", (Corrected, base), {})()


class Corrected:
    """Corrects each part that the parser has read."""

    def handle_attribute(self, path: QualifiedName, value: object) -> Attribute | None:
        """The type of a container has the types of its content."""
        made = super().handle_attribute(path, value)
        if made is not None and isinstance(value, dict | set) and value:
            made.value = None
            made.annotation.parameters = [named(each) for each in content_types(value)]
        return made

    def handle_class(self, path: QualifiedName, class_: type) -> Class | None:
        """With the attributes that the class itself declares."""
        made = super().handle_class(path, class_)
        if made is not None:
            for name, kind in inspect.get_annotations(class_).items():
                made.fields.append(Field(Attribute(Identifier(name), None, named(kind)), None))
        return made

    def handle_function(self, path: QualifiedName, function: object) -> list[Function]:
        """A vector takes any sequence. One of strings takes a list: a string would be a sequence, too.

        What is None by default may be None: of a pointer pybind11 does not say so.
        """
        made = super().handle_function(path, function)
        for argument in (each for function in made for each in function.args):
            kind = argument.annotation
            if argument.variadic or argument.kw_variadic:
                any_ = (argument.name, named("typing.Any"))
                argument.name, argument.annotation = KEYWORDS.get(path[-1], any_)
            elif str(kind).startswith("list[") and str(kind) != "list[str]":
                kind.name = QualifiedName.from_str("collections.abc.Sequence")
            is_none = getattr(argument.default, "repr", "") == "None"
            if is_none and "None" not in str(kind) and "Optional" not in str(kind):
                argument.annotation = named("typing.Optional", kind)
        return made


def content_types(value: dict[Any, Any] | set[Any]) -> list[str]:
    """Of a dictionary's keys and values, or of a set."""
    columns = zip(*value.items(), strict=True) if isinstance(value, dict) else [value]
    return [type(next(iter(each))).__name__ for each in columns]


class StubPrinter(Printer):
    """Prints a module with short names, and imports what they need."""

    def __init__(self) -> None:
        super().__init__(invalid_expr_as_ellipses=False)
        self.imports: set[tuple[str, str]] = set()

    def short(self, name: str) -> str:
        """The last part of a full name, which is imported."""
        module, _, last = name.rpartition(".")
        if module:
            self.imports.add((module, last))
        return last

    def print_type(self, type_: ResolvedType) -> str:
        """An array of numpy is one of numpy.typing."""
        name = str(type_.name)
        if name in UNIONS:
            return super().print_type(type_)
        parameters = type_.parameters
        if name == "numpy.ndarray":
            name = "numpy.typing.NDArray"
            parameters = [named(str(each).replace("bool", "numpy.bool_")) for each in parameters]
        return super().print_type(ResolvedType(QualifiedName.from_str(self.short(name)), parameters))

    def print_docstring(self, doc: Docstring) -> list[str]:
        """As the sources of Python have it."""
        lines = inspect.cleandoc(doc).replace("\\", r"\\").replace('"""', r"\"\"\"").splitlines()
        lines[0] = f'"""{lines[0]}'
        return [*lines[:-1], f'{lines[-1]}"""'] if len(lines) == 1 else [*lines, '"""']

    def print_function(self, func: Function) -> list[str]:
        """With the short names of its decorators; without a docstring in one line."""
        func.decorators = [Decorator(self.short(each)) for each in func.decorators]
        *lines, last = super().print_function(func)
        return [*lines[:-1], f"{lines[-1]} ..."] if last.strip() == "..." else [*lines, last]

    def print_class_body(self, class_: Class) -> list[str]:
        """Members in the order in which they were registered."""
        lines = self.print_docstring(class_.doc) if class_.doc else []
        for field in class_.fields:
            lines += self.print_field(field)
            if field.attribute.name == "__hash__":  # object has a function
                lines[-1] += "  # type: ignore[assignment]"
        for each in class_.properties:
            lines += self.print_property(each)
        for method in class_.methods:
            lines += self.print_method(method)
        return lines or ["..."]

    def print_module(self, module: Module) -> list[str]:
        """Imports are known last."""
        lines = []
        for attribute in module.attributes:
            if attribute.name != "__all__":
                attribute.annotation = named("typing.Final", attribute.annotation)
                lines += self.print_attribute(attribute)
        for class_ in self._order_classes(module.classes):
            lines += ["", *self.print_class(class_)]
        lines.append("")
        for function in module.functions:
            lines += self.print_function(function)
        homes: dict[str, list[str]] = {}
        for home, name in sorted(self.imports):
            homes.setdefault(home, []).append(name)
        imports = [f"from {home} import {', '.join(names)}" for home, names in homes.items()]
        return [*self.print_docstring(module.doc), "", *imports, "", *lines]


def settings_types(module: ModuleType) -> list[str]:
    """Classes of what add_component() takes by keyword: no function of C++ has them in its signature."""
    kinds = {int: "int", str: "str", list: "list[int]", bool: "bool"}
    settings = []
    for name, each in module.TASK_SETTINGS.items():
        says = " or ".join(each.choices) or each.hint
        settings.append(f"    {name}: {kinds[type(each.default)]}  # {says}")
    times = [f"    {name}: int | None  # {meaning}" for name, meaning in module.STATE_TIMES.items()]
    return [
        "",
        "from typing import TypedDict, type_check_only",
        "",
        "@type_check_only",
        "class TaskSettings(TypedDict, total=False):",
        '    """How a component is run. What is left out has its default: see TASK_SETTINGS."""',
        *settings,
        "    states: dict[str, StateTimes]  # of the fsm's execution states, by name",
        "    max_slew: dict[str, float]  # by 'command.torque': greatest change per second of the number",
        "",
        "@type_check_only",
        "class StateTimes(TypedDict, total=False):",
        '    """Times of an execution state, in the place of the fsm\'s own."""',
        *times,
    ]


if __name__ == "__main__":
    main(*sys.argv[1:])
