"""What somebody outside of an executor knows of it, and of how its rules stand with it."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from mauve_rt.supervision.rules import Rule

NOT_THERE = "not in the architecture"


@dataclass(frozen=True)
class ComponentView:
    """A component as ~/state shows it. state: a name such as RUNNING."""

    state: str
    core: str
    authors: Mapping[str, str] = field(default_factory=dict)  # of what was changed, by element


@dataclass(frozen=True)
class ArchitectureView:
    """What ~/state said last."""

    instance_id: str
    revision: int
    components: Mapping[str, ComponentView]
    rules: frozenset[str] = frozenset()  # that the executor runs itself
    active: frozenset[str] = (
        frozenset()
    )  # whose overlays are active there, of the executor and of supervisors

    def state_of(self, component: str) -> str:
        """Its state, in words."""
        found = self.components.get(component)
        return found.state if found is not None else NOT_THERE


@dataclass
class WatchedRule:
    """One rule, as its supervisor stands with it. `number`: of the engine's."""

    number: int
    rule: Rule
    unobservable: str = ""  # why it cannot be heard outside of the executor
    left: bool = False  # to the executor, which runs it itself
    own: bool = False  # it is active at the executor by this supervisor
    releasing: str = ""  # the request by which a rule without `undo` ends, until ~/state shows its end
    release_ns: int = 0  # it is not sent before
    told_unobservable: bool = False
    checked: bool = False  # the executor was asked about it, or is being asked
    standing: str = ""  # of what it is about, in words

    def forget(self) -> None:
        """The executor was started anew, or runs the rule itself: nothing of before counts."""
        self.left = self.told_unobservable = self.checked = self.own = False
        self.releasing, self.release_ns = "", 0

    def absent(self, view: ArchitectureView) -> str:
        """A component that it is about and that does not run; empty: all do."""
        return min((name for name in self.rule.targets() if view.state_of(name) != "RUNNING"), default="")
