"""What parts in Python say of themselves: expressions of waits, worst cases of a core."""

from typing import Any, ClassVar

import pytest
from python_parts import Stage

from mauve_rt.api import (
    Core,
    Deployer,
    Fsm,
    Host,
    MauveError,
    PluginRegistry,
    Shell,
    Simulation,
    Transaction,
    ms_to_ns,
    property,  # noqa: A004
    read_port,
    times,
    us_to_ns,
)
from mauve_rt.model.plugins import PluginIndex, PluginLoader

HUGE = 2**63 - 1


class UnitShell(Shell):
    unit_ms = property(10, unit="ms", minimum=1, maximum=1000, structural="fsm")
    metres = property(2, unit="m")
    real_ms = property(2.0, unit="ms")
    heard = read_port("geometry_msgs/msg/Point", optional=True)


class UnitCore(Core[UnitShell]):
    wcet_ns: ClassVar[dict[str, int]] = {"act": us_to_ns(300), "is_far": us_to_ns(2)}
    state_fields: ClassVar[dict[str, str]] = {"count": "int64"}

    def configure(self) -> None:
        self.count = 0

    def act(self) -> None:
        self.count += 1

    def is_far(self) -> bool:
        return False


class BudgetCore(UnitCore):
    budget_ns = us_to_ns(50)


class SlowerCore(UnitCore):
    wcet_ns: ClassVar[dict[str, int]] = {"act": us_to_ns(900), "is_far": us_to_ns(1)}


class UnitFsm(Fsm[UnitShell, UnitCore]):
    def define(self) -> None:
        act = self.execution("Act", UnitCore.act)
        w5 = self.wait("W5", times(5, self.shell.unit_ms))
        plain = self.wait("Plain", ms_to_ns(20))
        event = self.wait_event("Event", "heard", times(3, self.shell.unit_ms), us_to_ns(500))
        self.set_initial(act)
        self.transition(act, UnitCore.is_far, w5)
        self.next(act, plain)
        self.next(w5, event)
        self.next(event, act)
        self.next(plain, act)


class PeriodicFsm(Fsm[UnitShell, UnitCore]):
    def define(self) -> None:
        act = self.execution("Act", UnitCore.act)
        pause = self.wait("Pause", times(1, self.shell.unit_ms))
        self.set_initial(act)
        self.transition(act, UnitCore.is_far, pause)
        self.next(act, pause)
        self.next(pause, act)


@pytest.fixture
def registry() -> PluginRegistry:
    registry = PluginRegistry()
    registry.shell("p/Shell", UnitShell)
    registry.core("p/Core", BudgetCore, "p/Shell")
    registry.fsm("p/Fsm", UnitFsm, "p/Shell")
    return registry


def test_an_fsm_says_its_methods_and_the_expressions_of_its_waits(registry: PluginRegistry) -> None:
    states = {state.name: state for state in registry.describe_fsm("p/Fsm")}
    act, w5, plain, event = (states[name] for name in ("Act", "W5", "Plain", "Event"))
    assert (act.action, act.guards, act.successors) == ("act", ["is_far"], ["W5", "Plain"])
    assert (w5.duration_text, w5.duration_ns) == ("5 * unit_ms", ms_to_ns(50))
    assert (plain.duration_text, plain.duration_ns) == ("", ms_to_ns(20))
    assert (event.event_port, event.duration_text, event.min_interarrival_text) == (
        "heard",
        "3 * unit_ms",
        "",
    )


@pytest.mark.usefixtures("plugin_prefix")
def test_a_wait_takes_a_property_of_a_shell_in_cpp() -> None:
    class NativeFsm(Fsm[Any, Any]):
        def define(self) -> None:
            rest = self.wait("Rest", times(2, self.shell.unit_ms))
            self.set_initial(rest)
            self.next(rest, rest)

    registry = PluginRegistry()
    PluginLoader(registry, PluginIndex.installed()).require("shell", "executor_tests/TimedShell")
    registry.fsm("p/Native", NativeFsm, "executor_tests/TimedShell")
    (rest,) = registry.describe_fsm("p/Native")
    assert (rest.duration_text, rest.duration_ns) == ("2 * unit_ms", ms_to_ns(20))


@pytest.mark.parametrize(
    ("name", "factor", "code", "expected"),
    [
        ("metres", 2, "invalid_argument", "whose unit is ns, us, ms or s, found int of unit m"),
        ("real_ms", 2, "invalid_argument", "found float of unit ms"),
        ("unit_ms", HUGE, "out_of_range", rf"{HUGE} \* unit_ms: the time is longer than a time can be"),
        ("unit_ms", 0, "bad_fsm", r"state W: a wait has no length.*found 0 \* unit_ms, which is 0"),
    ],
)
def test_times_that_are_none_are_refused(
    registry: PluginRegistry, name: str, factor: int, code: str, expected: str
) -> None:
    class BadFsm(Fsm[UnitShell, UnitCore]):
        def define(self) -> None:
            self.wait("W", times(factor, getattr(self.shell, name)))

    registry.fsm("p/Bad", BadFsm, "p/Shell")
    with pytest.raises(MauveError, match=expected) as refused:
        registry.describe_fsm("p/Bad")
    assert refused.value.code == code


def test_a_core_is_described(registry: PluginRegistry) -> None:
    core = registry.describe_core("p/Core")
    assert (core.name, core.shell, core.is_python, core.classes) == ("p/Core", "p/Shell", True, [])
    assert core.wcet_ns == {"act": us_to_ns(300), "is_far": us_to_ns(2)}
    assert core.budget_ns == us_to_ns(50)
    assert core.state_fields == [("count", "int64")]


def test_a_worst_case_of_a_core_is_above_zero(registry: PluginRegistry) -> None:
    class NoTimeCore(UnitCore):
        wcet_ns: ClassVar[dict[str, int]] = {"act": 0}

    expected = "core p/NoTime, wcet_ns of act: .*expected 1 to"
    with pytest.raises(MauveError, match=expected):
        registry.core("p/NoTime", NoTimeCore, "p/Shell")
    with pytest.raises(MauveError, match=expected):
        registry.add_python_core("p/NoTime", "p/Shell", NoTimeCore._make, NoTimeCore.wcet_ns)
    assert registry.names("core") == ["p/Core"]


@pytest.mark.parametrize("is_virtual", [False, True], ids=["threads", "virtual time"])
def test_a_component_shows_the_worst_cases_of_the_core_in_force(built: Stage, *, is_virtual: bool) -> None:
    built.architecture.add_component("c", UnitShell, UnitCore, PeriodicFsm, alternatives=["*"])
    built.architecture.configure()
    simulation = Simulation() if is_virtual else None
    host: Host = Deployer(built.architecture) if simulation is None else simulation.add(built.architecture)
    host.deploy()

    def shown() -> tuple[int, str]:
        (act,) = (state for state in built.describe("c").states if not state.is_wait)
        return act.wcet_ns, act.wcet_core.rpartition("/")[2]

    assert shown() == (us_to_ns(302), "UnitCore")
    host.commit(Transaction().replace_core("c", SlowerCore))
    assert shown() == (us_to_ns(901), "SlowerCore")
    host.shutdown()
