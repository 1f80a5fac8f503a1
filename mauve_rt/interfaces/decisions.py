"""What a supervisor hears and says, between its engine's values and messages of mauve_msgs."""

from collections.abc import Iterable
from typing import Any

from mauve_msgs.msg import ComponentInfo, RuleInfo, SupervisorDecision
from mauve_rt._kernel import RuleStatus
from mauve_rt.control.requests import Code, Outcome
from mauve_rt.supervision.decisions import Decision
from mauve_rt.supervision.inventory import Inventory, ListedComponent
from mauve_rt.supervision.rule import ArchitectureView, ComponentView

UNKNOWN_S = -1.0
STATES = {
    getattr(ComponentInfo, name): name
    for name in ("UNCONFIGURED", "STOPPED", "RUNNING", "STOPPING", "FAULTED")
}


def architecture_view(state: Any) -> ArchitectureView:
    """Of a mauve_msgs/msg/ArchitectureState."""
    components = {
        status.name: ComponentView(
            STATES.get(status.state, str(status.state)), status.core, _authors(status.authors)
        )
        for status in state.components
    }
    return ArchitectureView(
        state.instance_id,
        state.revision,
        components,
        rules=frozenset(state.rules),
        active=frozenset(state.active_rules),
    )


def _authors(told: Iterable[str]) -> dict[str, str]:
    """By element, of the texts ELEMENT=AUTHOR."""
    parts = (text.partition("=") for text in told)
    return {"" if element == "component" else element: author for element, _, author in parts}


def outcome_of(reply: Any) -> Outcome:
    """Of the response of a mauve_msgs/srv/Reconfigure."""
    code = Code(reply.code) if reply.code in set(Code) else Code.PREPARE_FAILED  # one of a newer executor
    return Outcome(code=code, message=reply.message, revision=reply.revision)


def inventory(instance_id: str, components: Iterable[Any], resources: Iterable[Any]) -> Inventory:
    """Of mauve_msgs/msg/ComponentInfo and ResourceInfo, as ~/list_components lists them."""
    listed = {info.name: _listed_component(info) for info in components}
    return Inventory(instance_id, listed, {info.name for info in resources})


def _listed_component(info: Any) -> ListedComponent:
    return ListedComponent(
        state=STATES.get(info.state, str(info.state)),
        shell=info.shell,
        core=info.core,
        fsm=info.fsm,
        properties=dict(text.split("=", 1) for text in info.properties if "=" in text),
        connections={
            port.name: f"{port.resource}.{port.service}" if port.resource else "" for port in info.ports
        },
    )


def decision_message(
    decision: Decision, stamp: Any, *, took_s: float = UNKNOWN_S, bound_s: float = UNKNOWN_S
) -> Any:
    """mauve_msgs/msg/SupervisorDecision."""
    return SupervisorDecision(
        stamp=stamp,
        rule=decision.rule,
        decision=decision.decision,
        reason=decision.reason,
        silence_s=decision.silence_s,
        revision=decision.revision,
        message=decision.message,
        act=decision.act,
        measured=decision.measured,
        took_s=took_s,
        bound_s=bound_s,
    )


def rule_info(name: str, status: RuleStatus, now_ns: int, *, where: str, problem: str) -> Any:
    """RuleInfo of a rule of which nothing is prepared."""
    next_ns = status.next_ns
    return RuleInfo(
        name=name,
        where=where,
        armed=status.armed,
        holds=status.holds,
        known=status.known,
        active=status.active,
        in_effect=status.in_effect,
        next=status.next or "",
        next_in_s=UNKNOWN_S if next_ns is None else max(next_ns - now_ns, 0) / 1e9,
        since_s=max(now_ns - status.since_ns, 0) / 1e9 if status.armed else 0.0,
        measured=status.measured,
        problem=problem,
    )
