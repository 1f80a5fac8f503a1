"""The exploration mission on an installed Jazzy: radio, executors and supervisors, until Ctrl-C.

    ros2 launch mauve_examples exploration.launch.py robots:=2 map:=office link_loss_at:=20 link_back_at:=45

Arguments are the options of the demo (`scripts/demo --help`), which runs the same mission with an end, a
report and a verdict. Robots start at once; times are seconds after all have met, as in the demo.
"""

import json

from launch import LaunchContext, LaunchDescription, LaunchDescriptionEntity
from launch.actions import (
    DeclareLaunchArgument,
    GroupAction,
    IncludeLaunchDescription,
    OpaqueFunction,
)
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

from mauve_examples.mission.architecture import load_world, write_setups
from mauve_examples.mission.demo_options import parse_options
from mauve_examples.mission.demo_run import RECORDED

# Arguments that the demo's command line has too, there with hyphens; the empty ones are left to its defaults.
_OPTIONS = ("map", "robots", "link_loss_at", "link_back_at", "drop_share", "seed", "out")
_UNTIL_CTRL_C_S = "1e9"


def generate_launch_description() -> LaunchDescription:
    """Arguments, and the mission they describe."""
    return LaunchDescription(
        [
            _optional("map", "YAML file, or a map of ours (default: office)"),
            _optional("robots", "how many (default: 2)"),
            _optional("link_loss_at", "s until the radio link is lost, or never (default: 20)"),
            _optional("link_back_at", "s until it is back (default: 45)"),
            _optional("drop_share", "share of messages lost, 0 to 1 (default: 0)"),
            _optional("seed", "of starts and lost messages (default: 1)"),
            _optional("out", "folder for architectures and bags (default: out/mission_DATE_TIME)"),
            DeclareLaunchArgument(
                "supervisor",
                default_value="true",
                choices=["true", "false"],
                description="false: nobody swaps",
            ),
            OpaqueFunction(function=_mission),
        ]
    )


def _optional(name: str, description: str) -> DeclareLaunchArgument:
    return DeclareLaunchArgument(name, default_value="", description=description)


def _mission(context: LaunchContext) -> list[LaunchDescriptionEntity]:
    def given(name: str) -> str:
        return str(LaunchConfiguration(name).perform(context))

    link_stays = given("link_loss_at") == "never"
    words = [
        f"--{name.replace('_', '-')}={given(name)}"
        for name in _OPTIONS
        if given(name) and not (link_stays and name.startswith("link_"))
    ]
    words += ["--no-supervisor"] if given("supervisor") == "false" else []
    options = parse_options([f"--duration={_UNTIL_CTRL_C_S}", *words])
    world = load_world(options.map_file, options.names, seed=options.seed)
    setups = write_setups(world, options.out, seed=options.seed, supervisor=options.supervisor)
    loss_s, back_s = (0.0, 0.0) if link_stays else (options.link_loss_at_s, options.link_back_at_s)
    radio = Node(
        package="mauve_examples",
        executable="radio",
        parameters=[
            {
                "robots": options.names,
                "drop_share": options.drop_share,
                "seed": options.seed,
                "link_loss_at_s": float(loss_s or 0.0),
                "link_back_at_s": float(back_s or 0.0),
            }
        ],
        output="screen",
    )
    robots = [
        _robot(
            architecture=str(setup.architecture),
            bag=str(options.out / "bag" / setup.name),
            rules=str(setup.rules or ""),
            record_topics=json.dumps(RECORDED),
        )
        for setup in setups
    ]
    return [radio, *robots]


def _robot(**arguments: str) -> LaunchDescriptionEntity:
    """An executor and its supervisor, in a scope of their own."""
    file = PathJoinSubstitution([FindPackageShare("mauve_rt"), "launch", "executor.launch.py"])
    source = PythonLaunchDescriptionSource(file)
    return GroupAction([IncludeLaunchDescription(source, launch_arguments=arguments.items())])
