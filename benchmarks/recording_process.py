"""A process that records, to be killed or watched: `recording_process.py LIBRARY BAG [WHAT] [BY]`.

Without ROS; it prints `records` and goes on until it is killed. WHAT: `records`, of five 1 kHz components,
100,000 a second (the default), or `images`, 30 MB a second. BY: who writes the files, a `keeper` as in an
executor (the default), or the process `itself`.
"""

import sys
import threading
import time
from pathlib import Path

from mauve_rt.api import Architecture, Deployer, PluginRegistry
from mauve_rt.native_program import native_program
from mauve_rt.trace.recording.recorder import Recorder

COMPONENTS, MARKS = 5, 16
IMAGE_BYTES, IMAGE_HZ = 2_000_000, 15


def main(library: str, bag: str, what: str = "records", by: str = "keeper") -> None:
    """Record until the end."""
    registry = PluginRegistry()
    registry.load_library(library)
    architecture = Architecture(registry)
    for number in range(COMPONENTS if what == "records" else 0):
        name = f"talker_{number}"
        architecture.add_component(
            name, "bench/TalkerShell", "bench/Talker", "bench/TalkerFsm", priority=80, cpus=[0]
        )
        architecture.set_property(name, "topics", 0)
        architecture.set_property(name, "marks", MARKS)
    architecture.configure()
    deployer = Deployer(architecture)
    keeper = native_program("bag_keeper") if by == "keeper" else None
    recorder = Recorder(deployer, Path(bag), node_name="/executor", on_error=sys.exit, keeper=keeper)
    recorder.start()
    deployer.deploy()
    sys.stdout.write("records\n")
    sys.stdout.flush()
    image, waits = bytes([0, 1, 0, 0]) + bytes(IMAGE_BYTES), threading.Event()
    while not waits.wait(1 / IMAGE_HZ):
        if what == "images":
            recorder.record("/image", "std_msgs/msg/String", image, monotonic_ns=time.monotonic_ns())


if __name__ == "__main__":
    main(*sys.argv[1:])
