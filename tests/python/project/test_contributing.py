"""CONTRIBUTING.md names what is there."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[3]
TEXT = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")


def test_files_that_it_names_are_there():
    folders = r"mauve_\w+|tests|docs|scripts"
    named = re.findall(rf"(?<![\w/.])((?:{folders})/[\w./]*\w/?)(?![\w<{{*])", TEXT)
    assert len(named) > 20
    assert [name for name in named if "NAME" not in name and not (ROOT / name).exists()] == []


def test_targets_that_it_builds_are_there():
    targets = re.findall(r"ninja -C build/kernel (\w+)", TEXT)
    assert targets
    for target in targets:
        assert list(ROOT.glob(f"tests/kernel/*/{target}.cpp"))
