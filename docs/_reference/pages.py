"""Write the generated parts into the pages of docs/reference/ that people read in the repository.

    python docs/_reference/pages.py

tests/python/project/test_reference.py fails where a page has another text than the sources give.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from _reference import PAGES, filled, parts

if __name__ == "__main__":
    known = parts()
    for page in PAGES:
        text = page.read_text("utf-8")
        if (new := filled(text, known)) != text:
            page.write_text(new, "utf-8")
            sys.stdout.write(f"{page}\n")
