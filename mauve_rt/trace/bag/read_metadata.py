"""metadata.yaml, as a reader takes it."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from mauve_rt.trace.bag.disk import METADATA
from mauve_rt.trace.errors import TraceError
from mauve_rt.yaml.text import YamlError, read_yaml

_INFORMATION = "rosbag2_bagfile_information"
_MAX_METADATA_BYTES = 64_000_000  # of hundreds of thousands of files


def read_metadata(path: Path) -> Mapping[str, Any]:
    """Return what rosbag2 wrote.

    Raises:
        TraceError: it is not there, or is something else; says only that.

    """
    try:
        with (path / METADATA).open("rb") as file:
            raw = file.read(_MAX_METADATA_BYTES + 1)
        read = read_yaml(raw.decode("utf-8"), max_bytes=_MAX_METADATA_BYTES)
    except FileNotFoundError as error:
        msg = "not there"
        raise TraceError(msg) from error
    except (OSError, UnicodeDecodeError, YamlError) as error:
        msg = f"cannot be read ({str(error).splitlines()[0]})"
        raise TraceError(msg) from error
    told = read.get(_INFORMATION) if isinstance(read, dict) else None
    if not isinstance(told, dict):
        msg = f"has no {_INFORMATION}"
        raise TraceError(msg)
    return told


def file_names(metadata: Mapping[str, Any]) -> list[str]:
    """The names of the bag's files that it has."""
    listed = metadata.get("relative_file_paths")
    return [Path(str(name)).name for name in listed] if isinstance(listed, list) else []
