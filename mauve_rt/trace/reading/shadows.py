"""The shadows that a bag reports: candidates in parallel with live cores, and how their outputs differed."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Self

SHADOW_TYPE = "mauve_msgs/msg/Shadow"
_VERDICTS = ("running", "ended", "faulted", "promoted", "hung")  # by the constants of mauve_msgs/msg/Shadow


def verdict_word(number: int) -> str:
    """Return the word for a constant of mauve_msgs/msg/Shadow."""
    return _VERDICTS[number] if number < len(_VERDICTS) else f"verdict {number}"


@dataclass(frozen=True)
class ShadowOutput:
    """The difference between a candidate and the live core, for one number of a write port."""

    port: str
    field: str
    """Path of the number, e.g. `linear.x`."""
    compared: int
    """Releases in which both cores wrote a number."""
    maximum: float
    """Largest absolute difference."""
    rms: float
    """Root mean square of the difference."""
    nan: int
    """Releases in which the candidate wrote NaN."""
    live_nan: int
    """Releases in which the live core wrote NaN."""
    live_only: int
    """Releases in which only the live core wrote to the port."""
    shadow_only: int
    """Releases in which only the candidate wrote to the port."""
    lag: int | None
    """Releases by which the candidate's first number of the port is later; None where that is not known."""

    @property
    def name(self) -> str:
        """Port and number, e.g. `command.linear.x`."""
        return f"{self.port}.{self.field}"

    @classmethod
    def of_message(cls, message: Any) -> Self:
        """Take it from a mauve_msgs/msg/ShadowOutput, of whichever library."""
        counts = ("compared", "nan", "live_nan", "live_only", "shadow_only")
        return cls(
            port=message.port,
            field=message.field,
            maximum=float(message.maximum),
            rms=float(message.rms),
            lag=int(message.lag) if message.has_lag else None,
            **{name: int(getattr(message, name)) for name in counts},
        )


@dataclass(frozen=True)
class OutputStep:
    """One output of a bumpless change. Numbers in the unit of the output; NaN where they are not known."""

    output: str
    """Port and number, e.g. `command.torque`."""
    greatest: float
    """Greatest difference at which the candidate goes in."""
    difference: float
    """Candidate minus core, in the last release that was compared."""
    least: float
    """Smallest absolute difference."""
    least_instant_ns: int
    step: float
    """First output of the new core minus last output of the old core."""

    @classmethod
    def of_message(cls, message: Any) -> Self:
        """Take it from a mauve_msgs/msg/OutputStep, of whichever library."""
        numbers = ("greatest", "difference", "least", "step")
        return cls(
            output=message.output,
            least_instant_ns=int(message.least_instant_ns),
            **{name: float(getattr(message, name)) for name in numbers},
        )


@dataclass(frozen=True)
class OutputCurve:
    """One output of a bumpless change around the swap, by release, oldest first."""

    output: str
    """Port and number, e.g. `command.torque`."""
    instant_ns: int | None
    """T: the component runs with the candidate from then on; None: the candidate did not go in."""
    instants_ns: tuple[int, ...]
    """Of the last releases in which both cores were compared."""
    live: tuple[float, ...]
    """Written by the core before in these releases; NaN where it had not written yet."""
    candidate: tuple[float, ...]
    new_instants_ns: tuple[int, ...]
    """Of the first releases after T that wrote the output."""
    new_core: tuple[float, ...]
    """Written by the new core in these releases."""

    def points(self, series: str) -> list[tuple[int, float]]:
        """Return the instants and numbers of live, candidate or new_core."""
        instants_ns = self.new_instants_ns if series == "new_core" else self.instants_ns
        return list(zip(instants_ns, getattr(self, series), strict=True))

    @classmethod
    def of_message(cls, message: Any) -> Self:
        """Take it from a mauve_msgs/msg/OutputCurve, of whichever library."""
        return cls(
            output=message.output,
            instant_ns=int(message.instant_ns) or None,
            instants_ns=tuple(map(int, message.instants_ns)),
            live=tuple(map(float, message.live)),
            candidate=tuple(map(float, message.candidate)),
            new_instants_ns=tuple(map(int, message.new_instants_ns)),
            new_core=tuple(map(float, message.new_core)),
        )


@dataclass(frozen=True)
class Shadow:
    """A shadow as one message of the bag reports it. Times in ns of CLOCK_MONOTONIC, or of virtual time."""

    time_ns: int
    """When the figures were taken."""
    component: str
    core: str
    """The candidate."""
    live_core: str
    """Core of the component when the shadow began."""
    verdict: str
    """running, ended, faulted or promoted"""
    reason: str
    """Why it ended; empty while it runs."""
    begin_ns: int
    end_ns: int | None
    """None while it runs."""
    releases: int
    """Releases of the component since the begin."""
    compared: int
    """Releases in which the candidate executed."""
    skipped_late: int
    """Releases that the candidate skipped because its thread was late."""
    skipped_budget: int
    """Releases that the candidate skipped to stay within its budget."""
    idle: int
    """Releases in which the candidate was in a longer wait."""
    over_budget: int
    """Releases in which the candidate took longer than its budget."""
    budget_ns: int
    """Execution time for one release, on average."""
    largest_execution_ns: int
    """Largest execution time of one release."""
    outputs: tuple[ShadowOutput, ...]
    steps: tuple[OutputStep, ...] = ()
    """Of a bumpless change: the outputs that it bounds."""
    curves: tuple[OutputCurve, ...] = ()
    """The same outputs around the swap."""

    @classmethod
    def of_message(cls, message: Any, time_ns: int) -> Self:
        """Take it from a mauve_msgs/msg/Shadow, of whichever library."""
        counts = (
            *("begin_ns", "releases", "compared", "skipped_late", "skipped_budget", "idle", "over_budget"),
            *("budget_ns", "largest_execution_ns"),
        )
        return cls(
            time_ns=time_ns,
            component=message.component,
            core=message.core,
            live_core=message.live_core,
            verdict=verdict_word(int(message.verdict)),
            reason=message.reason,
            end_ns=int(message.end_ns) or None,
            outputs=tuple(ShadowOutput.of_message(output) for output in message.outputs),
            # bags of earlier versions have none
            steps=tuple(OutputStep.of_message(step) for step in getattr(message, "steps", ())),
            curves=tuple(OutputCurve.of_message(curve) for curve in getattr(message, "curves", ())),
            **{name: int(getattr(message, name)) for name in counts},
        )


def last_reports(reports: Iterable[Shadow]) -> tuple[Shadow, ...]:
    """Return the last report of each shadow, by component, then by begin."""
    last = {(one.component, one.begin_ns): one for one in sorted(reports, key=lambda one: one.time_ns)}
    return tuple(last[key] for key in sorted(last))
