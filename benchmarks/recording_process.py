"""A process to be killed while it records: `recording_process.py LIBRARY BAG`.

Five 1 kHz components and the recorder, without ROS; it prints `records` and goes on until it is killed.
"""

import sys
import threading
from pathlib import Path

from mauve_rt.api import Architecture, Deployer, PluginRegistry
from mauve_rt.trace.recording.recorder import Recorder

COMPONENTS, MARKS = 5, 16


def main(library: str, bag: str) -> None:
    """Record 100,000 records a second."""
    registry = PluginRegistry()
    registry.load_library(library)
    architecture = Architecture(registry)
    for number in range(COMPONENTS):
        name = f"talker_{number}"
        architecture.add_component(
            name, "bench/TalkerShell", "bench/Talker", "bench/TalkerFsm", priority=80, cpus=[0]
        )
        architecture.set_property(name, "topics", 0)
        architecture.set_property(name, "marks", MARKS)
    architecture.configure()
    deployer = Deployer(architecture)
    recorder = Recorder(deployer, Path(bag), node_name="/executor")
    recorder.start()
    deployer.deploy()
    sys.stdout.write("records\n")
    sys.stdout.flush()
    threading.Event().wait()


if __name__ == "__main__":
    main(*sys.argv[1:])
