"""The script of `mauve rules try`: what happens when.

    mauve: 1
    lasts_s: 20
    heard:
      - {topic: radio/in, every_s: 0.1, until_s: 5.0}    # from the start on
      - {topic: radio/in, every_s: 0.1, from_s: 12.0}    # to the end

Topics are named as in the rules; `value` is that of the field at which a condition looks.
What is not said does not happen.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Literal

from mauve_rt.errors import ArchitectureFileError
from mauve_rt.model.kinds import Choice, Faults, ListOf, Real
from mauve_rt.model.schema import ROS_NAME
from mauve_rt.model.section import Part, Section, setting
from mauve_rt.model.steps import form_error
from mauve_rt.model.words import did_you_mean
from mauve_rt.model.yaml_file import YamlFile
from mauve_rt.supervision.rules import Rule

LONGEST_S = 3600.0
SHORTEST_PERIOD_S = 0.001


class Heard(Section):
    """Samples on a topic, at equal distances. `value`: of the field at which a condition looks."""

    topic: str = setting(ROS_NAME)
    value: float = setting(Real(), default=0.0)
    every_s: float = setting(Real(least=SHORTEST_PERIOD_S))
    from_s: float = setting(Real(least=0, most=LONGEST_S), default=0.0)
    until_s: float = setting(Real(least=0, most=LONGEST_S), default=LONGEST_S)

    def instants_s(self, end_s: float) -> Iterator[float]:
        """When there is one, up to and with `end_s`."""
        number = 0
        while (at_s := self.from_s + number * self.every_s) <= min(self.until_s, end_s):
            yield at_s
            number += 1


class Script(Section):
    """A whole script."""

    mauve: Literal[1] = setting(Choice(1))
    lasts_s: float = setting(Real(above=0, most=LONGEST_S))
    heard: list[Heard] = setting(ListOf(Part(Heard)), default=[])


def load_script(path: Path, rules: Sequence[Rule]) -> Script:
    """A checked script for these rules.

    Raises:
        ArchitectureFileError: it cannot be read, is no YAML, breaks the schema or names a topic of no rule.
    """
    file = YamlFile(path)
    faults: Faults = []
    script = Script.read(file.data, (), faults)
    if faults:
        raise form_error(file, faults)
    known = sorted({leaf.parameters["topic"] for rule in rules for leaf in rule.when.leaves()})
    problems = [
        file.problem(
            ("heard", index, "topic"),
            f"no rule listens to topic {heard.topic}",
            remedy=did_you_mean(heard.topic, known),
        )
        for index, heard in enumerate(script.heard)
        if heard.topic not in known
    ]
    if problems:
        raise ArchitectureFileError(path, problems)
    return script
