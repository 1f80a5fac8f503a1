"""The JSON Schemas of files, and a package's own copy of them for editors.

A file names its schema by a path relative to it, so that the name is true for every user of the package.
Git ignores the copy: it is always that of the MAUVE RT with which the package was built last.
"""

import json
from pathlib import Path
from typing import Any

from mauve_rt.file_schema.file_kind import FileKind
from mauve_rt.model.schema import FileModel
from mauve_rt.model.steps import steps_schema
from mauve_rt.modelling.schema import ModelFile
from mauve_rt.supervision.rules import Rules

FOLDER = Path(".mauve")


def file_schema(kind: FileKind) -> dict[str, Any]:
    """The JSON Schema of a kind of file."""
    match kind:
        case FileKind.ARCHITECTURE:
            return FileModel.json_document(kind.value)
        case FileKind.RULES:
            return Rules.json_document(kind.value)
        case FileKind.STEPS:
            return steps_schema()
        case FileKind.MODEL:
            return ModelFile.json_document(kind.value)


def schema_text(kind: FileKind) -> str:
    """The JSON Schema of a kind of file, as text."""
    return json.dumps(file_schema(kind), indent=2, ensure_ascii=False) + "\n"


def write_schemas(package: Path) -> None:
    """Bring the package's copy up to date.

    Raises:
        OSError: it cannot be written.
    """
    files = {Path("schema") / f"{kind.value}.schema.json": schema_text(kind) for kind in FileKind}
    for path, text in {Path(".gitignore"): "*\n", **files}.items():
        file = package / FOLDER / path
        if not file.is_file() or file.read_text(encoding="utf-8") != text:
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text, encoding="utf-8")
