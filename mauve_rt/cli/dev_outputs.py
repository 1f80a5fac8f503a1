"""The outputs of components before and after a reload: the step that new code makes in each of them."""

import math
from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from mauve_rt.trace.format.message_decoding import Decoder
from mauve_rt.trace.reading.value_tables import numbers_of

MOST_OUTPUTS = 256
"""Values that the executor returns to one request."""
_KEPT = 64  # samples of each output: more than lie between a change and its reply


class Sample(NamedTuple):
    """The numbers of one write."""

    time_ns: int
    numbers: Mapping[str, float]


@dataclass(frozen=True)
class OutputStep:
    """One number of an output. None: no value was written, or none was seen."""

    name: str
    """COMPONENT.PORT:FIELD"""
    before: float | None
    after: float | None

    @property
    def step(self) -> float | None:
        """The difference, if both are known."""
        return None if self.before is None or self.after is None else self.after - self.before


def output_names(components: Iterable[Any], targets: Sequence[str]) -> list[str]:
    """COMPONENT.PORT of each connected output of the targets (components, packages); of all without one."""
    names = [
        f"{component.name}.{port.name}"
        for component in components
        if not targets or component.name in targets or _packages(component) & {*targets}
        for port in component.ports
        if port.resource and port.kind == port.WRITE
    ]
    return names[:MOST_OUTPUTS]


def _packages(component: Any) -> set[str]:
    return {part.partition("/")[0] for part in (component.shell, component.core, component.fsm)}


class OutputSamples:
    """The last values of outputs, from replies of ~/read_values."""

    def __init__(self) -> None:
        self.lacks_definitions = True
        self._decoders: dict[str, Decoder] = {}
        self._samples: dict[str, deque[Sample]] = {}

    def take(self, values: Iterable[Any]) -> None:
        """Keep the values that were written since the last reply."""
        lacks = False
        for value in values:
            if value.problem or value.status == value.NONE:
                continue
            if value.definition:
                self._decoders[value.type] = Decoder(value.type, value.definition)
            decoder = self._decoders.get(value.type)
            if decoder is None:
                lacks = True
                continue
            kept = self._samples.setdefault(value.name, deque(maxlen=_KEPT))
            if not kept or kept[-1].time_ns != value.time_ns:
                kept.append(Sample(value.time_ns, numbers_of(decoder.decode(bytes(value.data)))))
        self.lacks_definitions = lacks

    def are_after(self, instants_ns: Mapping[str, int]) -> bool:
        """Whether each output of these components was seen since the instant of its component's change."""
        return all(
            kept[-1].time_ns >= instants_ns[component]
            for name, kept in self._samples.items()
            if (component := name.partition(".")[0]) in instants_ns
        )

    def steps(self, instants_ns: Mapping[str, int]) -> list[OutputStep]:
        """Of each component's outputs: the last value before its instant, and the first one since."""
        steps: list[OutputStep] = []
        for name, kept in self._samples.items():
            instant_ns = instants_ns.get(name.partition(".")[0])
            if instant_ns is None:
                continue
            before = next((each for each in reversed(kept) if each.time_ns < instant_ns), None)
            after = next((each for each in kept if each.time_ns >= instant_ns), None)
            fields = dict.fromkeys([*(before.numbers if before else ()), *(after.numbers if after else ())])
            steps += [
                OutputStep(
                    f"{name}:{field}",
                    before.numbers.get(field) if before else None,
                    after.numbers.get(field) if after else None,
                )
                for field in fields
            ]
        return steps


def number_text(value: float | None) -> str:
    """Six digits; `-` for none."""
    if value is None:
        return "-"
    return f"{value:.6g}" if math.isfinite(value) else str(value)
