"""README.md and the pages of docs/, by their paths below the project."""

from pathlib import Path

import check_claims

ROOT = Path(__file__).parents[2]
PAGES = check_claims.pages(ROOT)
ALL = "\n\n".join(PAGES.values())
