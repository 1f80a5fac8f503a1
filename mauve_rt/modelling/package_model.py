"""The model of a package, read from its file and checked, with the models whose parts it uses."""

from collections.abc import Mapping

from mauve_rt.errors import ArchitectureFileError, Problem
from mauve_rt.file_schema.yaml_file import Location, YamlFile
from mauve_rt.modelling.checks import warnings
from mauve_rt.modelling.schema import CoreModel, CppType, FsmModel, ModelFile
from mauve_rt.modelling.scope import Scope


class PackageModel:
    """A model whose names fit each other. What it holds is that of `ModelFile`.

    Attributes:
        scope: its own parts by name, those of other models by `package/Name`.
        used: the models whose parts it uses, by package.

    """

    def __init__(
        self, file: YamlFile, content: ModelFile, scope: Scope, used: Mapping[str, "PackageModel"]
    ) -> None:
        self.path = file.path
        self.content = content
        self.scope = scope
        self.used = used
        self.warnings: list[Problem] = [*warnings(file, content)]
        self._file = file

    def error(self, place: Location, what: str, **facts: str) -> ArchitectureFileError:
        """An error at a place of the file; `facts` as the fields of `Problem`."""
        return ArchitectureFileError(self.path, [self._file.problem(place, what, **facts)])

    @property
    def package(self) -> str:
        """The package whose parts these are."""
        return self.content.package

    def registered(self, part: str) -> str:
        """The name by which a part of the model, or of a model that it uses, is registered."""
        return self.scope.registered(part)

    def registered_type(self, item: str) -> str:
        """The name by which a type of the model, or another one, is registered."""
        own = self.scope.types.get(item)
        if own is None:
            return item
        if isinstance(own, CppType):
            return own.name
        package, _, name = self.registered(item).partition("/")
        return f"{package}/msg/{name}"

    def core_of(self, fsm: FsmModel) -> CoreModel:
        """The core whose methods a machine calls; `shell` of another model's core is `package/Name`."""
        return self.scope.cores[fsm.core]

    def closure(self) -> list["PackageModel"]:
        """The models that it uses, also through others: each once, behind those that it uses itself."""
        found: dict[str, PackageModel] = {}
        for one in self.used.values():
            found |= {each.package: each for each in (*one.closure(), one)}
        return [*found.values()]
