"""What scripts/bench writes into a page is what one run found, and its gate lets no bad figure pass."""

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parents[3] / "benchmarks"))  # at the end: it hides nothing

import document
import run
from rows import Row, compared, exactly_zero, never_over, not_available
from settings import Settings

ROWS = {
    "a ratio within": compared("a", [(1.0, 2.0)] * 12, unit="us", beside="b", ratio_limit=1.5),
    "a ratio beyond": compared("a", [(4.0, 2.0)] * 12, unit="us", beside="b", ratio_limit=1.5),
    "too few rounds": compared("a", [(4.0, 2.0)] * 3, unit="us", beside="b", ratio_limit=1.5),
    "none": exactly_zero("a", [0, 0]),
    "one": exactly_zero("a", [0, 1], unit="releases"),
    "over": never_over("a", [3.0], limit=2.0, unit="ms"),
    "not here": not_available("a", "no such machine"),
}


@pytest.mark.parametrize(
    ("name", "status"),
    [
        ("a ratio within", 0),
        ("a ratio beyond", 1),
        ("too few rounds", 0),
        ("none", 0),
        ("one", 1),
        ("over", 1),
    ],
)
def test_the_gate(
    name: str, status: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def rows(_settings: Settings) -> Iterator[Row]:
        yield ROWS[name]

    monkeypatch.setattr(run, "BENCHMARKS", {"swap": rows})
    assert run.main([]) == 0, "without it nothing is judged"
    assert run.main(["--gate"]) == status
    assert ("bench: missed: a: expected" in capsys.readouterr().err) == bool(status)


def test_no_figure_of_the_page_was_typed() -> None:
    _, figures, _, kept = document.figures_of(document.PAGE.read_text(encoding="utf-8"))
    assert document.checksum(figures) == kept, "the figures are written by scripts/bench --write-docs"
    assert document.checksum(figures.replace("15 us", "14 us", 1)) != kept


def test_a_page_without_a_place_is_refused_before_anything_is_measured(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = tmp_path / "performance.md"
    page.write_text("no place\n", encoding="utf-8")
    monkeypatch.setattr(run, "PAGE", page)
    monkeypatch.setattr(run, "BENCHMARKS", {"swap": lambda _settings: pytest.fail("it measures")})
    with pytest.raises(SystemExit):
        run.main(["--write-docs"])
    assert "--write-docs: performance.md: expected the lines" in capsys.readouterr().err


def test_the_page_is_written_from_a_whole_run_only(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = tmp_path / "performance.md"
    page.write_text(
        f"before\n{document.BEGIN}old\n<!-- end of the figures, sha256 -->\nafter\n", encoding="utf-8"
    )
    document.write_docs([ROWS["none"]], "a machine; 0.10 %.", page=page)
    before, figures, after, kept = document.figures_of(page.read_text(encoding="utf-8"))
    assert (before, after) == (f"before\n{document.BEGIN}", "after\n")
    assert figures.startswith("\na machine; 0.10 %.\n\n| what")
    assert kept == document.checksum(figures)
    with pytest.raises(ValueError, match="expected the lines"):
        document.figures_of("no place")
    with pytest.raises(SystemExit):
        run.main(["--write-docs", "--only", "swap"])
    assert "leave out --only" in capsys.readouterr().err
