"""The parameters of the executor and of the supervisor, from the tables by which the nodes declare them."""

from collections.abc import Mapping

from _reference.tables import shown, table
from mauve_rt.file_schema.setting_words import limits, sentence, unit_of
from mauve_rt.node.executor import settings as executor
from mauve_rt.node.shared.settings import OF_RCLPY, Setting, type_name
from mauve_rt.node.supervisor import settings as supervisor

_HEAD = ("parameter", "type", "range", "default", "meaning")


def text() -> str:
    """A table for each node."""
    peers = executor.PEERS._replace(description=f"{executor.PEERS.description}; without it the file's count")
    return "\n".join(
        [
            "## executor\n",
            _table({**executor.PARAMETERS, "peers": peers}),
            "Each property of a component is a parameter too: `COMPONENT.PROPERTY`.\n",
            "## supervisor\n",
            _table(supervisor.PARAMETERS),
            "## Both nodes\n",
            _table(OF_RCLPY),
        ]
    )


def _table(settings: Mapping[str, Setting]) -> str:
    return table(_HEAD, [_row(name, each) for name, each in settings.items()])


def _row(name: str, setting: Setting) -> list[str]:
    if not setting.description:
        raise ValueError(f"parameter {name}: expected a description, found none; give the setting one")
    bounds = limits(setting.minimum, setting.maximum)
    meaning = sentence(setting.description)
    if setting.constraint or not setting.is_fixed:
        meaning += f" {sentence(setting.constraints)}"
    unit = f", {unit_of(name)}" if unit_of(name) else ""
    return [f"`{name}`", type_name(setting) + unit, bounds, shown(setting.default), meaning]
