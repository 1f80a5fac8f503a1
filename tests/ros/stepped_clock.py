"""A CLOCK_REALTIME that a test steps, for the processes it starts."""

import subprocess
from pathlib import Path


class SteppedClock:
    """Start processes with `environment`; then `step()`."""

    def __init__(self, folder: Path) -> None:
        library = folder / "stepped_clock.so"
        source = Path(__file__).with_suffix(".c")
        subprocess.run(["gcc", "-Wall", "-Werror", "-shared", "-fPIC", "-o", library, source], check=True)
        self._file = folder / "step"
        self._file.write_bytes(bytes(8))
        self.environment = {"LD_PRELOAD": str(library), "STEPPED_CLOCK": str(self._file)}

    def step(self, by_s: int) -> None:
        """Set the clock forward, or back, from what it really is."""
        with self._file.open("r+b") as file:  # the processes have mapped it
            file.write((by_s * 10**9).to_bytes(8, "little", signed=True))
