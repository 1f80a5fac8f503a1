"""Architectures of talkers, the 1 kHz components of ros/talker.cpp, and what is known of their releases."""

import json
from pathlib import Path

import numpy as np
import numpy.typing as npt
from native import ROOT, BenchmarkError

_BUILT = ROOT / "build" / "benchmarks"
_SOURCES = Path(__file__).with_name("ros")
_COMPONENT = {
    "shell": "bench/TalkerShell",
    "core": "bench/Talker",
    "fsm": "bench/TalkerFsm",
    "alternatives": ["bench/Sluggish"],
}
_TYPE = "geometry_msgs/msg/Point"


def plugin_prefix(folder: Path, package: str = "bench", plugin: str = "talker") -> Path:
    """An ament prefix in the folder, which has a plug-in of ros/."""
    prefix = folder / "plugins"
    index = prefix / "share" / "ament_index" / "resource_index"
    for kind in ("packages", "mauve_rt_plugins"):
        (index / kind).mkdir(parents=True)
    (index / "packages" / package).touch()
    (index / "mauve_rt_plugins" / package).symlink_to(_SOURCES / f"{plugin}.txt")
    (prefix / "lib").mkdir()
    library = f"libbench_{plugin}.so"
    (prefix / "lib" / library).symlink_to(_BUILT / library)
    return prefix


class Talkers:
    """Talkers named talker_0 ..., each of which writes to resources of its own.

    `bound` binds these to the topics NAMESPACE/point_0 ..., which is for a single talker.
    """

    def __init__(
        self,
        path: Path,
        *,
        count: int = 1,
        topics: int = 0,
        marks: int = 0,
        bound: str = "",
        priority: int,
        cpu: int,
        releases: int = 1,
        sent_anywhere: bool = False,
    ) -> None:
        """Write the architecture file; each talker remembers so many releases.

        It writes 4 + `marks` trace records each time.

        Messages are sent on the CPU of the talkers, unless `sent_anywhere`.
        """
        self.architecture = path
        self.names = [f"talker_{index}" for index in range(count)]
        self._files = [path.with_suffix(f".{name}") for name in self.names]
        resources = {}
        connections = []
        for name in self.names:
            for topic in range(topics):
                resource: dict[str, object] = {"kind": "shared_data", "type": _TYPE}
                if bound:
                    resource["topic"] = {"name": f"{bound}/point_{topic}", "direction": "publish"}
                resources[f"{name}_{topic}"] = resource
                connections.append([f"{name}.point_{topic}", f"{name}_{topic}.write"])
        components = {
            name: _COMPONENT
            | {"priority": priority, "cpus": [cpu]}
            | {"properties": {"topics": topics, "marks": marks, "releases": releases, "file": str(file)}}
            for name, file in zip(self.names, self._files, strict=True)
        }
        model = {
            "mauve": 1,
            "executor": {} if sent_anywhere else {"sender": {"cpus": [cpu]}},
            "components": components,
            "resources": resources,
            "connections": connections,
        }
        path.write_text(json.dumps(model), encoding="utf-8")  # which is YAML

    def releases(self) -> list[npt.NDArray[np.int64]]:
        """Of each talker, after the executor has ended.

        The instant of its configuration and 0, then rows of nominal and actual instants.

        Raises:
            BenchmarkError: one of them was never released.
        """
        found = []
        for file in self._files:
            rows = np.fromfile(file, np.int64).reshape(-1, 2) if file.exists() else np.empty((0, 2), np.int64)
            if len(rows) < 2:  # noqa: PLR2004
                raise BenchmarkError(f"{file.suffix[1:]} was never released")
            found.append(rows)
        return found
