"""What a supervisor hears and says, between its engine's values and messages of mauve_msgs."""

from typing import Any

from mauve_msgs.msg import ComponentInfo, SupervisorDecision
from mauve_rt.node.supervisor_engine import Decision
from mauve_rt.node.supervisor_rule import ArchitectureView, ComponentView

STATES = {
    getattr(ComponentInfo, name): name
    for name in ("UNCONFIGURED", "STOPPED", "RUNNING", "HELD", "STOPPING", "FAULTED")
}


def architecture_view(state: Any) -> ArchitectureView:
    """Of a mauve_msgs/msg/ArchitectureState."""
    components = {
        status.name: ComponentView(STATES.get(status.state, str(status.state)), status.core)
        for status in state.components
    }
    return ArchitectureView(state.instance_id, state.revision, components)


def decision_message(decision: Decision, stamp: Any) -> Any:
    """mauve_msgs/msg/SupervisorDecision."""
    return SupervisorDecision(
        stamp=stamp,
        rule=decision.rule,
        decision=decision.decision,
        reason=decision.reason,
        silence_s=decision.silence_s,
        revision=decision.revision,
        message=decision.message,
    )
