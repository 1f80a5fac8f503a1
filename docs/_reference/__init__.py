"""A Sphinx extension: it writes the generated parts of the pages in docs/reference/.

A page has the line `<!-- generated: NAME -->`. The Markdown of the part NAME takes the place of that line
when Sphinx reads the page. So no generated page is stored, and none can be out of date.
"""

import re
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
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
    app.connect("source-read", lambda _app, _name, source: source.__setitem__(0, _filled(source[0], known)))
    return {"parallel_read_safe": True}


def _filled(page: str, known: Mapping[str, Callable[[], str]]) -> str:
    return _MARK.sub(lambda mark: known[mark[1]](), page)


if str(ROOT) not in sys.path:
    sys.path.insert(0, str(ROOT))  # the sources of this clone
