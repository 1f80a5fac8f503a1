"""`mauve schema KIND`: the JSON Schema of a kind of file, for editors. The tables that check files make it."""

import argparse
import json
from typing import Any

from mauve_rt.cli.verb import OK
from mauve_rt.model.file_kinds import FileKind


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The kind of file."""
    parser.add_argument("kind", choices=[kind.value for kind in FileKind], help="kind of the file")


def main(args: argparse.Namespace) -> int:
    """Print the schema."""
    print(json.dumps(file_schema(FileKind(args.kind)), indent=2, ensure_ascii=False))
    return OK


def file_schema(kind: FileKind) -> dict[str, Any]:
    """The JSON Schema of a kind of file."""
    from mauve_rt.model.schema import FileModel  # noqa: PLC0415 - only this verb
    from mauve_rt.model.steps import steps_schema  # noqa: PLC0415
    from mauve_rt.modelling.schema import ModelFile  # noqa: PLC0415
    from mauve_rt.supervision.rules import Rules  # noqa: PLC0415

    match kind:
        case FileKind.ARCHITECTURE:
            return FileModel.json_document(kind.value)
        case FileKind.RULES:
            return Rules.json_document(kind.value)
        case FileKind.STEPS:
            return steps_schema()
        case FileKind.MODEL:
            return ModelFile.json_document(kind.value)
