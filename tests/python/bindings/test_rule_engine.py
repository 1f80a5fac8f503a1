"""The engine of rules as Python drives it: in virtual time, in the supervisor, in tools."""

import threading

import pytest

from mauve_rt._kernel import MauveError, RuleEngine, RuleSpec, WhenSpec, condition_kinds, monotonic_ns

MS = 1_000_000


def _silence(longer_than_s: float = 1.0) -> WhenSpec:
    return WhenSpec("silence", parameters={"topic": "radio/in", "longer_than_s": longer_than_s})


def _taken(engine: RuleEngine) -> list[tuple[int, str, str]]:
    return [(d.stamp_ns, d.decision, d.why) for d in iter(engine.take, None)]


def test_the_table_says_what_each_condition_may_be_told() -> None:
    """Every kind has a summary and parameters; those that need not be told have a value, or stay untold."""
    kinds = {kind.name: kind for kind in condition_kinds()}
    assert {"silence", "value", "late", "no_release", "fault", "peer", "since_change"} <= set(kinds)
    assert all(kind.summary and kind.parameters for kind in kinds.values())
    limit = next(each for each in kinds["silence"].parameters if each.name == "longer_than_s")
    assert (limit.type, limit.unit, limit.required, limit.initial) == ("float", "s", True, None)


def test_a_rule_does_and_undoes() -> None:
    """As the caller tells and steps it, with each decision and its instant."""
    rule = RuleSpec("link", _silence(), undoes=True, undo_for_ns=300 * MS, about=["exploration"])
    engine = RuleEngine([rule])
    (signal,) = engine.signals
    assert (signal.kind, signal.target) == ("message", "radio/in")
    engine.arm(0)
    due = engine.step(0)
    while due < 1000 * MS:  # it looks before that, to see that it does not stand still itself
        assert due >= 945 * MS
        due = engine.step(due)
        assert engine.pending is None
    due = engine.step(due) if due == 1000 * MS else due
    assert due == 1000 * MS + 1
    engine.step(due)
    assert engine.pending is not None
    assert (engine.pending.act, engine.pending.cause_ns) == ("do", 1000 * MS)
    engine.begun(due)
    engine.ended(0, "do", "done", due)
    engine.tell(0, 1500 * MS)
    assert engine.step(1500 * MS) == 1800 * MS
    status = engine.status(0)
    assert (status.holds, status.in_effect, status.next, status.next_ns) == (False, True, "undo", 1800 * MS)
    engine.step(1800 * MS)
    assert engine.pending is not None
    assert engine.pending.act == "undo"
    assert [word for _, word, _ in _taken(engine)] == [
        "armed",
        "condition_true",
        "do",
        "done",
        "condition_false",
    ]


def test_what_cannot_be_so_is_refused() -> None:
    """A kind, a parameter, an act, a rule and a signal that there is not."""
    with pytest.raises(MauveError, match="silence") as error:
        RuleEngine([RuleSpec("r", WhenSpec("silense"))])
    assert "rule r" in str(error.value)
    engine = RuleEngine([RuleSpec("r", _silence())])
    with pytest.raises(MauveError, match="do, undo or otherwise"):
        engine.set_ready(0, "redo", ready=True)
    with pytest.raises(MauveError, match="stale"):
        engine.ended(0, "do", "well", 0)
    with pytest.raises(IndexError, match="1 rules"):
        engine.status(1)
    with pytest.raises(IndexError, match="1 signals"):
        engine.tell(7, 0)


def test_who_waits_is_woken_by_what_is_of_interest() -> None:
    """A message while it is silent ends the wait; one while it is not is slept through."""
    engine = RuleEngine([RuleSpec("r", _silence(0.001))])
    begin = monotonic_ns()
    engine.arm(begin)
    engine.step(begin)
    engine.tell(0, begin)
    quiet = engine.word()
    engine.tell(0, begin + 1)
    assert engine.word() == quiet
    assert not engine.wait(quiet, monotonic_ns() + MS)
    engine.step(begin + 10 * MS)
    word = engine.word()
    teller = threading.Timer(0.01, lambda: engine.tell(0, begin + 11 * MS))
    teller.start()
    assert engine.wait(word, monotonic_ns() + 60_000 * MS)
    teller.join()
    engine.step(begin + 11 * MS)
    assert not engine.status(0).holds
