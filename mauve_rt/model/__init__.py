"""The architecture file: schema, loading, checks, and building the kernel's architecture from it."""

from mauve_rt.model.architecture_file import ArchitectureModel, Connection, Overrides, load_architecture
from mauve_rt.model.build import allowed_parts, build, configure, previewed_states
from mauve_rt.model.plugins import Plugin, PluginIndex, PluginLoader
from mauve_rt.parts.message_types import message_class

__all__ = [
    "ArchitectureModel",
    "Connection",
    "Overrides",
    "Plugin",
    "PluginIndex",
    "PluginLoader",
    "allowed_parts",
    "build",
    "configure",
    "load_architecture",
    "message_class",
    "previewed_states",
]
