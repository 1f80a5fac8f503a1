"""max_slew of components in architecture files, and of components that a transaction adds."""

from pathlib import Path

import pytest
from bad_architectures import GOOD

from mauve_rt._kernel import Architecture, PluginRegistry, Transaction
from mauve_rt.errors import ArchitectureFileError
from mauve_rt.model import build, configure, load_architecture
from mauve_rt.model.build import add_component_step
from mauve_rt.model.plugins import PluginIndex, PluginLoader

REGISTRY = PluginRegistry()


def limits(architecture: Architecture, name: str) -> dict[str, float]:
    return {one.output: one.max_slew for one in architecture.component(name).describe().slew_limits}


def test_a_component_has_the_max_slew_of_its_file(tmp_path: Path, plugin_prefix: Path) -> None:
    path = tmp_path / "robot.yaml"
    path.write_text(GOOD.replace("priority: 40", "priority: 40, max_slew: {count.data: 20}"))
    model = load_architecture(path)
    architecture = build(model, REGISTRY)
    configure(model, architecture)
    assert limits(architecture, "source") == {"count.data": 20.0}
    assert limits(architecture, "sink") == {}


def test_a_component_that_a_transaction_adds_has_it(tmp_path: Path, plugin_prefix: Path) -> None:
    path = tmp_path / "robot.yaml"
    path.write_text(GOOD.replace("priority: 40", "priority: 40, max_slew: {count.data: 20}"))
    registry = PluginRegistry()
    transaction = Transaction()
    add_component_step(
        transaction, load_architecture(path), "source", PluginLoader(registry, PluginIndex.installed())
    )
    architecture = Architecture(registry)
    architecture.commit(transaction)
    assert limits(architecture, "source") == {"count.data": 20.0}


@pytest.mark.parametrize("key", ["count.speed", "counts.data", "set.data"])
def test_a_number_that_is_not_written_is_refused_with_its_place(
    key: str, tmp_path: Path, plugin_prefix: Path
) -> None:
    path = tmp_path / "robot.yaml"
    text = GOOD.replace("priority: 40", f"priority: 40, max_slew: {{{key}: 20}}")
    path.write_text(text)
    with pytest.raises(ArchitectureFileError) as caught:
        build(load_architecture(path), REGISTRY)
    error = caught.value
    assert text.splitlines()[error.line - 1][error.column - 1 :].startswith(key)
    assert error.component == "source"
