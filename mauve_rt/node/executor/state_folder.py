"""The executor's state folder: what rules and persons decided outlasts the process."""

from pathlib import Path
from typing import TYPE_CHECKING

from rclpy.lifecycle import LifecycleNode

from mauve_rt.control.runtime import Runtime
from mauve_rt.node.executor.rules import OwnRules

if TYPE_CHECKING:
    from mauve_rt.control.restart import Restart


class StateFolder:
    """A file of the executor's full name, in the folder that the parameter names; none: nothing is kept."""

    def __init__(self, node: LifecycleNode, rules: OwnRules, *, folder: str, forget: bool) -> None:
        self._node = node
        self._rules = rules
        self._restart: Restart | None = None
        if folder:
            from mauve_rt.control import restart  # noqa: PLC0415 - few executors keep something

            name = node.get_fully_qualified_name().strip("/").replace("/", "__")
            self._restart = restart.Restart(Path(folder).absolute() / f"{name}.state", forget=forget)

    def configure(self, runtime: Runtime) -> None:
        """Put in force what an executor of this name kept, and say so; then keep what is decided."""
        console = self._node.get_logger()
        if self._restart is None:
            for rule in self._rules.latched():
                console.warning(
                    f"rule {rule} is latched, and state_folder is empty: a restart of the executor ends the "
                    "rule while its cause may persist. Give the executor -p state_folder:=FOLDER"
                )
            return
        remarks = self._restart.configure(runtime, self._rules.file_names(), self._rules.safety())
        for level, text in remarks:
            getattr(console, level)(f"restart: {text}")

    def close(self) -> None:
        """Write for the last time."""
        if self._restart is not None:
            self._restart.close()

    def problem(self) -> str | None:
        """Why what is decided now would not outlast the process; "": it would; None: it is not to."""
        return None if self._restart is None else self._restart.problem()
