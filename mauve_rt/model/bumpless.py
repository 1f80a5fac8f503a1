"""A bumpless change of a core, as requests and steps give it: the outputs, and their greatest steps.

{kind: replace_core, target: control, name: my_robot/Pid2,
 value: {bumpless: {outputs: {command.torque: 0.5}, within_s: 2, blend_s: 0.5}}}
"""

from collections.abc import Mapping
from dataclasses import dataclass

from mauve_rt._kernel import BumplessOptions, GreatestStep
from mauve_rt.file_schema.words import did_you_mean, shown
from mauve_rt.model.probation import is_number

MAX_WITHIN_S = 3_600.0
MAX_OUTPUTS = 100
MAX_BUDGET_US = 1e9
MAX_BLEND_S = 60.0
_KEYS = ("outputs", "within_s", "budget_us", "blend_s")


@dataclass(frozen=True, kw_only=True)
class Bumpless:
    """A bumpless change as asked for."""

    outputs: Mapping[str, float]  # "PORT.FIELD": greatest step, in the unit of the number
    within_s: float = 2.0
    budget_us: float = 0.0  # of the candidate for one release; 0: the component's period
    blend_s: float = 0.0  # so long the outputs go over from the old core's to the new one's; 0: at once

    def options(self) -> BumplessOptions:
        """What the kernel takes."""
        outputs = [
            GreatestStep(*output.partition(".")[::2], step=float(step))
            for output, step in self.outputs.items()
        ]
        return BumplessOptions(
            outputs,
            within_ns=round(self.within_s * 1e9),
            budget_ns=round(self.budget_us * 1e3),
            blend_ns=round(self.blend_s * 1e9),
        )


def read_bumpless(value: object) -> Bumpless:
    """What stands below `bumpless` in a value of a step.

    Raises:
        ValueError: it is none; in words.
    """
    if not isinstance(value, dict):
        raise ValueError(f"bumpless: expected outputs and within_s, found {shown(str(value))}")  # noqa: TRY004
    for key in value:
        if key not in _KEYS:
            raise ValueError(f"bumpless: unknown key {shown(str(key))}; {did_you_mean(str(key), _KEYS)}")
    outputs = value.get("outputs")
    if not isinstance(outputs, dict) or not 0 < len(outputs) <= MAX_OUTPUTS:
        raise ValueError(
            f"bumpless: outputs: expected {{PORT.FIELD: greatest step}}, 1 to {MAX_OUTPUTS} outputs"
        )
    for output, step in outputs.items():
        if not isinstance(output, str) or not is_number(step) or step < 0:
            raise ValueError(
                f"bumpless: outputs: {shown(str(output))}: expected a greatest step >= 0, found {step}"
            )
    within = value.get("within_s", Bumpless.within_s)
    if not is_number(within) or not 0 < within <= MAX_WITHIN_S:
        raise ValueError(f"bumpless: within_s: expected more than 0 to {MAX_WITHIN_S:g} s, found {within}")
    times = {}
    for key, unit, most in (("budget_us", "us", MAX_BUDGET_US), ("blend_s", "s", MAX_BLEND_S)):
        time = value.get(key, 0.0)
        if not is_number(time) or not 0 <= time <= most:
            raise ValueError(f"bumpless: {key}: expected 0 to {most:g} {unit}, found {time}")
        times[key] = float(time)
    return Bumpless(outputs=outputs, within_s=float(within), **times)
