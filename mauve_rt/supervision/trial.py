"""Rules tried on a script, in virtual time: what they decide, as a story and as a timeline. Knows no ROS."""

import heapq
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import count

from mauve_rt.control.requests import Request
from mauve_rt.supervision.condition_tree import TreeCondition
from mauve_rt.supervision.conditions import TopicCondition, topic_condition
from mauve_rt.supervision.engine import CHECK_PERIOD_S, Decision, RuleEngine, Standing
from mauve_rt.supervision.pretended_executor import PretendedExecutor
from mauve_rt.supervision.rules import Rule
from mauve_rt.supervision.script import Script
from mauve_rt.supervision.when import When

COLUMNS = 60
_SIGNS: dict[Standing, str] = {"not armed": " ", "false": ".", "true": "?", "in effect": "#"}
LEGEND = "topics: - heard   rules: . false   ? true, not acted on   # in effect"


@dataclass(frozen=True)
class Told:
    """A decision and when it was made, s from the start."""

    at_s: float
    decision: Decision


class Trial:
    """One run of a script. The story and the timeline are known when it is made."""

    def __init__(self, rules: Sequence[Rule], script: Script) -> None:
        self.story: list[Told] = []
        self._script = script
        self._names = [rule.name for rule in rules]
        self._now_s = 0.0
        self._heard: dict[str, list[TopicCondition]] = {}
        self._topic_rows: dict[str, list[str]] = {}
        self._rule_rows = {name: [" "] * COLUMNS for name in self._names}
        self._executor = PretendedExecutor(rules)
        self._wanted: list[Request] = []
        self._engine = RuleEngine(
            [(rule, TreeCondition(rule.when, self._condition)) for rule in rules],
            act=self._wanted.append,
            decide=lambda decision: self.story.append(Told(self._now_s, decision)),
            look=lambda: self._engine.on_inventory(self._now_s, self._executor.inventory()),
            ids=map(str, count(1)),
        )
        self._run()

    def timeline(self) -> Iterator[str]:
        """A row for each topic and each rule, over the script's time."""
        rows = {**self._topic_rows, **self._rule_rows}
        width = max(map(len, rows))
        end = f"{self._script.lasts_s:g} s"
        yield f"{'':{width}}  0{end:>{COLUMNS - 1}}"
        for name, row in rows.items():
            yield f"{name:{width}} |{''.join(row)}|"

    def _condition(self, leaf: When) -> TopicCondition:
        topic = leaf.parameters["topic"]
        condition = topic_condition(leaf, topic)
        self._heard.setdefault(topic, []).append(condition)
        self._topic_rows.setdefault(topic, [" "] * COLUMNS)
        return condition

    def _run(self) -> None:
        self._engine.on_state(0.0, self._executor.view())
        samples = self._samples()
        sample = next(samples, None)
        for number in range(int(self._script.lasts_s / CHECK_PERIOD_S + 1e-6) + 1):
            look_s = number * CHECK_PERIOD_S
            while sample is not None and sample[0] <= look_s:
                self._hear(*sample)
                sample = next(samples, None)
            self._now_s = look_s
            self._engine.tick(look_s)
            self._answer()
            for name, standing in self._engine.standing().items():
                self._rule_rows[name][self._column()] = _SIGNS[standing]

    def _samples(self) -> Iterator[tuple[float, str, float]]:
        """Instants, topics and values, in the order of time."""
        end_s = self._script.lasts_s
        each = (
            [(at_s, one.topic, one.value) for at_s in one.instants_s(end_s)] for one in self._script.heard
        )
        return heapq.merge(*each)

    def _hear(self, at_s: float, topic: str, value: float) -> None:
        self._now_s = at_s
        for condition in self._heard[topic]:
            condition.hear(at_s, value)
        self._topic_rows[topic][self._column()] = "-"

    def _column(self) -> int:
        return min(int(self._now_s / self._script.lasts_s * COLUMNS), COLUMNS - 1)

    def _answer(self) -> None:
        """The executor's, to what was wanted: at once."""
        while self._wanted:
            request = self._wanted.pop(0)
            outcome = self._executor.handle(request)
            self._engine.on_outcome(self._now_s, request.request_id, outcome)
            if not request.dry_run:
                self._engine.on_state(self._now_s, self._executor.view())
