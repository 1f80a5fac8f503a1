"""Templates of new files, by jinja2: folders of `templates/`, whose files end with `.j2`.

The path of a file is a template, too: `src/{{file}}.hpp.j2`.
"""

import os
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from mauve_rt.errors import ParameterError
from mauve_rt.modelling.source_templates import environment
from mauve_rt.unfinished import discard

_TEMPLATES = Path(__file__).with_name("templates")
_KEPT = "__init__.py"  # parts share it: it is written where there is none


def render(kind: str, values: Mapping[str, Any]) -> dict[Path, str]:
    """The files of a kind of template, by their paths below the package."""
    folder = _TEMPLATES / kind
    templates = environment(folder)
    return {
        Path(templates.from_string(name.removesuffix(".j2")).render(values)): templates.get_template(
            name
        ).render(values)
        for name in templates.list_templates(extensions=["j2"])
    }


def write_package(folder: Path, files: Mapping[Path, str]) -> None:
    """Write a new folder with these files, as a whole or not at all.

    Raises:
        ParameterError: the folder exists.
        OSError: it cannot be written.
    """
    if os.path.lexists(folder):
        raise _exists([folder])
    folder = folder.absolute()
    with tempfile.TemporaryDirectory(dir=folder.parent, prefix=f".{folder.name}.") as temporary:
        new = Path(temporary) / folder.name
        _write(new, files)
        new.rename(folder)


def write_parts(package: Path, files: Mapping[Path, str]) -> list[Path]:
    """Write new files into a package, all or none; returns their paths below it.

    Raises:
        ParameterError: a file exists.
        OSError: one cannot be written.
    """
    wanted = {
        path: text
        for path, text in files.items()
        if not (path.name == _KEPT and os.path.lexists(package / path))
    }
    if there := [package / path for path in wanted if os.path.lexists(package / path)]:
        raise _exists(there)
    written: list[Path] = []
    try:
        for path, text in wanted.items():
            _write(package, {path: text})
            written.append(path)
    except OSError:
        for path in written:
            discard(package / path)
        raise
    return written


def _exists(paths: Iterable[Path]) -> ParameterError:
    names = ", ".join(map(str, paths))
    return ParameterError(
        f"{names}: exists already, and nothing was written. Choose another name, or remove it."
    )


def _write(folder: Path, files: Mapping[Path, str]) -> None:
    for path, text in files.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        with (folder / path).open("x", encoding="utf-8") as file:
            file.write(text)
