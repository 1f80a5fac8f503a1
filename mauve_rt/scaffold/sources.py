"""The parts in the sources of a package: what a new core or a new rule can be for.

The sources are read as text, because they need not be built yet. The patterns are those of the templates.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from mauve_rt.errors import ArchitectureFileError, ParameterError
from mauve_rt.file_schema.file_kind import FileKind
from mauve_rt.file_schema.words import did_you_mean
from mauve_rt.file_schema.yaml_file import YamlFile
from mauve_rt.model.file_kinds import file_kind
from mauve_rt.modelling.checks import abstract_class
from mauve_rt.modelling.loading import MODEL, load_model
from mauve_rt.modelling.package_model import PackageModel

_CPP_SHELL = re.compile(
    r"\b(?:struct|class)\s+(\w+)\s*(?:final\s*)?:\s*(?:public\s+)?[\w:]*Shell\b[^{]*\{(.*?)^\};",
    re.MULTILINE | re.DOTALL,
)
_CPP_CORE = re.compile(
    r"\b(?:struct|class)\s+(\w+)\s*(final\s*)?:\s*(?:public\s+)?(?:mauve::)?UpdateCore<(\w+)>"
)
_CPP_PORT = re.compile(r"\b(read|write)_port<([\w:]+)>\(\"(\w+)\"")
_PYTHON_CORE = re.compile(r"^class\s+(\w+)\(Core\[(\w+)\]\)", re.MULTILINE)


@dataclass(frozen=True)
class Port:
    """A port of a shell in C++: kind is read or write."""

    name: str
    kind: str
    type: str


@dataclass(frozen=True)
class Base:
    """A core that another one can replace."""

    core: str
    shell: str
    file: str
    """Stem of the file that has the core."""
    ports: tuple[Port, ...]
    is_python: bool
    parent: str
    """The class that a core derives from to take its place; by it the new core has the old one's state."""

    @property
    def fsm(self) -> str:
        """As `register_element` and the templates name it."""
        return f"{self.shell.removesuffix('Shell')}Fsm"


@dataclass(frozen=True)
class Replaceable:
    """A component of an architecture file, and a core that it declares as its alternative."""

    component: str
    core: str
    is_python: bool


def architectures(package: Path) -> list[Path]:
    """The architecture files of a package, those with components."""
    return [path for path in sorted(package.glob("architecture/*.yaml")) if _is_architecture(path)]


def replaceable(architecture: Path) -> Iterator[Replaceable]:
    """The components of a package's file that have alternatives, with the first one of each.

    Raises:
        ArchitectureFileError: the file cannot be read.
    """
    lists = sorted(architecture.absolute().parents[1].glob("plugins/*.txt"))
    in_python = "".join(path.read_text(encoding="utf-8") for path in lists)
    components = YamlFile(architecture).data["components"]
    for name, component in components.items() if isinstance(components, dict) else ():
        others = component.get("alternatives") if isinstance(component, dict) else None
        if isinstance(others, list) and others:
            yield Replaceable(str(name), str(others[0]), is_python=f"; {others[0]};" in in_python)


def target_of(package: Path) -> Replaceable:
    """The component that new rules are for: the first one with an alternative.

    Raises:
        ParameterError: no component has one.
        ArchitectureFileError: a file cannot be read.
    """
    for architecture in architectures(package):
        for each in replaceable(architecture):
            return each
    raise ParameterError(
        f"rules: expected a component with alternatives in {package / 'architecture'}, found none. "
        "Add `alternatives: [PACKAGE/CORE]` to a component."
    )


def base_of(package: Path, name: str, wanted: str, *, in_python: bool) -> Base:
    """The core that a new one replaces: the one of the shell or core `wanted`; without it, of the only shell.

    Raises:
        ParameterError: there is none, or there are several.
    """
    found = [*_cpp_cores(package), *(_python_cores(package, name) if in_python else ())]
    names = [f"{each.shell} (core {each.core})" for each in found]
    if wanted:
        found = [each for each in found if wanted.rpartition("/")[2] in (each.shell, each.core, each.file)]
        if not found:
            raise ParameterError(
                f"--for {wanted}: expected a shell or core of {name}{_languages(in_python)}, "
                f"found {_list(names)}. Choose one of these."
            )
    if len({each.shell for each in found}) != 1:
        raise ParameterError(
            f"core: expected one shell in {name}{_languages(in_python)}, found {_list(names)}. "
            + ("Choose one with --for SHELL." if found else "Add one with mauve new component.")
        )
    base: Base = found[0]
    if in_python and not base.is_python:
        base = replace(base, parent="Core")  # a class in Python cannot derive from one in C++
    return base


def modelled_core(package: Path, wanted: str) -> tuple[PackageModel, str] | None:
    """The model of a package, and its core that `wanted` names: as a core, a class, a shell or an algorithm.

    None: the package has no model, or cores that are written by hand are meant.

    Raises:
        ParameterError: the model has no such core, or several.
        ArchitectureFileError: the model is wrong.
    """
    if not (package / MODEL).is_file():
        return None
    model = load_model(package)
    names = {
        name: {name, abstract_class(name), core.shell.rpartition("/")[2], *core.implementations}
        for name, core in model.content.cores.items()
    }
    last = wanted.rpartition("/")[2]
    found = [name for name, known in names.items() if not wanted or last in known]
    if len(found) == 1:
        return model, found[0]
    by_hand = [*_cpp_cores(package), *_python_cores(package, model.package)]
    if not found and by_hand:
        return None
    if wanted and not found:
        remedy = did_you_mean(last, [each for known in names.values() for each in known])
        raise ParameterError(f"--for {wanted}: {model.path} has no such core, shell or algorithm; {remedy}")
    raise ParameterError(
        f"core: expected one core in {model.path}, found {_list(found)}. Choose one with --for CORE."
    )


def cpp_base(core: str, shell: str, file: str, ports: tuple[Port, ...], *, is_final: bool = False) -> Base:
    """A core in C++."""
    parent = f"mauve::UpdateCore<{shell}>" if is_final else core
    return Base(core, shell, file, ports, is_python=False, parent=parent)


def python_base(core: str, shell: str, file: str) -> Base:
    """A core in Python."""
    return Base(core, shell, file, (), is_python=True, parent=core)


def _languages(in_python: bool) -> str:  # noqa: FBT001 - one place
    return "" if in_python else " in C++"


def _list(names: list[str]) -> str:
    return ", ".join(names) if names else "none"


def _is_architecture(path: Path) -> bool:
    try:
        return file_kind(path) is FileKind.ARCHITECTURE and "components" in YamlFile(path).data
    except (ArchitectureFileError, TypeError):
        return False


def _cpp_cores(package: Path) -> Iterator[Base]:
    texts = {
        path: _without_comments(path.read_text(encoding="utf-8"))
        for path in sorted(package.glob("src/*.hpp"))
    }
    shells = {name: (path, body) for path, text in texts.items() for name, body in _CPP_SHELL.findall(text)}
    cores = [
        cpp_base(core, shell, path.stem, _ports(shells[shell][1]), is_final=bool(final))
        for path, text in texts.items()
        for core, final, shell in _CPP_CORE.findall(text)
        if shell in shells
    ]
    # The one beside the shell is the one that the component begins with.
    yield from sorted(cores, key=lambda core: core.file != shells[core.shell][0].stem)


def _ports(body: str) -> tuple[Port, ...]:
    return tuple(Port(name, kind, of_type) for kind, of_type, name in _CPP_PORT.findall(body))


def _without_comments(text: str) -> str:
    return re.sub(r"//[^\n]*|/\*.*?\*/", "", text, flags=re.DOTALL)


def _python_cores(package: Path, name: str) -> Iterator[Base]:
    texts = {path: path.read_text(encoding="utf-8") for path in sorted(package.glob(f"{name}_parts/*.py"))}
    cores = [
        (path, text, core, shell)
        for path, text in texts.items()
        for core, shell in _PYTHON_CORE.findall(text)
    ]
    for path, _, core, shell in sorted(cores, key=lambda each: f"class {each[3]}(" not in each[1]):
        yield python_base(core, shell, path.stem)
