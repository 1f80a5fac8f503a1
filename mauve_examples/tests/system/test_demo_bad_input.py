"""Bad input: one clear line, exit status 2, nothing started and nothing left."""

from pathlib import Path

import pytest
from demo_harness import Starter

GOOD = (
    "image: m.pgm\nresolution: 0.1\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
)


def write_map(
    folder: Path, *, image: bytes | None = None, old: str = "", new: str = "", value: int = 254
) -> str:
    """A map of 40 x 40 cells, spoilt."""
    (folder / "m.yaml").write_text(GOOD.replace(old, new), encoding="utf-8")
    free = b"P5 40 40 255\n" + bytes([value]) * 1600
    (folder / "m.pgm").write_bytes(free if image is None else image)
    return str(folder / "m.yaml")


def refused(start: Starter, *arguments: str) -> str:
    demo = start(*arguments)
    assert demo.finish() == 2, demo.lines
    assert demo.lines == []
    assert demo.errors.count("\n") == 1, demo.errors
    assert not demo.out.exists()
    assert demo.processes() == {}
    return demo.errors


@pytest.mark.parametrize(
    ("spoilt", "words"),
    [
        ({"image": b"P5 40 40 255\n" + b"\xfe" * 100}, "m.pgm"),
        ({"image": b"P5 40"}, "m.pgm"),
        ({"image": b""}, "m.pgm"),
        ({"image": b"GIF89a" + b"\0" * 1600}, "m.pgm"),
        ({"value": 0}, "free"),
        ({"value": 205}, "free"),
        ({"old": "resolution: 0.1", "new": "resolution: -0.1"}, "resolution"),
        ({"old": "resolution: 0.1", "new": "resolution: 0"}, "resolution"),
        ({"old": "resolution: 0.1\n", "new": ""}, "resolution"),
        ({"old": "resolution: 0.1", "new": "resolution: wide"}, "resolution"),
        ({"old": "origin: [0, 0, 0]", "new": "origin: [0]"}, "origin"),
        ({"old": "image: m.pgm", "new": "image: none.pgm"}, "none.pgm"),
        ({"old": "image: m.pgm", "new": "image: ["}, "m.yaml"),
    ],
)
def test_bad_maps(start: Starter, spoilt: dict, words: str):
    assert words in refused(start, "--map", write_map(start.folder, **spoilt))


@pytest.mark.parametrize(
    "content",
    [
        b"image: m\xff.pgm\n",
        GOOD.encode("utf-16"),
        b"image: m.pgm\0\n",
        b"",
        b"[" * 100_000,
        b"a: " * 400_000,
    ],
    ids=["ff", "utf16", "nul", "empty", "deep", "huge"],
)
def test_a_map_file_that_is_no_text_or_no_map(start: Starter, content: bytes):
    path = write_map(start.folder)
    Path(path).write_bytes(content)
    assert "m.yaml" in refused(start, "--map", path)


def test_a_folder_is_no_map_file(start: Starter):
    (start.folder / "m.yaml").mkdir()
    assert "m.yaml" in refused(start, "--map", str(start.folder / "m.yaml"))


@pytest.mark.parametrize("name", ["none.yaml", "/nowhere/none.yaml", "nosuchmap"])
def test_a_map_that_is_not_there(start: Starter, name: str):
    assert name in refused(start, "--map", name)


def test_an_image_is_no_map_file(start: Starter):
    write_map(start.folder, value=205)  # no UTF-8 either
    assert "m.pgm" in refused(start, "--map", str(start.folder / "m.pgm"))


def test_more_robots_than_there_is_room_for(start: Starter):
    (start.folder / "m.yaml").write_text(GOOD, encoding="utf-8")
    cells = bytearray(b"\0" * 1600)
    for row in range(15, 25):
        cells[row * 40 + 15 : row * 40 + 25] = b"\xfe" * 10
    (start.folder / "m.pgm").write_bytes(b"P5 40 40 255\n" + bytes(cells))
    assert "room" in refused(start, "--map", str(start.folder / "m.yaml"), "--robots", "12")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--robots", "0"), "--robots 0"),
        (("--robots", "-3"), "--robots -3"),
        (("--robots", "two"), "--robots"),
        (("--robots", "999"), "--robots 999"),
        (("--robots", "1", "--link-loss-at", "5"), "link"),
        (("--duration", "0"), "--duration"),
        (("--duration", "nan"), "--duration"),
        (("--duration", "30"), "link"),
        (("--link-loss-at", "50"), "link"),
        (("--link-loss-at", "-1"), "--link-loss-at"),
        (("--link-loss-at", "95", "--link-back-at", "99"), "link"),
        (("--drop-share", "1.5"), "--drop-share"),
        (("--seed", "-1"), "--seed"),
        (("--nonsense",), "--nonsense"),
        (("--map",), "--map"),
    ],
)
def test_bad_options(start: Starter, arguments: tuple[str, ...], words: str):
    assert words in refused(start, *arguments)


def test_a_folder_with_something_in_it_is_not_written_to(start: Starter):
    out = start.folder / "taken"
    out.mkdir()
    (out / "mine.txt").write_text("keep", encoding="utf-8")
    demo = start(out=out)
    assert demo.finish() == 2
    assert "taken" in demo.errors
    assert [path.name for path in out.iterdir()] == ["mine.txt"]
