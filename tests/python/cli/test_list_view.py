"""`mauve list` for people: everything a reply says, on a terminal of 80 columns."""

import io

import pytest
from rich.console import Console

from mauve_msgs.msg import ComponentInfo, HeldElement, JobBound, PortInfo, ResourceInfo, SlewLimit, StateInfo
from mauve_msgs.srv import ListComponents
from mauve_rt.cli.list_view import STATES, print_components
from mauve_rt.supervision.view_signals import COMPONENT_STATES


def _printed(reply: ListComponents.Response, *, width: int = 80) -> list[str]:
    out = io.StringIO()
    print_components(reply, Console(file=out, width=width, highlight=False))
    return [line.rstrip() for line in out.getvalue().splitlines() if line.strip()]


def _line(lines: list[str], word: str) -> list[str]:
    return next(line for line in lines if word in line.split()).split()


def test_what_runs_on_which_cpu_at_which_priority_and_its_cores() -> None:
    running = ComponentInfo(
        name="guidance",
        state=ComponentInfo.RUNNING,
        core="p/Core",
        policy="SCHED_FIFO",
        priority=60,
        cpus=[0, 1],
        period_ns=100_000_000,
        releases=7,
        overruns=2,
        alternatives=["p/Other"],
        reconfigurable=True,
        generation=3,
        built_ns=86_400 * 10**9,
    )
    protected = ComponentInfo(
        name="robot",
        state=ComponentInfo.FAULTED,
        core="p/Robot",
        policy="SCHED_OTHER",
        fault="range_error: [off] the map",
    )
    access = "every account of this machine"
    lines = _printed(ListComponents.Response(components=[running, protected], access=access, revision=5))
    assert _line(lines, "guidance") == ["guidance", "RUNNING", "100", "ms", "60", "0,1", "7", "2"]
    assert _line(lines, "robot") == ["robot", "FAULTED", "-", "-", "any", "0", "0"]
    cores = [line.split() for line in lines if "p/" in line]
    assert cores == [
        ["guidance", "p/Core", "3", cores[0][3], cores[0][4]],
        ["p/Other"],
        ["robot", "p/Robot", "-", "-"],
    ]
    assert cores[0][3] in ("1970-01-01", "1970-01-02"), "of another day the date"
    assert "(protected)" in "".join(lines)
    assert lines[-3:] == ["robot: range_error: [off] the map", f"may change it: {access}", "revision 5"]


def test_ports_and_resources_have_their_frames() -> None:
    ports = [PortInfo(name="pose", kind=PortInfo.READ, resource="pose", service="read", frame="map")]
    resources = [ResourceInfo(name="pose", frame="map", child_frame="base")]
    lines = _printed(
        ListComponents.Response(components=[ComponentInfo(name="control", ports=ports)], resources=resources)
    )
    at = lines.index(next(line for line in lines if "control.pose" in line))
    assert lines[at].split() == ["control.pose", "pose.read", "in", "map,", "of", "base"]
    assert lines[at + 1].split() == ["in", "map"]


def test_each_port_says_what_it_is_connected_to_and_where_that_goes() -> None:
    ports = [
        PortInfo(name="goal", kind=PortInfo.READ, resource="goal", service="read"),
        PortInfo(name="map", kind=PortInfo.CALL, resource="map", service="update"),
        PortInfo(name="scan", kind=PortInfo.READ),
    ]
    resources = [
        ResourceInfo(name="goal", subscribes="/robot_1/goal"),
        ResourceInfo(name="map", publishes="/robot_1/map", offers="/robot_1/map/clear"),
        ResourceInfo(name="alarm", publishes="/alarm"),
        ResourceInfo(name="idle"),
    ]
    reply = ListComponents.Response(
        components=[ComponentInfo(name="guidance", ports=ports)], resources=resources
    )
    lines = _printed(reply)
    assert _line(lines, "guidance.goal") == ["guidance.goal", "goal.read", "subscribes", "/robot_1/goal"]
    at = lines.index(next(line for line in lines if "guidance.map" in line))
    assert lines[at].split() == ["guidance.map", "map.update", "publishes", "/robot_1/map"]
    assert lines[at + 1].split() == ["offers", "/robot_1/map/clear"]
    assert _line(lines, "guidance.scan") == ["guidance.scan", "nothing"]
    # Of what no port has: the resources that are on ROS, the other ones, too.
    assert _line(lines, "alarm") == ["-", "alarm", "publishes", "/alarm"]
    assert _line(lines, "idle") == ["-", "idle"]


def test_a_port_shows_only_the_topics_of_its_own_direction() -> None:
    ports = [
        PortInfo(name="seen", kind=PortInfo.READ, resource="pose", service="read"),
        PortInfo(name="pose", kind=PortInfo.WRITE, resource="pose", service="write"),
        PortInfo(name="lone", kind=PortInfo.READ, resource="alarm", service="read"),
    ]
    resources = [
        ResourceInfo(name="pose", publishes="/pose", subscribes="/seen"),
        ResourceInfo(name="alarm", publishes="/alarm"),
    ]
    reply = ListComponents.Response(
        components=[ComponentInfo(name="control", ports=ports)], resources=resources
    )
    lines = _printed(reply)
    assert _line(lines, "control.seen") == ["control.seen", "pose.read", "subscribes", "/seen"]
    assert _line(lines, "control.pose") == ["control.pose", "pose.write", "publishes", "/pose"]
    assert _line(lines, "control.lone") == ["control.lone", "alarm.read"]
    assert _line(lines, "/alarm") == ["-", "alarm", "publishes", "/alarm"]


def test_a_port_that_takes_a_lock_is_marked() -> None:
    ports = [
        PortInfo(name="pose", kind=PortInfo.READ, resource="pose", service="read"),
        PortInfo(name="goal", kind=PortInfo.WRITE, resource="goals", service="write"),
        PortInfo(name="pulse", kind=PortInfo.READ, resource="pulse", service="read"),
    ]
    resources = [
        ResourceInfo(name="pose", kind="shared_data", wait_free=["read"]),
        ResourceInfo(name="goals", kind="ring_buffer", wait_free=["read"]),
        ResourceInfo(name="pulse", kind="event"),
    ]
    lines = _printed(
        ListComponents.Response(components=[ComponentInfo(name="c", ports=ports)], resources=resources)
    )
    assert _line(lines, "c.pose") == ["c.pose", "pose.read"]
    assert _line(lines, "c.goal") == ["c.goal", "goals.write", "(lock)"]
    assert _line(lines, "c.pulse") == ["c.pulse", "pulse.read"]


def test_a_resource_has_its_type_and_memory() -> None:
    resources = [
        ResourceInfo(name="image", type="sensor_msgs/msg/Image", memory_bytes=24_883_200),
        ResourceInfo(name="map", type="my_robot/Map"),
    ]
    lines = _printed(ListComponents.Response(resources=resources))
    table = lines[next(i for i, line in enumerate(lines) if "memory" in line) :]
    assert _line(table, "image") == ["image", "sensor_msgs/msg/Image", "24.9", "MB"]
    assert not any("map" in line for line in table), "what is not known has no line"


@pytest.mark.parametrize("width", [80, 160])
def test_forty_components_of_long_names_lose_no_word_on_a_narrow_terminal(width: int) -> None:
    name = "localisation_of_the_left_arm_{}"
    parts = [
        ComponentInfo(
            name=name.format(index),
            core=f"my_robot_components/ParticleFilterOfManyParticles{index}",
            ports=[PortInfo(name="wheel_odometry_input", resource=f"wheel_odometry_{index}", service="read")],
        )
        for index in range(40)
    ]
    resources = [
        ResourceInfo(
            name=f"wheel_odometry_{index}", subscribes=f"/fleet/robot_{index}/drivers/wheel_odometry"
        )
        for index in range(40)
    ]
    lines = _printed(ListComponents.Response(components=parts, resources=resources), width=width)
    assert max(len(line) for line in lines) <= width
    letters = "".join("".join(line.split()) for line in lines)
    if width == 160:  # nothing is folded there
        for index in range(40):
            assert f"{name.format(index)}.wheel_odometry_input" in letters
            assert f"/fleet/robot_{index}/drivers/wheel_odometry" in letters
    assert "…" not in letters


def test_states_are_those_of_the_message() -> None:
    for number, name in STATES.items():
        assert getattr(ComponentInfo, name) == number
        assert COMPONENT_STATES[name] == number
    assert len(COMPONENT_STATES) == len(STATES)


def test_a_state_that_lasts_is_told_against_period_and_bound() -> None:
    def part(name: str, age_ns: int, **fields: object) -> ComponentInfo:
        return ComponentInfo(
            name=name,
            period_ns=10_000_000,
            current_state="Act",
            state_age_ns=age_ns,
            hung_after_ns=1_000_000_000,
            **fields,
        )

    parts = [
        part("well", 9_000_000),
        part("late", 20_000_000, state_bound_ns=50_000_000),
        part("stuck", 2_500_000_000, hung=True),
        part("starved", 2_500_000_000, hung=True, waiting=True),
    ]
    told = [line for line in _printed(ListComponents.Response(components=parts)) if "hung" in line]
    assert told == [
        "late: state Act has lasted 0.02 s (period 0.01 s, declared bound 0.05 s, hung from 1 s on)",
        "stuck: hung: state Act has lasted 2.5 s (period 0.01 s, hung from 1 s on)",
        "starved: hung: wait Act is 2.5 s past its instant (period 0.01 s, hung from 1 s on)",
    ]


def test_enforced_worst_cases_are_named() -> None:
    states = [
        StateInfo(name="Run", wcet_enforced=True),
        StateInfo(name="More", wcet_enforced=True),
        StateInfo(name="Pause", is_wait=True),
    ]
    parts = [ComponentInfo(name="control", states=states), ComponentInfo(name="other", states=states[2:])]
    told = [line for line in _printed(ListComponents.Response(components=parts)) if "enforced" in line]
    assert told == ["control: wcet_ns is enforced of Run, More"]


def test_a_limit_of_an_output_is_told() -> None:
    limits = [
        SlewLimit(output="command.torque", max_slew=20.0, limited=37, not_limited=1),
        SlewLimit(output="command.axes[0]", max_slew=0.5, limited=1),
    ]
    parts = [ComponentInfo(name="control", slew_limits=limits)]
    first, second = [
        line for line in _printed(ListComponents.Response(components=parts)) if "per second" in line
    ]
    counts = "37 writes limited, 1 value of a stop written at once"
    assert first == f"control: command.torque changes by at most 20 per second: {counts}"
    assert second == "control: command.axes[0] changes by at most 0.5 per second: 1 write limited"


def test_mirrors_of_a_resource() -> None:
    resource = ResourceInfo(name="pose", publishes="/pose", mirrors=["/x/mirror/pose", "/heading"])
    lines = _printed(ListComponents.Response(resources=[resource]))
    assert [line.split()[-2:] for line in lines if "/" in line] == [
        ["publishes", "/pose"],
        ["mirrors", "/x/mirror/pose"],
        ["mirrors", "/heading"],
    ]


def test_what_rules_and_persons_have_their_hand_on() -> None:
    held = [
        HeldElement(
            target="one",
            element="core",
            base="replace_core one p/Usual",
            wanted="replace_core one p/Safe",
            holder="rule quiet",
            rules=["quiet"],
        ),
        HeldElement(target="two", element="state", base="", wanted="stop two", holder="stop"),
    ]
    lines = _printed(ListComponents.Response(held=held), width=200)
    assert lines[:2] == [
        "one: core held by rule quiet: replace_core one p/Safe; without rules: replace_core one p/Usual",
        "two: state held by a person, who stopped it: stop two; without rules: not known",
    ]


def test_each_job_has_its_bound_beside_the_longest_measured_response() -> None:
    figures = {"until": "Pause", "states": ["Act"], "bound_ns": 3_000_000}
    bounds = [
        JobBound(after="Act", **figures),
        JobBound(after="Pause", longest_ns=2_500_000, jobs=9, **figures),
        JobBound(after="Event", longest_ns=4_000_000, jobs=9, violations=2, **figures),
    ]
    lines = _printed(ListComponents.Response(components=[ComponentInfo(name="control", bounds=bounds)]))
    jobs = [line.split()[1:] for line in lines if "->" in line]
    assert jobs == [
        ["Pause", "->", "Act", "->", "Pause", "2.5", "ms", "3", "ms", "0"],
        ["Event", "->", "Act", "->", "Pause", "4", "ms", "3", "ms", "2"],
    ], "a first job after a start is shown once there was one"
