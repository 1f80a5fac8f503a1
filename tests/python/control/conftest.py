"""What requests are carried out on, without ROS."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from mauve_rt.control.runtime import Runtime
from mauve_rt.model import load_architecture


@pytest.fixture
def runtime(tmp_path: Path, plugin_prefix: Path, request: pytest.FixtureRequest) -> Iterator[Runtime]:
    """The architecture that the module has as FILE, at work."""
    path = tmp_path / "robot.yaml"
    path.write_text(request.module.FILE, encoding="utf-8")
    runtime = Runtime(lambda: load_architecture(path))
    runtime.configure()
    runtime.activate()
    yield runtime
    runtime.deactivate()
    runtime.cleanup()
