"""A package of a user on the disk: where it is, by what it is built, and where it is installed."""

import re
import shutil
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

from mauve_rt.errors import ParameterError

_FILE = "package.xml"
_LINKED = re.compile(r"^AMENT_CMAKE_SYMLINK_INSTALL:\w+=(1|ON|TRUE)$", re.MULTILINE)


@dataclass(frozen=True)
class Package:
    """A folder with a package.xml."""

    name: str
    folder: Path
    workspace: Path | None
    """Of colcon, where it builds the package; None: CMake does."""

    @property
    def build(self) -> Path:
        """What CMake builds in."""
        return self.workspace / "build" / self.name if self.workspace else self.folder / "build"

    @property
    def prefixes(self) -> list[Path]:
        """Where a build installs the package: of a workspace in a folder of its own, or merged."""
        if self.workspace is None:
            return [self.folder / "install"]
        return [self.workspace / "install" / self.name, self.workspace / "install"]

    @property
    def prefix(self) -> Path:
        """Where it is installed.

        Raises:
            ParameterError: nowhere.
        """
        for prefix in self.prefixes:
            if (self._share(prefix) / _FILE).exists():
                return prefix
        raise ParameterError(
            f"package {self.name}: expected it installed in {self.prefixes[0]}, found nothing. "
            "Call mauve build."
        )

    @property
    def is_linked(self) -> bool:
        """Whether the workspace was built with --symlink-install: a build without it fails there."""
        caches = self.workspace.glob("build/*/CMakeCache.txt") if self.workspace else ()
        return any(_LINKED.search(cache.read_text(encoding="utf-8", errors="replace")) for cache in caches)

    @property
    def share(self) -> Path:
        """Its own folder in its prefix. Raises as prefix."""
        return self._share(self.prefix)

    def _share(self, prefix: Path) -> Path:
        return prefix / "share" / self.name


def find_package(folder: Path) -> Package:
    """The package that the folder is in.

    Raises:
        ParameterError: it is in none, or the package has no name.
    """
    folder = folder.absolute()
    for each in (folder, *folder.parents):
        if (each / _FILE).is_file():
            return Package(_name(each / _FILE), each, _workspace(each))
    raise ParameterError(
        f"{folder}: expected a folder with package.xml, or one below it, found none. "
        "Go to a package, or write one with mauve new package NAME."
    )


def _name(file: Path) -> str:
    try:
        root = ET.parse(file).getroot()  # noqa: S314 - the user's own file
    except (ET.ParseError, OSError) as error:
        raise ParameterError(f"{file}: {error}. Correct the file.") from None
    if name := root.findtext("name", "").strip():
        return name
    raise ParameterError(f"{file}: expected <name>, found none. Give the package a name.")


def _workspace(folder: Path) -> Path | None:
    """Of colcon: the folder whose src/ has the package."""
    if shutil.which("colcon") is None:
        return None
    return next((each.parent for each in folder.parents if each.name == "src"), None)
