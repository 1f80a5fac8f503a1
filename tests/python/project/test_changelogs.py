"""The changelogs are as bloom wants them: ROS's own tools make a release of `Forthcoming`, and read it."""

import shutil
from pathlib import Path

import pytest
from catkin_pkg.changelog import BulletList, get_changelog_from_path
from catkin_pkg.package import parse_package
from catkin_pkg.package_version import get_forthcoming_label, update_changelog_sections

ROOT = Path(__file__).parents[3]


@pytest.mark.parametrize("package", [ROOT, ROOT / "mauve_msgs"], ids=lambda path: path.name)
def test_a_release_takes_what_is_forthcoming(package: Path, tmp_path: Path):
    about = parse_package(package)
    copy = Path(shutil.copy(package / "CHANGELOG.rst", tmp_path))
    text = copy.read_text(encoding="utf-8")
    assert f"\nChangelog for package {about.name}\n" in text
    label = get_forthcoming_label(text)
    assert label == "Forthcoming"
    changelog = get_changelog_from_path(copy)
    update_changelog_sections({about.name: (str(copy), changelog, label)}, about.version)
    [(version, _, content)] = get_changelog_from_path(copy).foreach_version()
    assert version == about.version
    [bullets] = content
    assert isinstance(bullets, BulletList)
    assert list(bullets)
