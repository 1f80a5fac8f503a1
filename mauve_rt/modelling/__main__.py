"""What CMake's mauve_rt_generate_model() calls.

    python -m mauve_rt.modelling MODEL --package NAME --output FOLDER [--python]

Writes the generated files, and prints a line for each thing that the build has to know: `reads FILE`,
`message NAME` of the package's own, `interface NAME` of others. Exit status 2: the model is wrong.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from mauve_rt.errors import ArchitectureFileError, MauveError
from mauve_rt.modelling.generate import generated, interfaces, messages, write_generated
from mauve_rt.modelling.loading import load_model


def main() -> int:
    """Generate, and say what was."""
    parser = argparse.ArgumentParser(prog="mauve_rt_generate_model")
    parser.add_argument("model", type=Path)
    parser.add_argument("--package", required=True)
    parser.add_argument("--output", type=Path, required=True)
    parser.add_argument("--python", action="store_true")
    args = parser.parse_args()
    try:
        model = load_model(args.model)
        if model.package != args.package:
            raise model.error(
                ("package",), "the model is of another package", expected=args.package, found=model.package
            )
        write_generated(args.output, generated(model, is_python=args.python))
    except ArchitectureFileError as error:
        print("\n".join(error.lines()), file=sys.stderr)
        return 2
    except MauveError as error:
        print(error, file=sys.stderr)
        return 2
    for warning in model.warnings:
        print(f"{model.path}:{warning.line}:{warning.column}: warning: {warning.text()}", file=sys.stderr)
    found: dict[str, Sequence[str | Path]] = {
        "message": messages(model),
        "interface": interfaces(model),
        "reads": [model.path, *_own_files()],
    }
    for kind, names in found.items():
        for name in names:
            print(kind, name)
    return 0


def _own_files() -> list[Path]:
    """What the generated files are made by."""
    folder = Path(__file__).parent
    return sorted([*folder.glob("*.py"), *folder.glob("templates/**/*.j2")])


if __name__ == "__main__":
    sys.exit(main())
