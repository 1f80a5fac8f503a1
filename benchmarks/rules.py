"""How soon a rule of an executor acts on silence, while the machine is busy and nobody supervises."""

import os
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import native
import stress
from busy_executor import BusyExecutor
from native import BenchmarkError
from ratios import percentile
from rows import Row, compared, exactly_zero, never_over, not_available, pooled
from settings import Settings

from mauve_rt.supervision.rule_bounds import bound_of
from mauve_rt.supervision.rules import RulesFile

_WHAT = "from the deadline of an input's silence to the first release of the safe core at 1 kHz"
_LOAD = "stress-ng, rclpy busy, supervisor killed"
_HUNG = "the same beside a lower rule whose component hangs"
_BESIDE = "a thread that sets a flag at the deadline, a 1 kHz loop that reads it"
_NS_PER_US, _NS_PER_MS, _NS_PER_S = 1_000, 1_000_000, 1_000_000_000
_PERIOD_S, _SILENCE_S = 0.001, 0.010
_LIMIT_NS = round(_PERIOD_S * _NS_PER_S) + _NS_PER_MS
_RULES = f"""\
mauve: 1
rules:
  - name: quiet
    when: {{silence: {{resource: input, longer_than_s: {_SILENCE_S}}}}}
    do: [{{kind: replace_core, target: worker, name: bench/SafeWorker}}]
    undo: {{do: [{{kind: replace_core, target: worker, name: bench/Worker}}]}}
"""


def rule_rows(settings: Settings) -> Iterator[Row]:
    """Rounds of a rule beside the components of its process, and of two bare threads."""
    yield _beside_hung(settings)
    what = f"{_WHAT}, {_LOAD}"
    if missing := stress.available():
        yield not_available(what, missing)
        return
    with BusyExecutor() as executor:
        executor.lose_supervisor()
        executor.stop()  # its component has the same priority
        with stress.stressed():
            rounds = native.both(
                "bench_rules",
                settings.rounds,
                count=settings.reactions,
                priority=settings.priority,
                cpu=settings.cpu,
                cpus=len(os.sched_getaffinity(0)),
                silence_ms=round(_SILENCE_S * 1e3),
            )
        executor.finish()
    note = f"{stress.DESCRIPTION}; {executor.load_report}, in another executor, whose supervisor was killed"
    for percent in (50, 99):
        pairs = [(_us(component, percent), _us(bare, percent)) for component, bare in rounds]
        yield compared(f"{what}, p{percent}", pairs, unit="us", beside=_BESIDE, note=note)
    ours, bare = ([ns / _NS_PER_US for one in rounds for ns in one[who]["reaction_ns"]] for who in (0, 1))
    yield pooled(f"{what}, p99.9", ours, 99.9, unit="us", reference=bare, beside=_BESIDE)
    yield from _bounds(what, [component for component, _ in rounds])


def _beside_hung(settings: Settings) -> Row:
    """Whether a rule waits for one whose target does not come to a wait; on a machine at rest."""

    def side(hung: int) -> Callable[[int], dict[str, Any]]:
        return lambda number: native.run(
            "bench_rules",
            who="component",
            hung=hung,
            seed=number,
            count=settings.reactions,
            priority=settings.priority,
            cpu=settings.cpu,
            cpus=len(os.sched_getaffinity(0)),
            silence_ms=round(_SILENCE_S * 1e3),
        )

    rounds = native.interleaved(settings.rounds, side(1), side(0))
    pairs = [(_us(hung, 50), _us(alone, 50)) for hung, alone in rounds]
    worst_ms = max(max(_own_ns(hung)) for hung, _ in rounds) / _NS_PER_MS
    return compared(
        f"{_WHAT}, {_HUNG}",
        pairs,
        unit="us",
        beside="the same without that rule",
        ratio_limit=1.2,
        note=f"p50; worst beside it {worst_ms:.2f} ms, stalls of the machine left out",
    )


def _bounds(what: str, found: list[dict[str, Any]]) -> Iterator[Row]:
    """What a reaction may exceed only by as long as the machine stood still."""
    own = [_own_ns(one) for one in found]
    late = [sum(ns > _LIMIT_NS for ns in one) for one in own]
    reactions = [ns for one in found for ns in one["reaction_ns"]]
    within = sum(ns <= _LIMIT_NS for ns in reactions)
    stalled = len(reactions) - within - sum(late)
    note = f"{within} of {len(reactions)} were within; {stalled} more but for stalls of the machine that "
    note += "witnesses marked"
    yield exactly_zero(f"{what}, later than 1 period + 1 ms", late, note=note)
    yield never_over(
        "from the last write to that release, worst",
        [_SILENCE_S * 1e3 + max(one) / _NS_PER_MS for one in own],
        limit=_bound_s() * 1e3,
        unit="ms",
        note="at most what `mauve rules check` prints for the rule; stalls of the machine left out",
    )


def _own_ns(found: dict[str, Any]) -> list[int]:
    """Reactions without the time for which the machine stood still."""
    return [took - stalled for took, stalled in zip(found["reaction_ns"], found["stalled_ns"], strict=True)]


def _us(found: dict[str, Any], percent: float) -> float:
    return percentile(found["reaction_ns"], percent) / _NS_PER_US


def _bound_s() -> float:
    """The bound that is printed for the rule, from the last write on."""
    with tempfile.TemporaryDirectory(prefix="mauve_bench_") as folder:
        path = Path(folder) / "rules.yaml"
        path.write_text(_RULES, encoding="utf-8")
        rule = RulesFile(path).rules.rules[0]
    bound_s = bound_of(rule, {"worker": _PERIOD_S}).total_s
    if bound_s is None:
        raise BenchmarkError("no bound is known of the rule")
    return bound_s
