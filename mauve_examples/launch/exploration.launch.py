"""The exploration mission on an installed Jazzy: radio, executors and supervisors.

    ros2 launch mauve_examples exploration.launch.py robots:=2 map:=office seed:=1 supervisor:=true

Robots start at once. The demo (`scripts/demo`) runs the same mission with a timeline, a report and a verdict.
"""

from pathlib import Path

from launch import LaunchContext, LaunchDescription, LaunchDescriptionEntity
from launch.actions import DeclareLaunchArgument, ExecuteProcess, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from mauve_examples.mission.architecture import load_world, map_file, write_setups


def generate_launch_description() -> LaunchDescription:
    """Arguments, and the mission they describe."""
    return LaunchDescription(
        [
            DeclareLaunchArgument("robots", default_value="2", description="how many"),
            DeclareLaunchArgument("map", default_value="office", description="YAML file, or a map of ours"),
            DeclareLaunchArgument("seed", default_value="1", description="of starts and lost messages"),
            DeclareLaunchArgument("drop_share", default_value="0.0", description="of messages lost, 0 to 1"),
            DeclareLaunchArgument("supervisor", default_value="true", choices=["true", "false"]),
            DeclareLaunchArgument("out", default_value="mission", description="architectures and bags"),
            OpaqueFunction(function=_mission),
        ]
    )


def _mission(context: LaunchContext) -> list[LaunchDescriptionEntity]:
    def given(name: str) -> str:
        return LaunchConfiguration(name).perform(context)

    names = [f"robot_{number}" for number in range(1, int(given("robots")) + 1)]
    seed, out = int(given("seed")), Path(given("out")).absolute()
    world = load_world(map_file(given("map")), names, seed=seed)
    supervised = given("supervisor") == "true" and len(names) > 1
    setups = write_setups(world, out, seed=seed, supervisor=supervised)
    parameters = ["-p", f"robots:=[{','.join(names)}]", "-p", f"drop_share:={float(given('drop_share'))!r}"]
    radio = [
        "python3",
        "-m",
        "mauve_examples.mission.radio",
        "--ros-args",
        *parameters,
        "-p",
        f"seed:={seed}",
    ]
    actions: list[LaunchDescriptionEntity] = [ExecuteProcess(cmd=radio, name="radio", output="screen")]
    for setup in setups:
        bag = out / "bag" / setup.name
        executor = {"architecture": str(setup.architecture), "bag": str(bag)}
        actions.append(
            Node(
                package="mauve_rt",
                executable="executor",
                namespace=setup.name,
                parameters=[executor],
                output="screen",
            )
        )
        if setup.rules is not None:
            rules = {"rules": str(setup.rules)}
            actions.append(
                Node(
                    package="mauve_rt",
                    executable="supervisor",
                    namespace=setup.name,
                    parameters=[rules],
                    output="screen",
                )
            )
    return actions
