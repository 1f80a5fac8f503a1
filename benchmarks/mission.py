"""How fast a mission passes in simulated time, beside real time."""

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from native import BenchmarkError
from processes import Processes
from rows import Row, compared
from settings import Settings

from mauve_examples import _mission
from mauve_examples.mission.architecture import map_file

_ROBOTS = 4
_RESOLUTION_M = 0.03
_TIMES = ("--duration", "20", "--link-loss-at", "6", "--link-back-at", "12")
_TIMEOUT_S = 300.0
_RATIO = 0.2  # five times as fast as real time


def mission_rows(settings: Settings) -> Iterator[Row]:
    """Missions of four robots in the office, in cells of 3 cm."""
    with Processes() as processes:
        world = _refined_office(processes.folder)
        rounds = [_simulate(world, processes.folder / f"mission_{i}") for i in range(settings.rounds)]
    yield compared(
        f"mission of {_ROBOTS} robots in simulated time, map of {_RESOLUTION_M:g} m",
        rounds,
        unit="s",
        beside="the time that passes in it",
        ratio_limit=_RATIO,
        note=f"{' '.join(_TIMES)}",
    )


def _refined_office(folder: Path) -> Path:
    """The project's office, 48 m x 32 m, in finer cells."""
    office = _mission.load_map(str(map_file("office")))
    height, width = (round(cells * office.resolution_m / _RESOLUTION_M) for cells in office.cells.shape)
    row, column = (
        np.minimum(((np.arange(cells) + 0.5) * _RESOLUTION_M / office.resolution_m).astype(int), most - 1)
        for cells, most in zip((height, width), office.cells.shape, strict=True)
    )
    grey = np.select([office.cells == 0, office.cells > 0], [254, 0], 205).astype(np.uint8)
    image = grey[np.ix_(row, column)][::-1]  # of an image the first row has the highest y
    (folder / "fine.pgm").write_bytes(b"P5\n%d %d\n255\n" % (width, height) + image.tobytes())
    path = folder / "fine.yaml"
    origin = [office.origin_x_m, office.origin_y_m, 0]
    path.write_text(
        f"image: fine.pgm\nmode: trinary\nresolution: {_RESOLUTION_M}\norigin: {origin}\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\n",
        encoding="utf-8",
    )
    return path


def _simulate(world: Path, out: Path) -> tuple[float, float]:
    """Seconds that the mission took, and that passed in it."""
    options = ("--simulated-time", "--robots", str(_ROBOTS), "--map", str(world), *_TIMES, "--out", str(out))
    command = [sys.executable, "-P", "-m", "mauve_examples.mission.demo", *options]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=_TIMEOUT_S)
    if done.returncode != 0:
        raise BenchmarkError(f"the mission failed: {(done.stderr or done.stdout).strip()[-200:]}")
    run = json.loads((out / "summary.json").read_text(encoding="utf-8"))["simulation"]
    return float(run["wall_s"]), float(run["virtual_s"])
