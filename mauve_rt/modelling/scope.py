"""The names that a model may use: its own, and those of other models as `package/Name`."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Self

from mauve_rt.file_schema.yaml_file import Location
from mauve_rt.modelling.schema import CoreModel, CppType, ModelFile, ShellModel, TypeModel
from mauve_rt.modelling.type_names import TypeName


@dataclass(frozen=True)
class Scope:
    """Types, shells and cores by the names that a model has for them."""

    package: str
    types: Mapping[str, TypeModel]
    shells: Mapping[str, ShellModel]
    cores: Mapping[str, CoreModel]

    @classmethod
    def of(cls, content: ModelFile, used: Iterable["Scope"]) -> Self:
        """Own names, then those of the models that it uses, and of the models that these use."""
        types, shells, cores = dict(content.types), dict(content.shells), dict(content.cores)
        for other in used:
            types |= {other.registered(name): one for name, one in other.types.items()}
            shells |= {other.registered(name): one for name, one in other.shells.items()}
            cores |= {
                other.registered(name): one.changed(shell=other.registered(one.shell))
                for name, one in other.cores.items()
            }
        return cls(content.package, types, shells, cores)

    def registered(self, part: str) -> str:
        """`package/Name`, also of an own part."""
        return part if "/" in part else f"{self.package}/{part}"


@dataclass(frozen=True)
class Reference:
    """A part of another package's model, as a model names it."""

    place: Location
    kind: str
    """type, shell or core: the name of a section without its last letter."""
    name: str

    @property
    def package(self) -> str:
        """The package that has the part."""
        return self.name.partition("/")[0]


def references(content: ModelFile) -> Iterator[Reference]:
    """Every `package/Name` of a model."""
    for place, of in _types(content):
        if of.is_of_model:
            yield Reference(place, "type", of.item)
    for name, core in content.cores.items():
        if "/" in core.shell:
            yield Reference(("cores", name, "shell"), "shell", core.shell)
    for name, fsm in content.fsms.items():
        if "/" in fsm.core:
            yield Reference(("fsms", name, "core"), "core", fsm.core)


def _types(content: ModelFile) -> Iterator[tuple[Location, TypeName]]:
    for name, own in content.types.items():
        for field, of in () if isinstance(own, CppType) else own.items():
            yield ("types", name, field), of
    for name, shell in content.shells.items():
        for port, one in shell.ports.items():
            for key, of_port in (("read", one.read_type), ("write", one.write)):
                if of_port is not None:
                    yield ("shells", name, "ports", port, key), of_port
    for name, core in content.cores.items():
        for field, of in core.state.items():
            yield ("cores", name, "state", field), of
