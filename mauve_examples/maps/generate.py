#!/usr/bin/env python3
"""Draws the maps of this folder: office (PGM), room (PGM) and arena (PNG).

Run it again after a change; the same plans give the same bytes. Plans are drawn in metres: what is carved
becomes free, and whatever touches free space becomes a wall. The rest stays unknown, as inside thick walls
and outside the building, where no robot ever looked.
"""

import struct
import sys
import zlib
from dataclasses import dataclass, field
from pathlib import Path

OCCUPIED, UNKNOWN, FREE = 0, 205, 254
WALL_CELLS = 2


@dataclass
class Plan:
    """A drawing on a grid; x to the right and y upwards, in metres from the origin's corner."""

    width_m: float
    height_m: float
    resolution_m: float
    origin_m: tuple[float, float]
    rows: list[bytearray] = field(init=False)

    def __post_init__(self) -> None:
        """Starts with everything unknown; rows[0] is the lowest."""
        self.width = round(self.width_m / self.resolution_m)
        self.height = round(self.height_m / self.resolution_m)
        self.rows = [bytearray([UNKNOWN]) * self.width for _ in range(self.height)]

    def _cells(self, low: float, high: float, origin: float) -> range:
        return range(round((low - origin) / self.resolution_m), round((high - origin) / self.resolution_m))

    def fill(self, x0: float, y0: float, x1: float, y1: float, shade: int) -> None:
        """Paints a rectangle."""
        columns = self._cells(x0, x1, self.origin_m[0])
        for row in self._cells(y0, y1, self.origin_m[1]):
            self.rows[row][columns.start : columns.stop] = bytes([shade]) * len(columns)

    def carve(self, *rectangles: tuple[float, float, float, float]) -> None:
        """Makes rectangles free: rooms, corridors, doorways."""
        for rectangle in rectangles:
            self.fill(*rectangle, FREE)

    def block(self, *rectangles: tuple[float, float, float, float]) -> None:
        """Puts solid things: pillars, furniture."""
        for rectangle in rectangles:
            self.fill(*rectangle, OCCUPIED)

    def raise_walls(self) -> None:
        """Turns unknown cells near free ones into walls."""
        near = range(-WALL_CELLS, WALL_CELLS + 1)
        free = [[shade == FREE for shade in row] for row in self.rows]
        for y in range(self.height):
            for x in range(self.width):
                if self.rows[y][x] == UNKNOWN and any(
                    free[y + dy][x + dx]
                    for dy in near
                    for dx in near
                    if 0 <= y + dy < self.height and 0 <= x + dx < self.width
                ):
                    self.rows[y][x] = OCCUPIED

    def image(self) -> bytes:
        """Gives the pixels, row by row from the top."""
        return b"".join(bytes(row) for row in reversed(self.rows))

    def write_pgm(self, path: Path) -> None:
        """Writes a raw PGM with a comment in its header, as map_saver does."""
        comment = f"# CREATOR: {Path(__file__).name} {self.resolution_m:.3f} m/pix"
        path.write_bytes(f"P5\n{comment}\n{self.width} {self.height}\n255\n".encode() + self.image())
        self._write_yaml(path)

    def write_png(self, path: Path) -> None:
        """Writes an 8 bit grey PNG."""

        def chunk(kind: bytes, data: bytes) -> bytes:
            return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

        pixels = b"".join(b"\0" + bytes(row) for row in reversed(self.rows))
        header = struct.pack(">IIBBBBB", self.width, self.height, 8, 0, 0, 0, 0)
        path.write_bytes(
            b"\x89PNG\r\n\x1a\n"
            + chunk(b"IHDR", header)
            + chunk(b"IDAT", zlib.compress(pixels, 9))
            + chunk(b"IEND", b"")
        )
        self._write_yaml(path)

    def _write_yaml(self, image: Path) -> None:
        image.with_suffix(".yaml").write_text(
            f"image: {image.name}\nmode: trinary\nresolution: {self.resolution_m}\n"
            f"origin: [{self.origin_m[0]}, {self.origin_m[1]}, 0]\n"
            "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
        )


def office() -> Plan:
    """Draws a floor of offices: corridors, rooms with doors, an open-plan hall and a lobby with pillars."""
    plan = Plan(48.0, 32.0, 0.1, (-24.0, -16.0))
    plan.carve((-17.0, -1.2, 17.0, 1.2))  # main corridor

    # North-west: the open-plan hall, with pillars and desks.
    plan.carve((-17.0, 2.0, -5.0, 9.0), (-15.4, 1.0, -13.0, 2.2), (-8.4, 1.0, -6.0, 2.2))
    plan.block((-13.4, 5.2, -12.9, 5.7), (-8.9, 5.2, -8.4, 5.7))
    plan.block((-16.2, 4.0, -14.8, 4.7), (-11.6, 7.0, -10.2, 7.7), (-11.6, 3.4, -10.2, 4.1))

    # North: two rooms.
    plan.carve((-4.2, 2.0, 0.2, 5.6), (1.0, 2.0, 5.4, 5.6), (-2.8, 1.0, -1.2, 2.2), (2.4, 1.0, 4.0, 2.2))

    # North-east: a room and a larger one.
    plan.carve((6.2, 2.0, 10.6, 5.6), (11.4, 2.0, 17.0, 9.0))
    plan.carve((7.6, 1.0, 9.2, 2.2), (13.4, 1.0, 15.0, 2.2))

    # South: the lobby, with pillars and a desk.
    plan.carve((-5.4, -8.0, 5.4, -2.0), (-2.4, -2.2, 2.4, -1.0))
    plan.block((-3.4, -5.0, -2.9, -4.5), (2.9, -5.0, 3.4, -4.5), (-0.8, -7.0, 0.8, -6.4))

    # South-west and south-east: rooms on the corridor, one behind them.
    plan.carve((-17.0, -5.6, -12.0, -2.0), (-11.2, -5.6, -6.4, -2.0), (-12.4, -9.4, -6.4, -6.4))
    plan.carve((-15.4, -2.2, -13.8, -1.0), (-9.8, -2.2, -8.2, -1.0), (-9.4, -6.6, -7.8, -5.4))
    plan.carve((6.2, -5.6, 11.0, -2.0), (11.8, -5.6, 17.0, -2.0), (6.2, -9.4, 12.2, -6.4))
    plan.carve((7.8, -2.2, 9.4, -1.0), (13.8, -2.2, 15.4, -1.0), (7.6, -6.6, 9.2, -5.4))

    # Tables.
    plan.block(
        (-11.0, -8.2, -9.6, -7.6), (9.6, -8.4, 11.0, -7.8), (14.0, 5.2, 15.6, 5.8), (-3.4, 3.6, -2.4, 4.2)
    )
    return plan


def room() -> Plan:
    """Draws one room with a pillar and a table, for tests."""
    plan = Plan(12.0, 8.0, 0.05, (-6.0, -4.0))
    plan.carve((-5.5, -3.5, 5.5, 3.5))
    plan.block((-0.3, -0.3, 0.3, 0.3), (2.5, 1.0, 4.0, 1.8))
    return plan


def arena() -> Plan:
    """Draws a square with a cross of walls and four passages."""
    plan = Plan(20.0, 20.0, 0.1, (-10.0, -10.0))
    plan.carve((-9.0, -9.0, 9.0, 9.0))
    plan.block((-9.0, -0.2, -2.0, 0.2), (2.0, -0.2, 9.0, 0.2), (-0.2, -9.0, 0.2, -2.0), (-0.2, 2.0, 0.2, 9.0))
    plan.carve((-6.2, -0.2, -4.8, 0.2), (4.8, -0.2, 6.2, 0.2), (-0.2, -6.2, 0.2, -4.8), (-0.2, 4.8, 0.2, 6.2))
    plan.block((-5.0, 5.0, -4.4, 5.6), (4.4, -5.6, 5.0, -5.0), (-5.6, -5.0, -5.0, -4.4), (5.0, 4.4, 5.6, 5.0))
    return plan


def main() -> None:
    """Draws every map beside this script, or into the folder given."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    for plan, name in ((office(), "office.pgm"), (room(), "room.pgm"), (arena(), "arena.png")):
        plan.raise_walls()
        path = folder / name
        if path.suffix == ".png":
            plan.write_png(path)
        else:
            plan.write_pgm(path)


if __name__ == "__main__":
    main()
