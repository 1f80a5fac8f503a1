"""scripts/docs: it refuses pages with a broken link, and pages that load something from the network."""

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest
from headless_browser import find_browser

ROOT = Path(__file__).resolve().parents[3]
INSTALLED = ROOT / ".venv" / ".mauve-stamp-docs"
NO_VARIABLES = {"PATH": os.environ["PATH"], "HOME": os.environ.get("HOME", "/")}

needs_sphinx = pytest.mark.skipif(
    not INSTALLED.is_file(),
    reason="Sphinx is not installed: scripts/docs installs it, scripts/lint calls that",
)


def _build(folder: Path, page: str) -> subprocess.CompletedProcess[str]:
    """Build a documentation of two pages with our settings."""
    pages = folder / "pages"
    pages.mkdir()
    shutil.copy(ROOT / "docs" / "conf.py", pages)
    (pages / "index.md").write_text(f"# First\n\n```{{toctree}}\nsecond\n```\n\n{page}\n", encoding="utf-8")
    (pages / "second.md").write_text("# Second\n\n## A heading\n", encoding="utf-8")
    command = [ROOT / "scripts" / "docs", "--source", pages, "--out", folder / "html"]
    return subprocess.run(command, env=NO_VARIABLES, capture_output=True, text=True, check=False)


@needs_sphinx
def test_pages_and_the_index_of_the_search_are_written(tmp_path: Path) -> None:
    done = _build(tmp_path, "[second](second.md#a-heading), [elsewhere](https://example.org/)")
    assert done.returncode == 0, done.stderr
    assert re.search(r"^\d pages in .*/html \(\d+\.\d s\)$", done.stdout)
    index = (tmp_path / "html" / "searchindex.js").read_text(encoding="utf-8")
    assert "second" in index
    search = (tmp_path / "html" / "search.html").read_text(encoding="utf-8")
    assert '<script src="searchindex.js"' in search  # a page from a file may load it, and fetch nothing


@needs_sphinx
@pytest.mark.parametrize("link", ["third.md", "second.md#another-heading", "#nowhere", "missing.svg"])
def test_a_broken_link_is_refused(link: str, tmp_path: Path) -> None:
    done = _build(tmp_path, f"[text]({link})")
    assert done.returncode != 0
    assert re.search(rf"index\.md:7: WARNING: .*{re.escape(link.rpartition('#')[2])}", done.stderr)


@needs_sphinx
def test_the_search_works_from_files(tmp_path: Path) -> None:
    browser = find_browser()
    if browser is None:
        pytest.skip("no browser: no Chromium on PATH, and CHROME is not set")
    assert _build(tmp_path, "text").returncode == 0
    options = ["--headless=new", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path / 'browser'}"]
    address = f"{(tmp_path / 'html' / 'search.html').as_uri()}?q=heading"
    command = [browser, *options, "--virtual-time-budget=10000", "--dump-dom", address]
    shown = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    assert re.search(r'<a href="second\.html#a-heading"[^>]*>Second &gt; A heading</a>', shown)


@needs_sphinx
def test_what_comes_from_the_network_is_refused(tmp_path: Path) -> None:
    done = _build(tmp_path, '<img src="https://example.org/picture.png">')
    assert done.returncode != 0
    assert "https://example.org/picture.png" in done.stdout
    assert "put the files into docs/" in done.stderr


def test_lint_builds_the_pages() -> None:
    """Without a name of a tool as with all."""
    lint = (ROOT / "scripts" / "lint").read_text(encoding="utf-8")
    assert re.search(r"^readonly ALL_TOOLS=\(.*\bdocs\)$", lint, re.MULTILINE)
    assert "\nlint_docs() { bash scripts/docs; }\n" in lint
