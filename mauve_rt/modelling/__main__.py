"""What CMake's mauve_rt_generate_model() calls.

    python -m mauve_rt.modelling MODEL --package NAME --output FOLDER [--python] [--prefixes FOLDER...]

Writes the generated files, and prints a line for each thing that the build has to know: `reads FILE`,
`message NAME` of the package's own, `interface NAME` of others, `uses PREFIX` of installed models. Exit
status 2: the model is wrong.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from mauve_rt.errors import ArchitectureFileError, MauveError
from mauve_rt.modelling.generate import generated, interfaces, messages, write_generated
from mauve_rt.modelling.loading import ModelLoader
from mauve_rt.modelling.package_model import PackageModel
from mauve_rt.modelling.python import parts_module
from mauve_rt.modelling.scope import references


def main() -> int:
    """Generate, and say what was."""
    parser = argparse.ArgumentParser(prog="mauve_rt_generate_model")
    parser.add_argument("model", type=Path)
    parser.add_argument("--package", required=True)
    parser.add_argument("--output", type=Path, required=True)
    parser.add_argument("--python", action="store_true")
    parser.add_argument("--prefixes", nargs="*", type=Path, default=[])
    args = parser.parse_args()
    try:
        model = ModelLoader(prefixes=args.prefixes).load(args.model)
        if model.package != args.package:
            raise model.error(
                ("package",), "the model is of another package", expected=args.package, found=model.package
            )
        _require_generated(model, is_python=args.python)
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
        "reads": [model.path, *(one.path for one in model.closure()), *_own_files()],
        "uses": [*dict.fromkeys(map(_prefix, model.closure()))],
    }
    for kind, names in found.items():
        for name in names:
            print(kind, name)
    return 0


def _prefix(model: PackageModel) -> Path:
    """Where an installed model is installed."""
    return model.path.parents[2]


def _require_generated(model: PackageModel, *, is_python: bool) -> None:
    """Raises: ArchitectureFileError: the code of a model that it uses is installed in the other language."""
    for reference in references(model.content):
        if reference.kind == "type":
            continue  # a message has both
        used = model.used[reference.package]
        files = (
            f"lib/python3*/site-packages/{parts_module(used.package)}/model.py"
            if is_python
            else f"include/{used.package}/model"
        )
        if not [*_prefix(used).glob(files)]:
            language = "Python" if is_python else "C++"
            what = f"package '{used.package}' has no code in {language} of its model"
            expected = str(_prefix(used) / files)
            remedy = f"write both packages in one language, or the {reference.kind} in this package"
            raise model.error(reference.place, what, expected=expected, remedy=remedy)


def _own_files() -> list[Path]:
    """What the generated files are made by."""
    folder = Path(__file__).parent
    return sorted([*folder.glob("*.py"), *folder.glob("templates/**/*.j2")])


if __name__ == "__main__":
    sys.exit(main())
