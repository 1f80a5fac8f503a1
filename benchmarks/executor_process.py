"""An executor process, whose components are stopped and started through its services."""

import os
from pathlib import Path

from native import BenchmarkError
from processes import Processes

from mauve_msgs.srv import ListComponents, Start, Stop
from mauve_rt.cli.client import Client, connected
from mauve_rt.errors import MauveError

_START_S = 10.0  # it may have been spawned just now


class ExecutorProcess:
    """Of an architecture file, in a namespace of its own; it ends with the processes."""

    def __init__(
        self,
        processes: Processes,
        architecture: Path,
        *parameters: str,
        name: str = "executor",
        plugins: Path | None = None,
    ) -> None:
        """Start it, with parameters written as name:=value; `plugins`: one more prefix to look for them."""
        self._processes = processes
        self._name = name
        self.namespace = f"/bench_{os.getpid()}_{name}"
        prefixes = [str(plugins)] if plugins else []
        prefixes += filter(None, [os.environ.get("AMENT_PREFIX_PATH")])
        words = [word for parameter in parameters for word in ("-p", parameter)]
        self.pid = processes.spawn(
            name,
            *("-m", "mauve_rt.node.executor.main", "--ros-args", "-r", f"__ns:={self.namespace}"),
            *("-p", f"architecture:={architecture}", *words),
            AMENT_PREFIX_PATH=os.pathsep.join(prefixes),
        )

    def wait(self) -> None:
        """Until it answers.

        Raises:
            BenchmarkError: it does not.
        """
        service = f"{self.namespace}/executor/list_components"
        try:
            with connected() as client:
                client.call(ListComponents, service, ListComponents.Request(), wait_s=_START_S)
        except MauveError as error:
            raise BenchmarkError(f"executor: {error}; {self._processes.output(self._name)}") from None

    def start(self, client: Client, component: str) -> None:
        """Start a component.

        Raises:
            BenchmarkError: there is no answer, or it is no.
        """
        self._ask(client, Start, "start", Start.Request(component=component))

    def stop(self, client: Client, component: str) -> None:
        """Stop a component, as start(); all else goes on."""
        self._ask(client, Stop, "stop", Stop.Request(component=component))

    def end(self) -> None:
        """End the process in order.

        Raises:
            BenchmarkError: it does not end.
        """
        self._processes.end(self._name)

    def _ask(self, client: Client, service_type: type, service: str, request: object) -> None:
        try:
            reply = client.call(
                service_type, f"{self.namespace}/executor/{service}", request, wait_s=_START_S
            )
        except MauveError as error:
            raise BenchmarkError(f"executor: {error}; {self._processes.output(self._name)}") from None
        if not reply.success:
            raise BenchmarkError(f"executor: {service} refused: {reply.message}")
