"""A Sphinx extension: it writes the generated parts of the pages in docs/reference/.

A page has the lines `<!-- generated: NAME -->` and `<!-- end of NAME -->`. The Markdown of the part takes
the place of both, and of what is between them, when Sphinx reads the page. In the repository it stands there,
too: `pages.py` writes it, and a test compares it with the sources. Only the pages of the APIs, thousands of
lines, are not stored: they have the first line alone.
"""

import re
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
PAGES = sorted((ROOT / "docs" / "reference").glob("*.md"))
_STORED = re.compile(r"^<!-- generated: (\w+) -->\n.*?^<!-- end of \1 -->$", re.MULTILINE | re.DOTALL)
_MARK = re.compile(r"^<!-- generated: (\w+) -->$", re.MULTILINE)


def parts() -> Mapping[str, Callable[[], str]]:
    """The generated parts by name. They import MAUVE RT with a stub in the place of the native library."""
    from _reference import native  # noqa: PLC0415

    native.install()
    from _reference import (  # noqa: PLC0415
        architecture_file,
        commands,
        errors,
        headers,
        messages,
        model_file,
        node_parameters,
        python_api,
        rules_file,
        traces,
    )

    return {
        "architecture_file": architecture_file.text,
        "model_file": model_file.text,
        "rules_file": rules_file.rules,
        "steps_file": rules_file.steps,
        "script_file": rules_file.script,
        "commands": commands.text,
        "node_parameters": node_parameters.text,
        "messages": messages.messages,
        "services": messages.services,
        "actions": messages.actions,
        "errors": errors.text,
        "trace_records": traces.records,
        "bag": traces.bag,
        "plugin_kinds": traces.plugin_kinds,
        "python_api": python_api.text,
        "headers": headers.text,
    }


def setup(app: Any) -> dict[str, bool]:
    """Called by Sphinx: the generated parts are written while the pages are read."""
    known = parts()
    app.connect("source-read", lambda _app, _name, source: source.__setitem__(0, _for_site(source[0], known)))
    return {"parallel_read_safe": True}


def filled(page: str, known: Mapping[str, Callable[[], str]]) -> str:
    """The page with its stored parts as the sources give them."""

    def part(mark: re.Match[str]) -> str:
        name = mark[1]
        return f"<!-- generated: {name} -->\n\n{known[name]().strip()}\n\n<!-- end of {name} -->"

    return _STORED.sub(part, page)


def _for_site(page: str, known: Mapping[str, Callable[[], str]]) -> str:
    return _MARK.sub(lambda mark: known[mark[1]](), _STORED.sub(lambda mark: known[mark[1]](), page))


if str(ROOT) not in sys.path:
    sys.path.insert(0, str(ROOT))  # the sources of this clone
