"""How scripts/docs makes a site of these pages: Sphinx reads MyST Markdown, furo draws the pages."""

import logging
import sys
from pathlib import Path

from docutils import nodes
from sphinx.application import Sphinx

project = "MAUVE RT"
html_title = "MAUVE RT"

extensions = ["myst_parser"]
if (Path(__file__).parent / "_reference").is_dir():  # not in the small sets of pages that tests build
    sys.path.insert(0, str(Path(__file__).parent))
    extensions.append("_reference")  # the parts of docs/reference/ that come from the sources
myst_heading_anchors = 4  # `page.md#a-heading` is a link that the build checks
myst_enable_extensions = ["colon_fence"]  # ::: around what is no code
# A kind of page may have no page yet. Sphinx gives that warning no type, so suppress_warnings cannot name it.
logging.getLogger("sphinx.sphinx.directives.other").addFilter(
    lambda record: getattr(record, "subtype", "") != "empty_glob"
)

highlight_language = "none"
smartquotes = False  # words of a program stay as they are typed

html_theme = "furo"
html_show_copyright = False
html_show_sourcelink = False
html_copy_source = False
html_show_search_summary = False  # a browser lets a page from a file read no other page


def _drop_comments(_app: Sphinx, page: nodes.document) -> None:
    """Leave out comments such as the marks of claims."""
    for node in list(page.findall(nodes.raw)):
        if node.astext().lstrip().startswith("<!--"):
            node.parent.remove(node)


def setup(app: Sphinx) -> None:
    """Sphinx calls this."""
    app.connect("doctree-read", _drop_comments)
