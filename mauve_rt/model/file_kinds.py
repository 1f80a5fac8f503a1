"""Which kind of file of ours a YAML file is: its contents say so, not its name."""

from pathlib import Path

from mauve_rt.file_schema.file_kind import FileKind
from mauve_rt.file_schema.yaml_file import YamlFile


def file_kind(path: str | Path) -> FileKind:
    """The kind of a file.

    Steps are a list or have the key `steps`, rules have `rules`, the model of a package has `mauve_model`;
    all else is to be an architecture.

    Raises:
        ArchitectureFileError: it cannot be read or is no YAML.
    """
    data = YamlFile(path).data
    if isinstance(data, list):
        return FileKind.STEPS
    if isinstance(data, dict) and "mauve_model" in data:
        return FileKind.MODEL
    if isinstance(data, dict) and "components" not in data:
        if "rules" in data:
            return FileKind.RULES
        if "steps" in data:
            return FileKind.STEPS
    return FileKind.ARCHITECTURE
