"""Rules tried on a script, in virtual time: what they decide, as a story and as a timeline. Knows no ROS."""

import heapq
from collections.abc import Iterator
from dataclasses import replace

from mauve_rt._kernel import Simulation
from mauve_rt.control.simulated_runtime import SimulatedRuntime
from mauve_rt.errors import ArchitectureFileError
from mauve_rt.model import ArchitectureModel
from mauve_rt.supervision.decisions import Decision
from mauve_rt.supervision.rehearsed_rules import RehearsedRules
from mauve_rt.supervision.rule_hearing import only_outside
from mauve_rt.supervision.rules import RulesFile
from mauve_rt.supervision.script import Heard, Script
from mauve_rt.supervision.stand_ins import StandInRuntime

COLUMNS = 60
LEGEND = "heard: -   rules: ~ unknown   . false   ? true, not acted on   # in effect"


class Trial:
    """One run of a script. The story and the timeline are known when it is made."""

    def __init__(self, file: RulesFile, script: Script, model: ArchitectureModel | None = None) -> None:
        """`model`: of the executor; without one it has stand-ins for what the rules name.

        Raises:
            ArchitectureFileError: the executor cannot be built, or would refuse the file.
            MauveError: the executor would refuse the rules.
        """
        if problems := list(only_outside(file)):
            raise ArchitectureFileError(file.path, problems)
        self.story: list[Decision] = []
        self._script = script
        self._end_ns = round(script.lasts_s * 1e9)
        self._heard_rows = {one.of: [" "] * COLUMNS for one in script.heard}
        self._rule_rows = {rule.name: [" "] * COLUMNS for rule in file.rules.rules}
        self._signs: dict[str, str] = {}  # how the rules stand ...
        self._drawn = 0  # ... since they looked that many times
        self._simulation = Simulation(trace=False)
        try:
            if model is None:
                runtime: SimulatedRuntime = StandInRuntime(self._simulation, file)
            else:
                runtime = SimulatedRuntime(self._simulation, lambda: model)
            runtime.configure()
            runtime.activate()
            self._begin_ns = self._simulation.now_ns()
            self._rules = RehearsedRules(self._simulation, runtime, file, self._note)
            self._run()
        finally:
            self._simulation.shutdown()

    def timeline(self) -> Iterator[str]:
        """A row for each thing that is heard and each rule, over the script's time."""
        rows = {**self._heard_rows, **self._rule_rows}
        width = max(map(len, rows))
        end = f"{self._script.lasts_s:g} s"
        yield f"{'':{width}}  0{end:>{COLUMNS - 1}}"
        for name, row in rows.items():
            yield f"{name:{width}} |{''.join(row)}|"

    def _note(self, decision: Decision) -> None:
        self.story.append(replace(decision, time_ns=decision.time_ns - self._begin_ns))

    def _run(self) -> None:
        self._look()
        for at_ns, one, value in self._samples():
            self._pass_until(at_ns)
            for number, signal in enumerate(self._rules.signals):
                if one.tells(signal):
                    self._rules.tell(number, one.value_for(signal, value))
            self._heard_rows[one.of][self._column()] = "-"
            self._look()
        self._pass_until(self._end_ns)
        self._look()

    def _samples(self) -> Iterator[tuple[int, Heard, float]]:
        """Instants, what is heard, values, in the order of time."""
        each = (self._samples_of(number) for number in range(len(self._script.heard)))
        for at_ns, number, value in heapq.merge(*each):
            yield at_ns, self._script.heard[number], value

    def _samples_of(self, number: int) -> Iterator[tuple[int, int, float]]:
        for at_s, value in self._script.heard[number].samples(self._script.lasts_s):
            yield round(at_s * 1e9), number, value

    def _pass_until(self, at_ns: int) -> None:
        """Time goes on, and each column shows how the rules stand at its end; at the instant not yet."""
        while self._now_ns < at_ns:
            column_end_ns = (self._column() + 1) * self._end_ns // COLUMNS - 1
            until_ns = min(at_ns, max(column_end_ns, self._now_ns + 1))
            self._rules.run_until(self._begin_ns + until_ns)
            if until_ns < at_ns:
                self._look()

    def _look(self) -> None:
        self._rules.look()
        if self._rules.looks != self._drawn:
            self._drawn = self._rules.looks
            self._signs = {name: self._sign_of(name) for name in self._rule_rows}
        for name, sign in self._signs.items():
            self._rule_rows[name][self._column()] = sign

    def _sign_of(self, name: str) -> str:
        status = self._rules.status(name)
        if status.in_effect:
            return "#" if self._rules.is_so(name) else "?"
        if not status.armed:
            return " "
        if not status.known:
            return "~"
        return "?" if status.holds else "."

    @property
    def _now_ns(self) -> int:
        return self._simulation.now_ns() - self._begin_ns

    def _column(self) -> int:
        return min(int(self._now_ns / self._end_ns * COLUMNS), COLUMNS - 1)
