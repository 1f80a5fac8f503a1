"""The model of a package, read from its file and checked."""

from pathlib import Path

from mauve_rt.errors import ArchitectureFileError, Problem
from mauve_rt.file_schema.schema_errors import read_content
from mauve_rt.file_schema.yaml_file import Location, YamlFile
from mauve_rt.modelling.checks import problems, warnings
from mauve_rt.modelling.schema import CoreModel, CppType, FsmModel, ModelFile


class PackageModel:
    """A model whose names fit each other. What it holds is that of `ModelFile`."""

    def __init__(self, file: YamlFile, content: ModelFile) -> None:
        self.path = file.path
        self.content = content
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
        """The name by which a part of the model is registered."""
        return f"{self.package}/{part}"

    def registered_type(self, item: str) -> str:
        """The name by which a type of the model, or another one, is registered."""
        own = self.content.types.get(item)
        if own is None:
            return item
        return own.name if isinstance(own, CppType) else f"{self.package}/msg/{item}"

    def core_of(self, fsm: FsmModel) -> CoreModel:
        """The core whose methods a machine calls."""
        return self.content.cores[fsm.core]


def load_model(path: str | Path, *, text: str | None = None) -> PackageModel:
    """The model of a file; a folder stands for `model.yaml` in it.

    Raises:
        ArchitectureFileError: the file cannot be read, breaks the schema, or its names do not fit each other;
        with every problem, its line and its column.
    """
    path = Path(path)
    file = YamlFile(path / "model.yaml" if text is None and path.is_dir() else path, text=text)
    content = read_content(ModelFile, file, what="a model")
    if found := [*problems(file, content)]:
        raise ArchitectureFileError(file.path, found)
    return PackageModel(file, content)
