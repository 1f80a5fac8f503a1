"""The script of `mauve rules try`: what happens when.

    mauve: 1
    lasts_s: 20
    heard:
      - {topic: radio/in, every_s: 0.1, until_s: 5.0}    # from the start on
      - {topic: radio/in, every_s: 0.1, from_s: 12.0}    # to the end
      - {state: control, is: FAULTED, from_s: 7.0}       # once

Each line tells of one thing: messages of a topic, named as in the rules; writes to a resource; overruns,
late wake-ups or responses, executions longer than declared, releases, the state or changes of a component
(changes of '': of the architecture); the state of a peer; the level of a diagnostic; that the executor's
Python side works (node: ''); the state of a goal of an action's resource. `value` is that of the field at
which a condition looks; counts grow by one with each. What is not said does not happen.
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Literal

from mauve_rt._kernel import SignalSpec
from mauve_rt.errors import ArchitectureFileError, Problem
from mauve_rt.file_schema.kinds import Choice, Fault, Faults, ListOf, Real, Text
from mauve_rt.file_schema.section import Part, Section, setting
from mauve_rt.file_schema.words import did_you_mean, listed
from mauve_rt.file_schema.yaml_file import YamlFile
from mauve_rt.model.schema import ROS_NAME
from mauve_rt.model.steps import form_error
from mauve_rt.supervision.rules import Rule
from mauve_rt.supervision.view_signals import COMPONENT_STATES
from mauve_rt.supervision.when_spec import OF_TOPICS, heard

LONGEST_S = 3600.0
SHORTEST_PERIOD_S = 0.001
# What each line may be about: the signals of the engine that it tells.
_SIGNALS: Mapping[str, tuple[str, ...]] = {
    "topic": OF_TOPICS,
    "resource": ("write", "field"),
    "overruns": ("overruns",),
    "late": ("late",),
    "over_declared": ("over_declared",),
    "released": ("release",),
    "state": ("state",),
    "peer": ("peer",),
    "diagnostic": ("diagnostic",),
    "change": ("change",),
    "node": ("node",),
    "goal": ("goal",),
}
_COUNTED = ("overruns", "late", "over_declared")
# The words for values, with their numbers.
_WORDS: Mapping[str, Mapping[str, int]] = {
    "state": COMPONENT_STATES,
    "peer": {"unheard": 0, "there": 1, "another_instance": 2, "faulted": 3, "gone": 4},
    "diagnostic": {"OK": 0, "WARN": 1, "ERROR": 2, "STALE": 3},
    "goal": {"executing": 2, "succeeded": 4, "canceled": 5, "aborted": 6},
}
# Of a goal: the state in which each signal is 1, by its detail.
_GOALS: Mapping[str, str] = {"aborted": "aborted", "overdue": "executing"}


class Heard(Section):
    """One thing that happens, once or at equal distances."""

    topic: str | None = setting(ROS_NAME, "topic that receives a message", default=None)
    resource: str | None = setting(Text(), "resource that is written", default=None)
    overruns: str | None = setting(Text(), "component whose number of overruns grows", default=None)
    late: str | None = setting(
        Text(), "component whose number of late wake-ups or responses grows", default=None
    )
    over_declared: str | None = setting(
        Text(), "component whose number of executions over the declared time grows", default=None
    )
    released: str | None = setting(Text(), "component that is released", default=None)
    state: str | None = setting(Text(), "component that enters the state of `is`", default=None)
    peer: str | None = setting(Text(), "executor that enters the state of `is`", default=None)
    diagnostic: str | None = setting(
        Text(), "status of /diagnostics that has the level of `is`", default=None
    )
    change: str | None = setting(Text(), "component that is changed; empty: the architecture", default=None)
    node: str | None = setting(
        Text(), "that the Python side of the executor works; always empty", default=None
    )
    goal: str | None = setting(
        Text(), "resource of an action whose goal enters the state of `is`", default=None
    )
    word: str | None = setting(
        Choice(*dict.fromkeys(each for words in _WORDS.values() for each in words)),
        "state or level of a `state`, `peer`, `diagnostic` or `goal`",
        default=None,
        key="is",
    )
    value: float = setting(Real(), "value of the field that a condition reads", default=0.0)
    every_s: float | None = setting(
        Real(least=SHORTEST_PERIOD_S), "time between two repetitions; without the key once", default=None
    )  # absent: once
    from_s: float = setting(Real(least=0, most=LONGEST_S), "time of the first event", default=0.0)
    until_s: float = setting(Real(least=0, most=LONGEST_S), "time of the last event", default=LONGEST_S)

    def misfit(self) -> Fault | None:
        """It is about one thing, and has a word where that has words."""
        named = [name for name in _SIGNALS if getattr(self, name) is not None]
        if len(named) != 1:
            found = " and ".join(named) or "none of them"
            return Fault((), "form", limit=f"exactly one of {listed(_SIGNALS)}", found=found)
        words = tuple(_WORDS.get(named[0], ()))
        if words and self.word is None:
            return Fault((), "missing", limit="is")
        if words and self.word not in words:
            return Fault(("is",), "choice", limit=listed(words), found=self.word, known=words)
        if not words and self.word is not None:
            return Fault(("is",), "rule", limit=f"what is said of {named[0]} has no words", found=self.word)
        return None

    @property
    def what(self) -> str:
        """The key that names it."""
        return next(name for name in _SIGNALS if getattr(self, name) is not None)

    @property
    def of(self) -> str:
        """The name of what it is about."""
        return str(getattr(self, self.what))

    def tells(self, signal: SignalSpec) -> bool:
        """Whether a condition that listens to this hears it."""
        return signal.kind in _SIGNALS[self.what] and signal.target == self.of

    def value_for(self, signal: SignalSpec, value: float) -> float:
        """Return the value that this signal receives of a sample."""
        if self.goal is None:
            return value
        return float(self.word == _GOALS[signal.detail])

    def samples(self, end_s: float) -> Iterator[tuple[float, float]]:
        """When it happens, up to and with `end_s`, and the value that is told then."""
        number = 0
        while (at_s := self.from_s + number * (self.every_s or 0.0)) <= min(self.until_s, end_s):
            number += 1
            yield at_s, self._value_of(number)
            if self.every_s is None:
                return

    def _value_of(self, number: int) -> float:
        if self.word is not None:
            return float(_WORDS[self.what][self.word])
        if self.what in _COUNTED:
            return float(number)
        if self.what == "released":  # with it the component's period
            return self.every_s or self.value
        return self.value


class Script(Section):
    """A whole script."""

    mauve: Literal[1] = setting(Choice(1), "version of the schema")
    lasts_s: float = setting(Real(above=0, most=LONGEST_S), "virtual time that the script takes")
    heard: list[Heard] = setting(ListOf(Part(Heard)), "the events", default=[])


def load_script(path: Path, rules: Sequence[Rule]) -> Script:
    """A checked script for these rules.

    Raises:
        ArchitectureFileError: it cannot be read, is no YAML, breaks the schema or tells nobody anything.
    """
    file = YamlFile(path)
    faults: Faults = []
    script = Script.read(file.data, (), faults)
    if faults:
        raise form_error(file, faults)
    signals = [signal for rule in rules for leaf in rule.when.leaves() for signal in heard(leaf)]
    problems = [
        _unobservable(file, index, told, signals)
        for index, told in enumerate(script.heard)
        if not any(told.tells(signal) for signal in signals)
    ]
    if problems:
        raise ArchitectureFileError(path, problems)
    return script


def _unobservable(file: YamlFile, index: int, told: Heard, signals: Sequence[SignalSpec]) -> Problem:
    known = {signal.target for signal in signals if signal.kind in _SIGNALS[told.what]}
    what = f"no rule has a condition on {told.what} {told.of}"
    return file.problem(("heard", index, told.what), what, remedy=did_you_mean(told.of, known))
