"""How templates of source code are read, by jinja2."""

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from jinja2 import Environment


def environment(folder: Path) -> "Environment":
    """Of the templates in a folder. A name that a template lacks is an error; nothing is escaped."""
    import jinja2  # noqa: PLC0415 - only who generates needs it

    return jinja2.Environment(  # noqa: S701 - source code is no HTML
        loader=jinja2.FileSystemLoader(folder),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
