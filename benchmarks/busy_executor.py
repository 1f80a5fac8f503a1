"""A real executor process of the tutorial's architecture, kept busy through ROS by a process of its own."""

from contextlib import ExitStack
from pathlib import Path

from executor_process import ExecutorProcess
from native import ROOT
from processes import Processes
from scope import Scope

from mauve_rt.cli.client import Client, connected
from mauve_rt.model import load_architecture
from mauve_rt.trace.reading.reader import open_trace
from mauve_rt.trace.reading.trace import Trace

COMPONENT = "metronome"
ARCHITECTURE = ROOT / "mauve_examples" / "architecture" / "metronome.yaml"
_RULES = f"""\
mauve: 1
rules:
  - name: quiet
    in: supervisor
    when: {{silence: {{topic: beat, type: std_msgs/msg/Float64, longer_than_s: 60.0}}}}
    do: [{{kind: replace_core, target: {COMPONENT}, name: mauve_examples/Accelerando}}]
"""


class BusyExecutor(Scope):
    """A context: inside it, the executor runs and is being asked.

    Raises:
        BenchmarkError: executor or load did not start.
    """

    def __init__(self) -> None:
        super().__init__()
        self._component = load_architecture(ARCHITECTURE).components[COMPONENT]
        self.load_report = ""

    def _enter(self, stack: ExitStack) -> None:
        self._processes = stack.enter_context(Processes())
        self._bag = self._processes.folder / "bag"
        self._executor = ExecutorProcess(self._processes, ARCHITECTURE, f"bag:={self._bag}")
        self._client: Client = stack.enter_context(connected())
        program = str(Path(__file__).with_name("rclpy_load.py"))
        names = (f"{self._executor.namespace}/executor", f"{self._executor.namespace}/beat")
        self._processes.spawn("load", program, *names)
        self._processes.await_output("load", "busy")

    @property
    def priority(self) -> int:
        """The component's."""
        return self._component.priority

    @property
    def cpu(self) -> int:
        """The component's."""
        return (self._component.cpus or [0])[0]

    def start(self) -> None:
        """Start the component."""
        self._executor.start(self._client, COMPONENT)

    def stop(self) -> None:
        """Stop the component; executor and load go on."""
        self._executor.stop(self._client, COMPONENT)

    def lose_supervisor(self) -> None:
        """Start a supervisor of the executor, and kill it once it watches.

        Raises:
            BenchmarkError: it does not come to that.
        """
        rules = self._processes.folder / "rules.yaml"
        rules.write_text(_RULES, encoding="utf-8")
        words = ("-r", f"__ns:={self._executor.namespace}", "-p", f"rules:={rules}")
        self._processes.spawn("supervisor", "-m", "mauve_rt.node.supervisor.main", "--ros-args", *words)
        self._processes.await_output("supervisor", "armed")
        self._processes.kill("supervisor")

    def finish(self) -> Trace:
        """End both processes and read the bag.

        Raises:
            BenchmarkError: a process does not end.
        """
        self._processes.end("load")
        self.load_report = self._processes.output("load").strip().splitlines()[-1]
        self._executor.end()
        return open_trace(self._bag)
