"""/diagnostics: what each component did, allocated and how long its states took."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from sensor_msgs.msg import JointState

from mauve_msgs.srv import ReplaceCore
from mauve_rt._kernel import allocation_counting
from mauve_rt.control.requests import Code

NODE = "/robot_1/executor"
PARTS = ("counter", "guard", "sleepy")
FIGURES = {"releases", "overruns", "skipped", "wakeup_p99_ns", "wakeup_max_ns", "allocations", "page_faults"}


class Health:
    """The statuses that were heard, by component, and the values of the newest."""

    def __init__(self, graph: Any) -> None:
        self._graph = graph
        self._heard = graph.hear(DiagnosticArray, "/diagnostics")

    def of(self, part: str) -> list[Any]:
        """Every status of a component, or of the process."""
        return [
            status for array in self._heard for status in array.status if status.name == f"{NODE}: {part}"
        ]

    def values(self, part: str) -> dict[str, str]:
        """Of the newest status; none before the first."""
        told = self.of(part)
        return {item.key: item.value for item in told[-1].values} if told else {}

    def await_releases(self, part: str, count: int) -> None:
        self._graph.spin_until(
            lambda: int(self.values(part).get("releases", "0")) >= count, f"{count} releases of {part}"
        )

    def remarks(self, part: str, what: str, level: bytes = DiagnosticStatus.WARN) -> list[str]:
        """What statuses of that level say of it."""
        return [
            status.message for status in self.of(part) if status.level == level and what in status.message
        ]

    def await_remark(self, part: str, what: str, level: bytes) -> None:
        self._graph.spin_until(lambda: bool(self.remarks(part, what, level)), f"'{what}' of {part}")


def test_each_component_s_figures_are_told(executor: Any, graph: Any) -> None:
    health = Health(graph)
    health.await_releases("counter", 20)
    for part in PARTS:
        values = health.values(part)
        assert values.keys() >= FIGURES
        assert all(int(values[figure]) >= 0 for figure in FIGURES)
    assert health.values("counter")["allocations"] == "0"
    assert int(health.values("counter")["execution_mean_ns[Count]"]) > 0
    assert "execution_max_ns[Count]" in health.values("counter")
    assert not any("Pause" in key for key in health.values("counter"))
    # The executor loads the kernel before anything that loads the C++ library.
    assert health.values("process")["allocation_counting"] in ("all", "none")
    assert (health.values("process")["allocation_counting"] == "none") == (allocation_counting() == "none")


def test_figures_are_held_against_the_thresholds_of_the_file(
    architecture: Path, start_executor: Callable[..., Any], graph: Any
) -> None:
    text = architecture.read_text(encoding="utf-8")
    text = text.replace(
        "guard: {shell: executor_tests/CounterShell, core: executor_tests/Counter",
        "guard: {diagnostics: {allocations: {warn: 1, error: 4}}, "
        "shell: executor_tests/CounterShell, core: executor_tests/Wasteful",
    )
    text = text.replace("/robot_1}", "/robot_1, diagnostics: {wakeup_max_us: {warn: 0.001}}}")
    own = "diagnostics: {wakeup_max_us: null, execution_max_us: {error: 0.001}}"
    text = text.replace("priority: 40", f"priority: 40, {own}")
    architecture.write_text(text, encoding="utf-8")
    start_executor("-p", f"architecture:={architecture}")
    health = Health(graph)
    health.await_releases("guard", 20)
    assert int(health.values("guard")["allocations"]) >= 4 * 19
    health.await_remark("guard", ", error from 4 on", DiagnosticStatus.ERROR)
    health.await_remark("counter", "execution_max_us in state Count ", DiagnosticStatus.ERROR)
    assert not any("allocations" in status.message for status in health.of("counter"))
    assert not any("wakeup" in status.message for status in health.of("counter")), "switched off"
    message = health.remarks("guard", "wakeup", DiagnosticStatus.ERROR)[-1]
    (wakeup,) = [words.split() for words in message.split("; ") if words.startswith("wakeup_max_us ")]
    assert float(wakeup[1].rstrip(",")) > 0.001
    assert wakeup[2:] == ["warning", "from", "0.001", "on"]
    # It is woken every five seconds: what was wrong a second ago is told once.
    health.await_remark("sleepy", "wakeup_max_us ", DiagnosticStatus.WARN)
    health.await_remark("sleepy", "running", DiagnosticStatus.OK)
    values = health.values("guard")
    assert 0 < int(values["wakeup_recent_max_ns"]) <= int(values["wakeup_max_ns"])
    assert 0 < int(values["execution_recent_max_ns[Count]"]) <= int(values["execution_max_ns[Count]"])


def test_the_interpreter_s_allocations_are_no_warning(executor: Any, graph: Any) -> None:
    reply = graph.ask(
        ReplaceCore, f"{NODE}/replace_core", component="counter", core="executor_tests/PyCounter"
    )
    assert (reply.success, reply.code) == (True, Code.OK)
    health = Health(graph)
    health.await_releases("counter", 20)
    graph.spin_until(lambda: health.values("counter").get("core") == "executor_tests/PyCounter", "the core")
    health.await_releases("counter", int(health.values("counter")["releases"]) + 100)
    told = [status for status in health.of("counter") if status.level == DiagnosticStatus.WARN]
    assert not [status.message for status in told if "allocations" in status.message]


def test_every_status_has_a_name_of_its_own(
    architecture: Path, start_executor: Callable[..., Any], graph: Any
) -> None:
    text = architecture.read_text(encoding="utf-8").replace(
        "connections:",
        "  again: {kind: shared_data, type: std_msgs/msg/Float64, topic: {name: set, direction: subscribe}}\n"
        "connections:",
    )
    architecture.write_text(text, encoding="utf-8")
    start_executor("-p", f"architecture:={architecture}")
    heard = graph.hear(DiagnosticArray, "/diagnostics")
    graph.spin_until(lambda: bool(heard) and len(heard[-1].status) > len(PARTS) + 1, "the statuses")
    names = [status.name for status in heard[-1].status]
    assert len(names) == len(set(names)), names
    topics = {name.partition(": ")[2] for name in names if ": topic /robot_1/set " in name}
    assert topics == {"topic /robot_1/set (set)", "topic /robot_1/set (again)"}


def test_diagnostics_counts_values_that_were_refused(
    tmp_path: Path, plugin_prefix: Path, start_executor: Callable[..., Any], graph: Any
) -> None:
    capacity = "capacity: {name: 4, position: 4, velocity: 4, effort: 4}"
    path = tmp_path / "joints.yaml"
    path.write_text(
        f"""\
mauve: 1
executor: {{namespace: /robot_1}}
components:
  turner: {{shell: executor_tests/JointShell, core: executor_tests/JointTurner, fsm: executor_tests/JointFsm}}
resources:
  joints: {{kind: shared_data, type: sensor_msgs/msg/JointState, {capacity},
           topic: {{name: joints, direction: subscribe}}}}
  turned: {{kind: shared_data, type: sensor_msgs/msg/JointState,
           {capacity.replace("position: 4", "position: 2")}}}
connections:
  - [turner.input, joints.read]
  - [turner.output, turned.write]
""",
        encoding="utf-8",
    )
    start_executor("-p", f"architecture:={path}")
    health = Health(graph)
    voice = graph.voice(JointState, "/robot_1/joints", 5)

    def counted() -> bool:
        voice.publish(JointState(position=[1.0, 2.0, 3.0]))
        return "turned" in {status.name.rpartition(": ")[2] for status in health.of("turned")}

    graph.spin_until(counted, "a refused value")
    status = health.of("turned")[0]
    assert status.level == DiagnosticStatus.WARN
    assert "position has more elements than its memory holds, the resource's capacity is 2" in status.message
    assert int(health.values("turned")["refused_values"]) > 0


def test_limited_outputs_are_counted(
    architecture: Path, start_executor: Callable[..., Any], graph: Any
) -> None:
    text = architecture.read_text(encoding="utf-8")
    text = text.replace("priority: 40", "priority: 40, max_slew: {count.data: 1.0}")
    architecture.write_text(text, encoding="utf-8")
    start_executor("-p", f"architecture:={architecture}")
    health = Health(graph)
    health.await_releases("counter", 20)
    assert int(health.values("counter")["slew_limited[count.data]"]) >= 10
    assert health.values("counter")["slew_not_limited[count.data]"] == "0"
    assert not any("slew" in key for key in health.values("guard"))
