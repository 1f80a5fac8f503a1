"""Rules tried on a script, in virtual time: what they decide, as a story and as a timeline. Knows no ROS."""

import heapq
from collections.abc import Iterator, Sequence
from itertools import count

from mauve_rt.control.requests import Request
from mauve_rt.supervision.decisions import Decision
from mauve_rt.supervision.pretended_executor import PretendedExecutor
from mauve_rt.supervision.remote_rules import RemoteRules
from mauve_rt.supervision.rules import Rule
from mauve_rt.supervision.script import Heard, Script

COLUMNS = 60
LEGEND = "heard: -   rules: ~ unknown   . false   ? true, not acted on   # in effect"


class Trial:
    """One run of a script. The story and the timeline are known when it is made."""

    def __init__(self, rules: Sequence[Rule], script: Script) -> None:
        self.story: list[Decision] = []
        self._script = script
        self._end_ns = round(script.lasts_s * 1e9)
        self._now_ns = 0
        self._names = [rule.name for rule in rules]
        self._heard_rows = {one.of: [" "] * COLUMNS for one in script.heard}
        self._rule_rows = {name: [" "] * COLUMNS for name in self._names}
        self._drawn = 0  # columns of the rules
        self._executor = PretendedExecutor(rules)
        self._wanted: list[Request] = []
        self._rules = RemoteRules(
            rules,
            act=self._wanted.append,
            decide=self.story.append,
            look=lambda: self._rules.on_inventory(self._now_ns, self._executor.inventory()),
            ids=map(str, count(1)),
            hears_all=True,
        )
        self._run()

    def timeline(self) -> Iterator[str]:
        """A row for each thing that is heard and each rule, over the script's time."""
        rows = {**self._heard_rows, **self._rule_rows}
        width = max(map(len, rows))
        end = f"{self._script.lasts_s:g} s"
        yield f"{'':{width}}  0{end:>{COLUMNS - 1}}"
        for name, row in rows.items():
            yield f"{name:{width}} |{''.join(row)}|"

    def _run(self) -> None:
        self._rules.on_state(0, self._executor.view())
        due_ns = self._tick()
        for at_ns, one, value in self._samples():
            while due_ns < at_ns:
                due_ns = self._tick(due_ns)
            self._move(at_ns)
            self._hear(one, value)
            if self._rules.is_stirred:
                due_ns = self._tick()
        while due_ns <= self._end_ns:
            due_ns = self._tick(due_ns)
        self._move(self._end_ns)
        self._draw(COLUMNS)

    def _samples(self) -> Iterator[tuple[int, Heard, float]]:
        """Instants, what is heard, values, in the order of time."""
        each = (self._samples_of(number) for number in range(len(self._script.heard)))
        for at_ns, number, value in heapq.merge(*each):
            yield at_ns, self._script.heard[number], value

    def _samples_of(self, number: int) -> Iterator[tuple[int, int, float]]:
        for at_s, value in self._script.heard[number].samples(self._script.lasts_s):
            yield round(at_s * 1e9), number, value

    def _hear(self, one: Heard, value: float) -> None:
        for number, signal in enumerate(self._rules.signals):
            if one.tells(signal):
                self._rules.hear(number, self._now_ns, value)
        self._heard_rows[one.of][self._column()] = "-"

    def _tick(self, at_ns: int = 0) -> int:
        """Let the rules look, now or at an instant to come; when they have to look again."""
        self._move(max(at_ns, self._now_ns))
        due_ns = self._rules.tick(self._now_ns)
        while self._wanted:
            request = self._wanted.pop(0)
            outcome = self._executor.handle(request)
            self._rules.on_outcome(self._now_ns, request.request_id, outcome)
            if not request.dry_run:
                self._rules.on_state(self._now_ns, self._executor.view())
            due_ns = self._rules.tick(self._now_ns)
        for name, row in self._rule_rows.items():
            row[self._column()] = self._sign(name)
        return due_ns

    def _move(self, now_ns: int) -> None:
        """Time goes on; until then the rules stand as they do."""
        self._now_ns = now_ns
        self._draw(self._column())

    def _draw(self, columns: int) -> None:
        for name, row in self._rule_rows.items():
            for column in range(self._drawn, columns):
                row[column] = self._sign(name)
        self._drawn = max(self._drawn, columns)

    def _sign(self, name: str) -> str:
        status = self._rules.status(self._names.index(name))
        if status.in_effect:
            return "#" if self._executor.follows(name) else "?"
        if not status.armed:
            return " "
        if not status.known:
            return "~"
        return "?" if status.holds else "."

    def _column(self) -> int:
        return min(int(self._now_ns / self._end_ns * COLUMNS), COLUMNS - 1)
