"""Changes of a counter that last until a test ends them."""

from pathlib import Path
from typing import Any

from mauve_msgs.msg import ReconfigurationStep
from mauve_msgs.srv import Reconfigure, ReplaceCore

NODE = "/robot_1/executor"


def declare(architecture: Path, *cores: str) -> None:
    """Let the counter of an architecture file take these cores, too."""
    text = architecture.read_text(encoding="utf-8")
    known = "executor_tests/PyCounter,"
    architecture.write_text(text.replace(known, " ".join((known, *(f"{core}," for core in cores)))), "utf-8")


class Preparation:
    """A replacement of the counter's core, by one that is being prepared, or adopts, until finish()."""

    def __init__(self, graph: Any, folder: Path, core: str) -> None:
        self._graph = graph
        self._awaited = folder / "go"
        label = ReconfigurationStep(
            kind="set_property", target="counter", name="label", value=f"'{self._awaited}'"
        )
        assert graph.ask(Reconfigure, f"{NODE}/reconfigure", steps=[label]).success
        self.request = {"component": "counter", "core": core, "request_id": "slow", "commit_timeout_s": 10.0}
        self.reply = graph.ask_later(ReplaceCore, f"{NODE}/replace_core", **self.request)
        graph.spin_until(self._awaited.with_suffix(".begun").exists, "the preparation")

    def finish(self) -> Any:
        """Its reply."""
        self._awaited.touch()
        self._graph.spin_until(self.reply.done, "the change")
        return self.reply.result()
