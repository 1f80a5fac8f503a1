"""Probation of a new core, as requests and steps give it: how long, and what puts the old core back.

{kind: replace_core, target: control, name: my_robot/Pid2,
 value: {probation_s: 5, revert_on: [fault, nan, {output: command.linear.x, minimum: -1, maximum: 1}]}}

An output may be named with its component, too: control.command.linear.x.
"""

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

from mauve_rt._kernel import FieldShape, OutputLimit, PortDescription, ProbationOptions
from mauve_rt.file_schema.words import did_you_mean, shown

MAX_PROBATION_S = 86_400.0
MAX_VIOLATIONS = 50
VIOLATIONS: Mapping[str, str] = {
    "fault": "the core raises, or one of its states lasts longer than declared",
    "overrun": "the component enters a wait after its end",
    "over_declared": "a state lasts longer than declared (max_execution, or wcet_ns with enforce_wcet)",
    "nan": "a number of any output is NaN",
}
DEFAULT_VIOLATIONS = ("fault", "nan")
_KEYS = ("output", "minimum", "maximum")
_NOT_COUNTED = ("string", "wstring")


@dataclass(frozen=True, kw_only=True)
class Probation:
    """A probation as asked for."""

    duration_s: float
    revert_on: tuple[object, ...] = ()  # names of violations, and limits of outputs
    releases: int = 0  # that the verdict needs; 0: one

    def value(self) -> dict[str, object]:
        """As the value of a step."""
        value: dict[str, object] = {"probation_s": self.duration_s}
        if self.revert_on:
            value["revert_on"] = list(self.revert_on)
        if self.releases:
            value["releases"] = self.releases
        return value

    def options(self, component: str, ports: Collection[PortDescription]) -> ProbationOptions:
        """What the kernel takes, for a component with these ports. Limits of others are left out."""
        named = {each for each in self.revert_on or DEFAULT_VIOLATIONS if isinstance(each, str)}
        found = (_limit(each, component, ports) for each in self._limits())
        outputs = [limit for limit in found if limit is not None]
        if "nan" in named:
            outputs += [OutputLimit(port.name, not_nan=True) for port in ports if _has_numbers(port)]
        return ProbationOptions(
            round(self.duration_s * 1e9),
            on_fault="fault" in named,
            on_overrun="overrun" in named,
            on_over_declared="over_declared" in named,
            outputs=outputs,
            min_releases=max(self.releases, 1),
        )

    def require_outputs(self, components: Mapping[str, Collection[PortDescription]]) -> None:
        """Check that each limit is one of an output of these components, given with their ports.

        Raises:
            ValueError: one is not; in words.
        """
        for limit in self._limits():
            if any(_limit(limit, name, ports) is not None for name, ports in components.items()):
                continue
            outputs = [f"{name}.{each}" for name, ports in components.items() for each in _outputs(ports)]
            hint = did_you_mean(str(limit["output"]), outputs)
            given, names = shown(str(limit["output"])), ", ".join(components) or "a component"
            text = f"revert_on: {given} is no output of {names}"
            raise ValueError(f"{text}; expected PORT.FIELD or COMPONENT.PORT.FIELD; {hint}")

    def _limits(self) -> list[Mapping[str, object]]:
        return [each for each in self.revert_on if isinstance(each, dict)]


def read_probation(value: object) -> Probation:
    """The value of a step, or what a request says.

    Raises:
        ValueError: it is none; in words.
    """
    if not isinstance(value, dict):
        raise ValueError(f"expected probation_s and revert_on, found {shown(str(value))}")  # noqa: TRY004
    known = ("probation_s", "revert_on", "releases")
    for key in value:
        if key not in known:
            raise ValueError(f"unknown key {shown(str(key))}; {did_you_mean(str(key), known)}")
    duration, releases = value.get("probation_s", 0), value.get("releases", 0)
    if not is_number(duration) or not 0 < duration <= MAX_PROBATION_S:
        raise ValueError(f"probation_s: expected more than 0 to {MAX_PROBATION_S:g} s, found {duration}")
    if isinstance(releases, bool) or not isinstance(releases, int) or releases < 0:
        raise ValueError(f"releases: expected a count, found {releases}")
    violations = value.get("revert_on", [])
    if not isinstance(violations, list) or len(violations) > MAX_VIOLATIONS:
        raise ValueError(f"revert_on: expected a list of at most {MAX_VIOLATIONS} violations")
    return Probation(duration_s=float(duration), revert_on=tuple(_violations(violations)), releases=releases)


def _violations(given: Sequence[object]) -> Iterator[object]:
    for each in given:
        if isinstance(each, str) and each in VIOLATIONS:
            yield each
        elif isinstance(each, dict):
            _check_limit(each)
            yield each
        else:
            hint = did_you_mean(str(each), VIOLATIONS)
            raise ValueError(f"revert_on: unknown violation {shown(str(each))}; {hint}, or an output's limit")


def _check_limit(limit: Mapping[str, object]) -> None:
    for key in limit:
        if key not in _KEYS:
            text = f"revert_on: unknown key {shown(str(key))}; {did_you_mean(str(key), _KEYS)}"
            raise ValueError(f"{text}; for a condition write a rule with the step revert_core")
    if not isinstance(limit.get("output"), str) or not limit["output"]:
        raise ValueError(
            "revert_on: an output's limit needs the key output: PORT.FIELD or COMPONENT.PORT.FIELD"
        )
    bounds = [limit[key] for key in ("minimum", "maximum") if key in limit]
    if not all(is_number(bound) for bound in bounds):
        raise ValueError(f"revert_on: output {limit['output']}: expected numbers as minimum and maximum")


def is_number(value: object) -> bool:
    """Whether it is a finite number, of which YAML has truth values too."""
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _outputs(ports: Collection[PortDescription]) -> list[str]:
    return [port.name for port in ports if port.kind == "write"]


def _limit(
    limit: Mapping[str, object], component: str, ports: Collection[PortDescription]
) -> OutputLimit | None:
    """None: it names no output of this component."""
    outputs = _outputs(ports)
    port, _, field = str(limit["output"]).partition(".")
    if port == component and port not in outputs:
        port, _, field = field.partition(".")
    if port not in outputs:
        return None
    least, most = limit.get("minimum"), limit.get("maximum")
    return OutputLimit(
        port,
        field,
        minimum=None if least is None else float(str(least)),
        maximum=None if most is None else float(str(most)),
        not_nan=True,
    )


def _has_numbers(port: PortDescription) -> bool:
    """Whether a write port has numbers that can be watched."""
    return port.kind == "write" and any(_counted(shape.fields) for shape in port.messages)


def _counted(fields: Collection[FieldShape]) -> bool:
    return any(
        _counted(field.fields) if field.fields else field.type not in _NOT_COUNTED
        for field in fields
        if not field.is_array or field.is_fixed
    )
