"""A component or a resource more for an architecture that runs, described as in the architecture file."""

from mauve_rt.errors import ArchitectureFileError
from mauve_rt.file_schema.schema_errors import read_content
from mauve_rt.file_schema.yaml_file import Location, YamlFile
from mauve_rt.model.architecture_file import ArchitectureModel, Overrides, element_problems
from mauve_rt.model.schema import FragmentModel


class _Section(YamlFile):
    """YAML text as if it stood at `place` of a file. It has no lines there."""

    def __init__(self, model: ArchitectureModel, text: str, place: tuple[str, str]) -> None:
        super().__init__(model.path, text=text)
        section, name = place
        self.data = {"mauve": 1, section: {name: self.data}}

    def position(self, _location: Location, *, key: bool = False) -> tuple[int, int]:  # noqa: ARG002
        return (1, 1)


def fragment(model: ArchitectureModel, text: str, *, section: str, name: str) -> ArchitectureModel:
    """What `text` says below `components: NAME:` or `resources: NAME:`, as a model of that alone.

    Places and relative paths stand for what they stand for in the file of `model`.

    Raises:
        ArchitectureFileError: no YAML, or it breaks the schema; the problems' text() tells all.
    """
    file = _Section(model, text, (section, name))
    content = read_content(FragmentModel, file)
    surroundings = Overrides(namespace=model.namespace, peers=model.peers)
    found = ArchitectureModel(file, content, surroundings)
    if problems := [*element_problems(found)]:
        raise ArchitectureFileError(file.path, problems)
    return found
