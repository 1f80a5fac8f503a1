"""How log lines of parts become lines for people: whose they are, bundled, and what was lost."""

from types import SimpleNamespace
from typing import Any

from mauve_rt.control.part_log import LogBundles

S = 1_000_000_000


def entry(time_ns: int, text: str = "late", **fields: Any) -> Any:
    told = {"component": "drive", "source": "", "state": "Follow", "format": "late {}", **fields}
    return SimpleNamespace(time_ns=time_ns, level="warn", text=text, function="", file="", line=0, **told)


def look(*entries: Any, lost: tuple[tuple[str, int], ...] = ()) -> Any:
    return SimpleNamespace(lines=list(entries), lost=list(lost))


def texts(lines: list[Any]) -> list[str]:
    return [f"{line.part}: {line.text}" for line in lines]


def test_a_line_says_whose_it_is_and_in_which_state():
    entries = look(
        entry(1),
        entry(2, source="scan"),
        entry(3, source="shadow", state=""),
        entry(4, component="", source="scan", state=""),
    )
    assert texts(LogBundles().take([entries], now_ns=5)) == [
        "drive: Follow: late",
        "scan: drive.Follow: late",
        "drive: shadow: late",
        "scan: late",
    ]


def test_more_than_ten_of_a_kind_in_a_second_are_bundled_with_their_count():
    bundles = LogBundles()
    first = bundles.take([look(*(entry(n, f"late {n}") for n in range(100)))], now_ns=100)
    assert texts(first) == [f"drive: Follow: late {n}" for n in range(10)]
    others = [entry(100, "other", format="other"), entry(101, component="arm")]
    assert texts(bundles.take([look(*others)], now_ns=200)) == [
        "drive: Follow: other",
        "arm: Follow: late",
    ], "of its own format and its own component each"
    assert bundles.take([look(entry(S // 2, "late 500"))], now_ns=S - 1) == []
    (rest,) = bundles.take([], now_ns=S)
    assert rest.text == "Follow: late 500 [the last of 91 more lines within a second]"
    assert rest.time_ns == S // 2
    assert bundles.take([], now_ns=9 * S) == []


def test_a_second_begins_with_its_first_line():
    bundles = LogBundles()
    lines = bundles.take([look(*(entry(n * S // 20) for n in range(60)))], now_ns=3 * S)
    shown = [line for line in lines if "more" not in line.text]
    assert len(shown) == 30, "ten in each of three seconds"
    assert [line.text for line in lines if "more" in line.text] == [
        "Follow: late [the last of 10 more lines within a second]"
    ] * 3


def test_the_last_look_shows_what_was_withheld_and_lost_lines_are_counted():
    bundles = LogBundles()
    bundles.take([look(*(entry(n) for n in range(11)))], now_ns=20)
    lines = bundles.take([look(lost=(("drive", 7), ("", 1)))], now_ns=30, last=True)
    assert texts(lines) == [
        "drive: 7 log lines lost: they came faster than they were written",
        ": 1 log line lost: they came faster than they were written",
        "drive: Follow: late [the last of 1 more line within a second]",
    ]
