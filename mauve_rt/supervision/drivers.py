"""Outputs that go to drivers: what has to be known of a driver that goes on where no message comes.

Safe outputs do not reach a driver where the executor is killed, the power fails or a cable is cut. So the
driver has a time after which it is safe by itself, and the file says it: `driver_timeout_ms`.
"""

from collections.abc import Iterator, Mapping

from mauve_rt.errors import Problem
from mauve_rt.model import ArchitectureModel
from mauve_rt.supervision.effects import touched
from mauve_rt.supervision.rules import RulesFile
from mauve_rt.supervision.silence_limits import writers_of


def unbounded_outputs(file: RulesFile, model: ArchitectureModel) -> Iterator[Problem]:
    """Topics of the components that a safety rule changes, without a word on their drivers."""
    for index, rule in enumerate(file.rules.rules):
        components = touched(rule.do) if rule.safety else set()
        for name, resource in model.resources.items():
            topic = resource.topic
            if topic is None or topic.direction != "publish" or topic.driver_timeout_ms is not None:
                continue
            if components & writers_of(name, model):
                what = (
                    f"safety rule '{rule.name}' cannot help where the executor dies or the network fails: "
                    f"resource '{name}', topic {topic.name}, does not say when its driver is safe by itself"
                )
                remedy = f"add driver_timeout_ms to the topic in {model.path}; 0 where no driver acts on it"
                yield file.problem(("rules", index, "safety"), what, remedy=remedy)


def late_writers(model: ArchitectureModel) -> list[Problem]:
    """Outputs that are written more rarely than their drivers wait.

    Raises:
        ArchitectureFileError: the architecture cannot be built or configured.
    """
    timeouts_ms = {
        name: resource.topic.driver_timeout_ms
        for name, resource in model.resources.items()
        if resource.topic is not None and resource.topic.driver_timeout_ms
    }
    if not timeouts_ms:
        return []
    from mauve_rt.supervision.rehearsal import rehearsal  # noqa: PLC0415 - it needs a simulation

    with rehearsal(model) as executor:
        return list(_late(model, timeouts_ms, executor.periods_s()))


def _late(
    model: ArchitectureModel, timeouts_ms: Mapping[str, float], periods_s: Mapping[str, float]
) -> Iterator[Problem]:
    """`periods_s`: of components; 0: it has none."""
    for name, timeout_ms in timeouts_ms.items():
        periodic = {one: periods_s[one] for one in writers_of(name, model) if periods_s.get(one)}
        if not periodic:
            continue
        quickest = min(periodic, key=lambda one: periodic[one])
        if periodic[quickest] * 1e3 >= timeout_ms:
            what = (
                f"the driver of resource '{name}' is safe after {timeout_ms:g} ms of silence, "
                f"and component '{quickest}' writes every {periodic[quickest] * 1e3:g} ms"
            )
            remedy = "raise driver_timeout_ms above the period, better above two"
            yield model.problem(("resources", name, "topic", "driver_timeout_ms"), what, remedy=remedy)
