"""`mauve schema KIND`: the JSON Schema of a kind of file, made from the tables that check files."""

import argparse

from mauve_rt.cli.verb import OK
from mauve_rt.file_schema.file_kind import FileKind


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The kind of file."""
    parser.add_argument("kind", choices=[kind.value for kind in FileKind], help="kind of the file")


def main(args: argparse.Namespace) -> int:
    """Print the schema."""
    from mauve_rt.scaffold.schemas import schema_text  # noqa: PLC0415 - only this verb

    print(schema_text(FileKind(args.kind)), end="")
    return OK
