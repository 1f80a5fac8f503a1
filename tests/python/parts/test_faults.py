"""What parts in Python raise or refuse: a fault with its traceback, or a refusal with its reason."""

from typing import Any

import pytest
from geometry_msgs.msg import PoseStamped
from python_parts import ActFsm, CountCore, CountShell, EmptyShell, HearShell, IdleCore, Stage
from rclpy.serialization import deserialize_message

from mauve_rt.api import (
    Core,
    Fsm,
    MauveError,
    Resource,
    SharedData,
    Shell,
    call_port,
    ms_to_ns,
    property,  # noqa: A004
    service,
)


def machine(*states: tuple[str, int], initial: int = 0) -> type[Fsm[Any, Any]]:
    """A ring of states: (name, 0) executes act, (name, d) waits d."""

    class Ring(Fsm[Any, Any]):
        def define(self) -> None:
            made = [self.wait(name, d) if d else self.execution(name, "act") for name, d in states]
            self.set_initial(made[initial])
            for state, to in zip(made, made[1:] + made[:1], strict=True):
                self.next(state, to)

    return Ring


# ---- faults


class FailsInAct(CountCore):
    def act(self) -> None:
        super().act()
        if self.count == 5:
            self.deeper()

    def deeper(self) -> None:
        raise ValueError("five is too many")


class FailsInGuard(CountCore):
    def is_five(self) -> bool:
        raise LookupError("no answer")


class FailsInSurrogates(CountCore):
    def act(self) -> None:
        raise RuntimeError("no text: \udcff")


class _WordlessError(Exception):
    def __str__(self) -> str:
        raise SystemExit("no words")


class FailsWithoutWords(CountCore):
    def act(self) -> None:
        raise _WordlessError


# As the file of a path whose bytes are no UTF-8 names it: even its traceback has no valid text.
_CODE = compile("def act(self):\n    raise SystemExit('left')\n", "/odd/\udcff.py", "exec")


class FailsInAnOddPlace(CountCore):
    exec(_CODE)  # noqa: S102 - the code above


class GuardedFsm(Fsm[CountShell, FailsInGuard]):
    def define(self) -> None:
        act, pause = self.execution("Act", FailsInGuard.act), self.wait("Pause", ms_to_ns(2))
        self.set_initial(act)
        self.transition(act, FailsInGuard.is_five, pause)
        self.next(act, pause)
        self.next(pause, act)


class FailsInTake(CountCore):
    def adopt(self, old: CountCore) -> None:
        self.count = old.count

    def take(self, _old: CountCore) -> None:
        raise MemoryError("no room")


@pytest.mark.parametrize(
    ("core", "fsm", "words"),
    [
        (FailsInAct, ActFsm, ["ValueError: five is too many", "test_faults.py", "deeper", "act"]),
        (FailsInGuard, GuardedFsm, ["LookupError: no answer", "test_faults.py", "is_five"]),
        (FailsInSurrogates, ActFsm, ["RuntimeError: no text: \\udcff"]),
        (FailsWithoutWords, ActFsm, ["_WordlessError"]),
        (FailsInAnOddPlace, ActFsm, ["SystemExit: left", "/odd/\\udcff.py"]),
    ],
)
def test_what_it_raises_is_a_fault_with_its_traceback(built: Stage, core: Any, fsm: Any, words: list[str]):
    built.add("bad", CountShell, core, fsm)
    built.add("good", EmptyShell, IdleCore)
    built.share("pose", SharedData(PoseStamped), "bad.out.write")
    deployer = built.deploy()
    built.until(lambda: built.describe("bad").state == "FAULTED")
    fault = built.describe("bad").fault
    assert all(word in fault for word in [*words, "in state Act", "ns)"]), fault
    output = deserialize_message(deployer.read_resource("pose")[0], PoseStamped)
    assert output == PoseStamped(), "its output is safe"
    releases = built.describe("good").releases
    built.until(lambda: built.describe("good").releases > releases + 5)
    with pytest.raises(MauveError, match="FAULTED"):
        deployer.start("bad")
    component = built.architecture.component("bad")
    component.cleanup()
    component.configure()
    deployer.start("bad")
    built.until(lambda: built.describe("bad").state == "FAULTED")


def test_what_take_raises_is_a_fault_of_the_new_core(built: Stage):
    component = built.add("count", CountShell, CountCore)
    deployer = built.deploy()
    built.until(lambda: component.core.count > 3)
    assert deployer.replace_core("count", FailsInTake, phase_timeout_ns=0).to_core.endswith("/FailsInTake")
    built.until(lambda: component.state == "FAULTED")
    fault = component.describe().fault
    assert "take failed: MemoryError: no room" in fault
    assert "test_faults.py" in fault
    assert component.core.count > 3, "adopt had been carried out, and nothing ran after take"


def test_adopt_then_take_move_the_state_over(built: Stage):
    class Second(CountCore):
        calls: list[tuple[str, object]]

        def adopt(self, old: CountCore) -> bool:
            self.calls = [("adopt", old)]
            return True

        def take(self, old: CountCore) -> None:
            self.calls.append(("take", old))
            self.count, old.count = old.count, -1

    component = built.add("count", CountShell, CountCore)
    deployer = built.deploy()
    old = component.core
    built.until(lambda: old.count > 3)
    deployer.replace_core("count", Second)
    assert component.core.calls == [("adopt", old), ("take", old)]
    assert old.count == -1
    assert component.core.count > 3


# ---- refusals


class Refusing:
    def configure(self) -> bool:
        return False


class Raising:
    def configure(self) -> None:
        raise OSError("no such device")


def parts_with(kind: str, hook: type) -> dict[str, Any]:
    bases = {"shell": CountShell, "core": CountCore, "fsm": ActFsm}
    return {**bases, kind: type("Bad", (hook, bases[kind]), {})}


@pytest.mark.parametrize("kind", ["shell", "core", "fsm"])
@pytest.mark.parametrize(("hook", "word"), [(Refusing, "configure failed"), (Raising, "no such device")])
def test_a_part_that_refuses_leaves_the_component_unconfigured(
    built: Stage, kind: str, hook: type, word: str
):
    component = built.add("bad", **parts_with(kind, hook))
    with pytest.raises(MauveError, match=word) as refused:
        built.architecture.configure()
    assert refused.value.code == "configure_failed"
    assert not built.architecture.is_configured()
    assert not component.is_configured()
    assert component.state == "UNCONFIGURED"


def test_a_resource_that_refuses_leaves_the_architecture_unconfigured(built: Stage):
    class Bad(Raising, Resource):
        pass

    built.architecture.add_resource("bad", Bad())
    with pytest.raises(MauveError, match=r"OSError: no such device[^$]*test_faults\.py"):
        built.architecture.configure()
    assert not built.architecture.is_configured()


def test_hooks_run_in_order_and_in_reverse(built: Stage):
    calls: list[str] = []

    def recording(kind: str, base: type) -> Any:
        def hook(which: str) -> Any:
            return lambda _self: calls.append(f"{which} {kind}")

        return type(kind, (base,), {"configure": hook("configure"), "cleanup": hook("cleanup")})

    shell, core, fsm = (
        recording(k, b) for k, b in (("shell", CountShell), ("core", CountCore), ("fsm", ActFsm))
    )
    built.add("count", shell, core, fsm)
    built.architecture.add_resource("data", recording("resource", Resource)())
    built.architecture.configure()
    built.architecture.cleanup()
    kinds = ["resource", "shell", "fsm", "core"]
    assert calls == [f"configure {kind}" for kind in kinds] + [f"cleanup {kind}" for kind in reversed(kinds)]


@pytest.mark.parametrize(
    ("fsm", "code", "words"),
    [
        (machine(("Act", 0)), "loop_without_wait", "Act -> Act"),
        (machine(("Act", 0), ("Pause", -5)), "bad_fsm", "expected a duration > 0 ns, found -5"),
        (machine(("Act", 0), ("Act", 0), ("Pause", 9)), "duplicate_name", "state Act"),
        (machine(("Act", 0), ("Pause", 7)), "bad_period", "at least 100 us"),
        (type("Nothing", (Fsm,), {"define": lambda _self: None}), "bad_fsm", "no initial state"),
        (type("Undefined", (Fsm,), {}), "configure_failed", "Undefined lacks define"),
    ],
)
def test_a_machine_that_cannot_be_is_refused(built: Stage, fsm: Any, code: str, words: str):
    built.add("bad", CountShell, CountCore, fsm)
    with pytest.raises(MauveError) as refused:
        built.architecture.configure()
    assert refused.value.code == code
    assert words in str(refused.value)


def test_states_are_declared_in_define_only():
    with pytest.raises(RuntimeError, match="in define"):
        ActFsm(None).wait("Pause", 1)


def test_a_core_needs_the_methods_that_the_fsm_calls(built: Stage):
    built.add("bad", EmptyShell, type("Bare", (Core,), {}))
    with pytest.raises(MauveError, match="a method 'act'") as refused:
        built.architecture.configure()
    assert refused.value.code == "type_mismatch"


def test_a_core_for_another_shell_is_refused(built: Stage):
    built.add("bad", HearShell, CountCore)
    with pytest.raises(MauveError, match=r"CountCore is for CountShell, found \w+/HearShell"):
        built.architecture.configure()


def test_a_property_s_default_must_be_in_its_range(built: Stage):
    class OddShell(Shell):
        height = property(-1.0, unit="m", minimum=0.0)

    with pytest.raises(MauveError, match=r"expected at least 0 m, found -1") as refused:
        built.add("bad", OddShell, IdleCore)
    assert refused.value.code == "out_of_range"


def test_a_service_that_raises_is_the_caller_s_fault(built: Stage):
    class Oracle(Resource):
        @service
        def ask(self, question: str) -> str:
            raise PermissionError(question)

    class AskShell(Shell):
        ask = call_port(Oracle.ask)

    class AskCore(Core[AskShell]):
        def act(self) -> None:
            self.shell.ask("why?")

    component = built.add("ask", AskShell, AskCore)
    built.share("oracle", Oracle(), "ask.ask.ask")
    built.deploy()
    built.until(lambda: component.state == "FAULTED")
    assert "PermissionError: why?" in component.describe().fault
