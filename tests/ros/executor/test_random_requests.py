"""Requests of random contents: every one is answered, none ends the process or disturbs who is not concerned.

MAUVE_RANDOM_REQUESTS sets their number; without it the same few hundred are sent each time.
"""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from mauve_msgs.msg import ComponentInfo, ReconfigurationStep
from mauve_msgs.srv import ListComponents, Reconfigure, ReplaceCore, Start, Stop
from mauve_rt.control.requests import Code
from mauve_rt.model.steps import STEP_KINDS

NODE = "/robot_1/executor"
ASKED_FOR = os.environ.get("MAUVE_RANDOM_REQUESTS", "")
REQUESTS = int(ASKED_FOR or "400")
AT_ONCE = 8  # fewer than a service's queue holds: all of them are received
PARTS = "{shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm"
CORES = [f"executor_tests/{core}" for core in ("Counter", "Backwards", "Reluctant", "Unready", "PyCounter")]
ARCHITECTURE = f"""\
mauve: 1
executor: {{namespace: /robot_1}}
components:
  counter: {PARTS}, alternatives: [{", ".join(CORES)}, executor_tests/CalmFsm]}}
  other: {PARTS}, alternatives: [{", ".join(CORES)}]}}
  witness: {PARTS}, reconfigurable: false, properties: {{period_ms: 500}}}}
resources:
  count: {{kind: shared_data, type: std_msgs/msg/Float64}}
connections:
  - [counter.count, count.write]
"""

# Text that DDS carries: no surrogates; what follows a NUL does not arrive.
ODD = st.text(st.characters(exclude_categories=["Cs"]), max_size=40) | st.sampled_from(
    [
        "",
        "\0",
        "a\0b",
        "\u202e\u2028\ufeff",
        "😀" * 20,
        "é" * 999,
        "x" * 1001,
        "{",
        "[" * 500,
        "&a [*a]",
        "../../etc",
    ]
)


def _often(*known: str) -> st.SearchStrategy[str]:
    return st.one_of(st.sampled_from(known), st.sampled_from(known), ODD)


TARGETS = _often("counter", "other", "witness", "second", "count", "sum")
NAMES = _often(
    *CORES, "executor_tests/CalmFsm", "step", "period_ms", "label", "set", "count", "executor_tests/Held"
)
VALUES = _often(
    *(
        "1",
        "2.5",
        "-1",
        ".nan",
        ".inf",
        "1e400",
        "9" * 400,
        "-9223372036854775809",
        "0x7fffffffffffffffff",
        "true",
    ),
    *(
        "text",
        "'5'",
        "{a: b}",
        "[]",
        "null",
        "2001-99-99",
        "!!python/object:os.system ls",
        "count.read",
        "count.write",
    ),
    *("sum.write", f"{PARTS}}}", f"{PARTS}, priority: 99}}", f"{PARTS}, stack_bytes: 1e99}}"),
    *(
        "{kind: shared_data, type: std_msgs/msg/Float64}",
        "{kind: ring_buffer, capacity: 99999999999999999999}",
    ),
)
# None so short that a stop would be refused, and then come all the same.
SECONDS = st.sampled_from([0.0, 0.0, 1.0, -1.0, 1e-300, 10.5, 1e308, float("nan"), float("inf")]).map(
    lambda seconds: 0.0 if 0.0 < seconds < 0.5 else seconds
)
IGNORED = st.integers(-(2**63), 2**63 - 1)
COMMON = {
    "request_id": st.sampled_from(["", "", "", "", "once", "twice"]) | ODD,
    "expected_revision": st.sampled_from([0, 0, 0, 0, 0, 0, 1, 7, 2**64 - 1]),
    "requested_by": ODD,
    "cause": ODD,
}
STEP = st.builds(
    ReconfigurationStep, kind=_often(*STEP_KINDS), target=TARGETS, name=NAMES | st.just(""), value=VALUES
)


class Ask(NamedTuple):
    """A request: of which service, and its fields."""

    service: type
    name: str
    fields: dict[str, Any]


def _ask(service: type, name: str, **fields: st.SearchStrategy[Any]) -> st.SearchStrategy[Ask]:
    return st.fixed_dictionaries({**COMMON, **fields}).map(lambda drawn: Ask(service, name, drawn))


CHANGEABLE = st.sampled_from(["counter", "other"])
SENSIBLE = st.one_of(
    st.builds(lambda part: Ask(Stop, "stop", {"component": part}), CHANGEABLE),
    st.builds(lambda part: Ask(Start, "start", {"component": part}), CHANGEABLE),
    st.builds(
        lambda part, core: Ask(ReplaceCore, "replace_core", {"component": part, "core": core}),
        CHANGEABLE,
        st.sampled_from(CORES[:3]),
    ),
    st.builds(
        lambda part, step: Ask(
            Reconfigure,
            "reconfigure",
            {"steps": [ReconfigurationStep(kind="set_property", target=part, name="step", value=str(step))]},
        ),
        CHANGEABLE,
        st.floats(-1.0, 11.0),
    ),
)
ASKS = SENSIBLE | st.one_of(
    _ask(Stop, "stop", component=TARGETS, timeout_s=SECONDS),
    _ask(Start, "start", component=TARGETS, clock_ns=st.just(0) | st.integers(-(2**63), 2**63 - 1)),
    _ask(
        ReplaceCore,
        "replace_core",
        component=TARGETS,
        core=NAMES,
        commit_timeout_s=SECONDS,
        max_missed=IGNORED,
    ),
    _ask(
        Reconfigure,
        "reconfigure",
        steps=st.lists(STEP, max_size=4) | STEP.map(lambda step: [step] * 101),
        dry_run=st.booleans(),
        commit_timeout_s=SECONDS,
        max_missed=IGNORED,
    ),
    st.just(Ask(ListComponents, "list_components", {})),
)


class Model:
    """What accepted requests have made of the components: their names, cores, and which of them run."""

    def __init__(self) -> None:
        self.cores = dict.fromkeys(("counter", "other", "witness"), "executor_tests/Counter")
        self.running = set(self.cores)

    def take(self, ask: Ask) -> None:
        fields = ask.fields
        if ask.service is Stop:
            self._step("stop", fields["component"])
        elif ask.service is Start:
            self._step("start", fields["component"])
        elif ask.service is ReplaceCore:
            self._step("replace_core", fields["component"], fields["core"])
        else:
            for step in fields["steps"]:
                self._step(*(text.partition("\0")[0] for text in (step.kind, step.target, step.name)))

    def _step(self, kind: str, target: str, name: str = "") -> None:
        target = target.partition("\0")[0]
        match kind:
            case "stop":
                self.running.discard(target)
            case "start":
                self.running.add(target)
            case "replace_core":
                self.cores[target] = name.partition("\0")[0]
            case "add_component":
                self.cores[target] = "executor_tests/Counter"
            case "remove_component":
                self.running.discard(target)
                del self.cores[target]


def _commanded(kind: str, service: type, asks: list[Ask]) -> set[str]:
    alone = {ask.fields["component"] for ask in asks if ask.service is service}
    steps = [step for ask in asks if ask.service is Reconfigure for step in ask.fields["steps"]]
    return alone | {step.target for step in steps if step.kind == kind}


def _started(asks: list[Ask]) -> set[str]:
    return _commanded("start", Start, asks)


def _stopped(asks: list[Ask]) -> set[str]:
    return _commanded("stop", Stop, asks)


@pytest.mark.timeout(600 + REQUESTS // 10)
def test_random_requests(
    tmp_path: Path,
    start_executor: Callable[..., Any],
    graph: Any,
    record_property: Callable[[str, str], None],
) -> None:
    (tmp_path / "robot.yaml").write_text(ARCHITECTURE, encoding="utf-8")
    executor = start_executor(
        *("-p", f"architecture:={tmp_path / 'robot.yaml'}", "-p", "report_phase_timeout_s:=0.0")
    )

    def listed() -> Any:
        return graph.ask(ListComponents, f"{NODE}/list_components")

    def witness() -> Any:
        return next(part for part in listed().components if part.name == "witness")

    model = Model()
    first = listed()
    revisions = {first.revision}  # that requests were accepted at
    codes: dict[int, int] = {}
    answered = accepted = 0

    @settings(
        max_examples=REQUESTS // AT_ONCE,
        deadline=None,
        derandomize=not ASKED_FOR,
        database=None,
        phases=[Phase.generate],  # each meets what the ones before left: a smaller one would say little
        suppress_health_check=list(HealthCheck),
    )
    @given(st.lists(ASKS, min_size=AT_ONCE, max_size=AT_ONCE))
    def send(asks: list[Ask]) -> None:
        nonlocal answered, accepted
        futures = [graph.ask_later(ask.service, f"{NODE}/{ask.name}", **ask.fields) for ask in asks]
        graph.spin_until(lambda: all(future.done() for future in futures), f"replies to {asks}")
        changes = []
        for ask, future in zip(asks, futures, strict=True):
            reply = future.result()
            answered += 1
            if ask.service is ListComponents:
                continue
            codes[reply.code] = codes.get(reply.code, 0) + 1
            assert reply.success == (reply.code == Code.OK), reply
            assert reply.message, ask
            assert not reply.message.startswith("internal error"), f"{ask}: {reply.message}"
            assert reply.instance_id == first.instance_id
            if reply.success and not ask.fields.get("dry_run") and reply.revision not in revisions:
                revisions.add(
                    reply.revision
                )  # or it is the answer to a repeated request, or to one beside it
                changes.append((reply.revision, ask))
        for _, ask in sorted(changes, key=lambda change: change[0]):
            accepted += 1
            model.take(ask)
        now = listed()
        assert now.revision == max(revisions), "nothing else was changed"
        assert {part.name: part.core for part in now.components} == model.cores
        running = {part.name for part in now.components if part.state == ComponentInfo.RUNNING}
        # A start and a stop of one component at once wait for nobody: which was last, no revision tells.
        contested = _started([ask for _, ask in changes]) & _stopped([ask for _, ask in changes])
        assert running - contested == model.running - contested
        model.running = running

    before = witness()
    send()
    assert executor.process.poll() is None, executor.output
    assert answered == REQUESTS // AT_ONCE * AT_ONCE
    assert accepted > REQUESTS // 50, codes
    graph.spin_until(lambda: witness().releases > before.releases, "a release of who was not concerned")
    after = witness()
    assert (after.overruns, after.skipped, after.core) == (before.overruns, before.skipped, before.core)
    assert "Traceback" not in executor.output
    record_property(
        "random requests", f"{answered} answered, {accepted} accepted; codes {sorted(codes.items())}"
    )
