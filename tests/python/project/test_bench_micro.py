"""Rows of nanoseconds on machines that lack something: a second CPU, or the library of the reference."""

import sys
from pathlib import Path
from typing import Any

import pytest

sys.path.append(str(Path(__file__).parents[3] / "benchmarks"))  # at the end: it hides nothing

import micro
import native
from settings import QUICK

_RING = {
    f"{path}{readers}_{size}_ps": [2000, 3000, 4000]
    for path in ("stream", "echo")
    for readers in ("", "_two")
    for size in ("16", "4096")
}
_BOOST = {f"boost_{path}_{size}_ps": [2000] for path in ("stream", "echo") for size in ("16", "4096")}
_COUNTS = {"elements": 10, "wrong": 0}


def _with(monkeypatch: pytest.MonkeyPatch, found: dict[str, Any], cpus: set[int]) -> None:
    monkeypatch.setattr(native, "run", lambda _program, **_options: found)
    monkeypatch.setattr(micro.os, "sched_getaffinity", lambda _process: cpus)


def test_a_ring_stands_beside_boost(monkeypatch: pytest.MonkeyPatch):
    _with(monkeypatch, _RING | _BOOST | _COUNTS, {0, 1})
    rows = list(micro.ring_buffer_rows(QUICK))
    assert [row.ratio for row in rows] == [1.5, None] * 4 + [None]
    assert [row.target for row in rows if row.ratio] == ["ratio <= 2"] * 2 + ["-"] * 2
    assert rows[-1].verdict == "met"


def test_a_ring_without_boost_is_measured_alone(monkeypatch: pytest.MonkeyPatch):
    _with(monkeypatch, _RING | _COUNTS, {0, 1})
    rows = list(micro.ring_buffer_rows(QUICK))
    missing = [row for row in rows if row.verdict == "not available"]
    assert {row.note for row in missing} == {"boost/lockfree is not installed"}
    assert len(missing) == 4
    assert [row.measured for row in rows if row.unit] == [3.0] * 8


def test_one_cpu_yields_no_ring_rows(monkeypatch: pytest.MonkeyPatch):
    _with(monkeypatch, {}, {0})
    assert {row.note for row in micro.ring_buffer_rows(QUICK)} == {"this machine has one CPU"}


def test_one_cpu_yields_shared_data_alone(monkeypatch: pytest.MonkeyPatch):
    names = [
        f"{side}{verb}_{size}" for side in ("", "bare_") for verb in ("read", "write") for size in (16, 4096)
    ]
    copies = ("copy", "bare_copy", "in_place", "bare_in_place")
    _with(monkeypatch, {f"{name}_ps": [2000] for name in (*names, *copies)}, {0})
    rows = list(micro.shared_data_rows(QUICK))
    verdicts = [row.verdict for row in rows]
    assert verdicts == ["met"] * 4 + ["not available"] * 4 + ["reported", "met"]


def test_the_limit_of_a_latest_values_write_comes_from_the_same_run(monkeypatch: pytest.MonkeyPatch):
    found = {"write_ps": [9000], "seqlock_write_ps": [2000], "alone_ps": [2000], "seqlock_alone_ps": [2000]}
    _with(monkeypatch, found, {0})
    first = next(micro.latest_value_rows(QUICK))
    assert (first.target, first.verdict) == ("<= 8 ns", "missed")


def test_a_lookup_has_a_limit_for_each_hop(monkeypatch: pytest.MonkeyPatch):
    found = {f"{side}_{hops}_ps": [1_500_000] for side in ("lookup", "map") for hops in (1, 10)}
    _with(monkeypatch, found | {"failed": 0}, {0})
    rows = list(micro.transform_lookup_rows(QUICK))
    assert [row.verdict for row in rows] == ["missed", "met", "met"]
    assert [row.ratio for row in rows] == [1, 1, None]


def test_a_shadow_costs_what_it_adds(monkeypatch: pytest.MonkeyPatch):
    calls = {"read": 2, "write": 10, "tapped_read": 14, "tapped_write": 20, "watched_write": 21}
    calls |= {"limited_write": 30, "capture": 7}
    times_us = {"plain": 8, "shadowed": 11, "awaiting": 10, "waking": 12, "probation": 9, "blended": 10}
    times_us |= {"neighbour_plain": 5, "neighbour_awaiting": 6, "blackout": 20, "bumpless_blackout": 30}
    found = {f"{name}_ps": [1000 * each] for name, each in calls.items()}
    found |= {f"{name}_ns": [1000 * each] for name, each in times_us.items()}
    _with(monkeypatch, found | {"releases": 60, "compared": 59}, {0})
    rows = list(micro.shadow_rows(QUICK))
    assert [row.ratio for row in rows] == [
        *(7, 2, 2.1, 3, None, None, 11 / 8, 10 / 8, 12 / 8, 9 / 8, 10 / 8),
        *(6 / 5, 30 / 20) * 2,
    ]
    (added,) = [row for row in rows if row.target != "-"]
    assert (added.measured, added.unit, added.verdict) == (3, "us", "met")
    assert added.note.endswith("the shadow executed 590 of 600 releases")
