"""An executor and, where it is given rules, its supervisor, which has the same ones: the second line.

    ros2 launch mauve_rt executor.launch.py architecture:=FILE [rules:=FILE] [namespace:=/robot_1] [bag:=DIR]
        [params_file:=FILE] [remappings:="goal:=/goal executor:target:=waypoint"]

Both files are checked before anything starts; the supervisor ends with its executor. The executor is a Node
here and no LifecycleNode, for it configures and activates itself; with `autostart:=false` it waits for
`ros2 lifecycle set`.
"""

from pathlib import Path
from typing import Any

from launch import LaunchContext, LaunchDescription, LaunchDescriptionEntity
from launch.actions import DeclareLaunchArgument, EmitEvent, OpaqueFunction, RegisterEventHandler
from launch.event_handlers import OnProcessExit
from launch.events import matches_action
from launch.events.process import ShutdownProcess
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from mauve_rt.model import Overrides, load_architecture
from mauve_rt.supervision.rules import RulesFile

# Arguments that are parameters of the executor, which is not given the empty ones.
_PARAMETERS = {
    "architecture": str,
    "rules": str,
    "bag": str,
    "autostart": bool,
    "require_realtime": bool,
    "trace": bool,
    "peers": list[str],
    "record_topics": list[str],
}


def generate_launch_description() -> LaunchDescription:
    """Arguments, and the nodes they describe."""
    return LaunchDescription(
        [
            DeclareLaunchArgument("architecture", description="architecture file"),
            _optional("namespace", "of both nodes (default: as in the architecture file)"),
            _optional("rules", "rules file of the executor and its supervisor (default: none)"),
            _optional("bag", "folder of the bag to record, which must not exist yet (default: none)"),
            _optional("record_topics", "further topics to record, as in [chatter:std_msgs/msg/String]"),
            _optional("autostart", "false: wait for lifecycle transitions"),
            _optional("require_realtime", "true: refuse to start without real-time rights"),
            _optional("trace", "false: component threads write no traces"),
            _optional(
                "peers", "names of the other robots, as in [robot_2] (default: as in the architecture file)"
            ),
            _optional("params_file", "parameter file of both nodes; arguments given here count more"),
            _optional("remappings", "of both nodes: FROM:=TO or NODE:FROM:=TO, separated by spaces"),
            DeclareLaunchArgument("log_level", default_value="info", description="of both nodes"),
            OpaqueFunction(function=_nodes),
        ]
    )


def _optional(name: str, description: str) -> DeclareLaunchArgument:
    return DeclareLaunchArgument(name, default_value="", description=description)


def _nodes(context: LaunchContext) -> list[LaunchDescriptionEntity]:
    def given(name: str) -> str:
        return str(LaunchConfiguration(name).perform(context))

    namespace = _namespace(given("namespace"), context)
    model = load_architecture(given("architecture"), overrides=Overrides(namespace=namespace))
    files = [_existing(file) for file in [given("params_file")] if file]
    common: dict[str, Any] = {
        "namespace": model.namespace,
        "remappings": [_rule(word) for word in given("remappings").split()],
        "ros_arguments": ["--log-level", given("log_level")],
        "output": "screen",
    }
    parameters = {
        name: ParameterValue(LaunchConfiguration(name), value_type=kind)
        for name, kind in _PARAMETERS.items()
        if given(name)
    }
    executor = Node(package="mauve_rt", executable="executor", parameters=[*files, parameters], **common)
    if not given("rules"):
        return [executor]
    rules = {"rules": str(RulesFile(given("rules")).path)}
    supervisor = Node(package="mauve_rt", executable="supervisor", parameters=[*files, rules], **common)
    end = EmitEvent(event=ShutdownProcess(process_matcher=matches_action(supervisor)))
    handler = OnProcessExit(target_action=executor, on_exit=[end])
    return [executor, supervisor, RegisterEventHandler(handler)]


def _namespace(given: str, context: LaunchContext) -> str:
    """The namespace to give the nodes, absolute; empty: as in the architecture file."""
    pushed = context.launch_configurations.get("ros_namespace", "")  # by PushRosNamespace
    words = (given if given.startswith("/") else f"{pushed}/{given}").split("/")
    return "/" + "/".join(word for word in words if word) if given or pushed else ""


def _existing(file: str) -> str:
    if not Path(file).is_file():
        raise FileNotFoundError(f"params_file:={file}: no such file")
    return file


def _rule(text: str) -> tuple[str, str]:
    source, separator, target = text.partition(":=")
    if not (source and separator and target):
        raise ValueError(f"remappings: expected FROM:=TO or NODE:FROM:=TO, found '{text}'")
    return source, target
