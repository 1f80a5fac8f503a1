"""Reads models, and finds those of other packages: among given files, else where packages are installed."""

from collections.abc import Iterable, Iterator
from pathlib import Path

from mauve_rt.errors import ArchitectureFileError, Problem
from mauve_rt.file_schema.schema_errors import read_content
from mauve_rt.file_schema.words import did_you_mean
from mauve_rt.file_schema.yaml_file import YamlFile
from mauve_rt.modelling.checks import problems
from mauve_rt.modelling.package_model import PackageModel
from mauve_rt.modelling.schema import ModelFile
from mauve_rt.modelling.scope import Reference, Scope, references
from mauve_rt.parts import ament_index

MODEL = "model.yaml"
"""Its name in the sources of a package, and in its share folder."""


def load_model(path: str | Path, *, text: str | None = None) -> PackageModel:
    """The model of a file; a folder stands for `model.yaml` in it. Models that it uses are installed ones.

    Raises:
        ArchitectureFileError: the file cannot be read, breaks the schema, or its names do not fit each other;
        with every problem, its line and its column.
    """
    return ModelLoader().load(path, text=text)


class ModelLoader:
    """Reads models that may use each other's parts; each file once."""

    def __init__(self, files: Iterable[Path] = (), *, prefixes: Iterable[Path] = ()) -> None:
        """Models are searched for in `files`, then in the packages of `prefixes` and of the ament index."""
        self._given = dict(_packages(files))
        self._prefixes = [*dict.fromkeys([*prefixes, *ament_index.prefixes()])]
        self._loaded: dict[Path, PackageModel] = {}
        self._reading: list[str] = []  # packages whose models are being read: each uses the next one

    def load(self, path: str | Path, *, text: str | None = None) -> PackageModel:
        """As load_model()."""
        path = _file(Path(path)) if text is None else Path(path)
        if text is None and path in self._loaded:
            return self._loaded[path]
        file = YamlFile(path, text=text)
        content = read_content(ModelFile, file, what="a model")
        self._reading.append(content.package)
        try:
            used = self._used(file, content)
        finally:
            self._reading.pop()
        scope = Scope.of(content, [one.scope for one in used.values()])
        found = [*_unknown(file, content, scope), *problems(file, content, scope)]
        if found:
            raise ArchitectureFileError(file.path, found)
        model = PackageModel(file, content, scope, used)
        if text is None:
            self._loaded[path] = model
        return model

    def _used(self, file: YamlFile, content: ModelFile) -> dict[str, PackageModel]:
        used: dict[str, PackageModel] = {}
        found: list[Problem] = []
        first = {one.package: one for one in reversed([*references(content)])}
        for package, reference in first.items():
            path = self._path(package)
            if package in self._reading:
                found.append(self._cycle(file, reference))
            elif path is None:
                found.append(self._missing(file, reference))
            else:
                used[package] = self.load(path)
        if found:
            raise ArchitectureFileError(file.path, found)
        return used

    def _path(self, package: str) -> Path | None:
        installed = (prefix / "share" / package / MODEL for prefix in self._prefixes)
        return self._given.get(package) or next((path for path in installed if path.is_file()), None)

    def _cycle(self, file: YamlFile, reference: Reference) -> Problem:
        packages = self._reading[self._reading.index(reference.package) :]
        if len(packages) == 1:
            what = f"package '{reference.package}' is the one of this model"
            return file.problem(reference.place, what, remedy=f"write {reference.name.partition('/')[2]}")
        circle = " -> ".join([*packages, reference.package])
        remedy = "move the parts that both packages use to a third package"
        return file.problem(reference.place, f"models use each other: {circle}", remedy=remedy)

    def _missing(self, file: YamlFile, reference: Reference) -> Problem:
        package = reference.package
        if any((prefix / "share" / package).is_dir() for prefix in self._prefixes):
            what = f"package '{package}' has no model"
            expected = f"share/{package}/{MODEL} where it is installed"
            if reference.kind == "type":
                remedy = f"of a message write {package}/msg/{reference.name.partition('/')[2]}"
            else:
                remedy = "name its model file as well, or write the parts by hand"
            return file.problem(reference.place, what, expected=expected, remedy=remedy)
        installed = [
            path.parent.name for prefix in self._prefixes for path in prefix.glob(f"share/*/{MODEL}")
        ]
        others = {*self._given, *installed} - {*self._reading}
        remedy = f"{did_you_mean(package, others)}; install it, or name its model file as well"
        what = f"package '{package}' is not found"
        return file.problem(reference.place, what, remedy=remedy, code="unknown_package")


def _unknown(file: YamlFile, content: ModelFile, scope: Scope) -> Iterator[Problem]:
    """Names that the models of other packages lack."""
    for reference in references(content):
        known = getattr(scope, f"{reference.kind}s")
        if reference.name not in known:
            package, _, name = reference.name.partition("/")
            its_own = [each.partition("/")[2] for each in known if each.partition("/")[0] == package]
            what = f"package '{package}' has no {reference.kind} '{name}' in its model"
            yield file.problem(reference.place, what, remedy=did_you_mean(name, its_own))


def _file(path: Path) -> Path:
    return path / MODEL if path.is_dir() else path


def _packages(files: Iterable[Path]) -> Iterator[tuple[str, Path]]:
    """The packages of models; a file that is none is refused where it is read."""
    for path in map(_file, files):
        try:
            data = YamlFile(path).data
        except ArchitectureFileError:
            continue
        if isinstance(data, dict) and isinstance(data.get("package"), str):
            yield data["package"], path
