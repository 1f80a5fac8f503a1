"""What rules outside of an executor hear of its components, from ~/state."""

from collections.abc import Mapping

from mauve_rt._kernel import RuleEngine, RuleRunner, SignalSpec
from mauve_rt.supervision.rule import ArchitectureView

# Numbers of the kernel's ComponentState; mauve_msgs/msg/ComponentInfo has the same.
COMPONENT_STATES: Mapping[str, int] = {
    "UNCONFIGURED": 0,
    "STOPPED": 1,
    "RUNNING": 2,
    "STOPPING": 4,
    "FAULTED": 5,
}


class ViewSignals:
    """The signals of an engine, or of a runner whose caller feeds it, about states and changes."""

    def __init__(self, engine: RuleEngine | RuleRunner) -> None:
        self._engine = engine
        heard = list(enumerate(engine.signals))
        self._states = [(number, spec) for number, spec in heard if spec.kind == "state"]
        self._changes = [(number, spec) for number, spec in heard if spec.kind == "change"]

    def tell(self, now_ns: int, before: ArchitectureView | None, view: ArchitectureView) -> None:
        """~/state changed; `before`: what it was, None at the first."""
        for number, spec in self._states:
            state = view.state_of(spec.target)
            is_news = before is None or before.state_of(spec.target) != state
            if is_news and state in COMPONENT_STATES:
                self._engine.tell(number, now_ns, float(COMPONENT_STATES[state]))
        for number, spec in self._changes:
            if before is not None and _is_changed(spec, before, view):
                self._engine.tell(number, now_ns)


def _is_changed(spec: SignalSpec, before: ArchitectureView, view: ArchitectureView) -> bool:
    if spec.target:
        return before.components.get(spec.target) != view.components.get(spec.target)
    return (before.instance_id, before.revision) != (view.instance_id, view.revision)
