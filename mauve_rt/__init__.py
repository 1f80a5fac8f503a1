"""MAUVE RT: real-time components whose software can be rewired and re-implemented while it runs, on ROS 2.

`mauve_rt.api` is the door for who writes parts and programs in Python; `mauve_rt.trace` reads what happened.
`mauve_rt.model` reads architecture files, `mauve_rt.node` runs them as ROS 2 nodes, `mauve_rt.cli` is the
`mauve` command.
"""

from typing import TYPE_CHECKING

__all__ = ["__version__"]

if TYPE_CHECKING:
    __version__: str
else:

    def __getattr__(name: str) -> str:
        """`__version__`, when it is asked for: finding it takes longer than all else that is loaded here."""
        if name != "__version__":
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        globals()[name] = _version()
        return globals()[name]


def _version() -> str:
    """What package.xml says; where this is installed, the metadata made of it."""
    import xml.etree.ElementTree as ET  # noqa: PLC0415
    from importlib.metadata import version  # noqa: PLC0415
    from pathlib import Path  # noqa: PLC0415

    of_clone = Path(__file__).parents[1] / "package.xml"
    if of_clone.is_file():
        return ET.parse(of_clone).findtext("version", "").strip()  # noqa: S314 - our own file
    return version("mauve_rt")
