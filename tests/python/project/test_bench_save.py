"""The row from a save to new code: read from events of `mauve dev --plain`, of the tutorial's package."""

import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parents[3] / "benchmarks"))  # at the end: it hides nothing

import save
from native import BenchmarkError

_CYCLE = """\
12:00:00.400000 cycle {number}: saved room.hpp
12:00:00.400000 cycle {number}: building
12:00:03.900000 cycle {number}: built in 3.50 s
12:00:03.900000 cycle {number}: reloading
12:00:04.150000 cycle {number}: reloaded in 0.25 s: 1 library
12:00:04.200000 cycle {number}: first release 4.15 s after the save
12:00:04.250000 cycle {number}: in force: 1 library
"""


def _cycles(count: int) -> str:
    return "".join(_CYCLE.format(number=number) for number in range(1, count + 1))


def test_the_time_from_a_save_is_split() -> None:
    whole, build, reload, rest = save.rows_of(_cycles(10))
    assert (whole.measured, whole.target, whole.verdict) == (4.15, "<= 5 s", "met")
    assert (build.measured, reload.measured) == (3.5, 0.25)
    assert rest.measured == pytest.approx(0.4)


def test_a_save_that_leads_to_no_release_is_no_figure() -> None:
    failed = "12:00:05.000000 cycle 3: built in 3.50 s\n12:00:05.000000 cycle 3: refused: it crashed\n"
    with pytest.raises(BenchmarkError, match="refused: it crashed"):
        list(save.rows_of(_cycles(2) + failed))


def test_the_package_is_the_tutorials(tmp_path: Path) -> None:
    save._write_package(tmp_path)
    names = {str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*") if path.is_file()}
    sources = {"src/room.hpp", "src/plugins.cpp", "CMakeLists.txt", "package.xml"}
    assert names == {"room.yaml", *(f"climate/{name}" for name in sources)}
    source = tmp_path / "climate" / "src" / "room.hpp"
    texts = {source.read_text("utf-8")}
    for number in (1, 2):
        save._save(source, number)
        texts.add(source.read_text("utf-8"))
    assert len(texts) == 3
