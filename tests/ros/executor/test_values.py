"""Values of an executor, seen from outside while it runs: by ~/read_values, ~/mirror and their verbs."""

import csv
import io
import json
import math
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import Point
from mcap.reader import make_reader
from rclpy.qos import DurabilityPolicy, QoSProfile
from ros_processes import PATIENCE_S
from rosbags.highlevel import AnyReader
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Float64

import mauve_rt.trace
from mauve_msgs.msg import ReplyCode, Value, ValueNames, Values
from mauve_msgs.srv import ListComponents, ListRules, Mirror, ReadValues, Reconfigure, StartRecording
from mauve_rt._kernel import Simulation
from mauve_rt.errors import ArchitectureFileError
from mauve_rt.model import load_architecture
from mauve_rt.simulation.executor import SimulatedExecutor
from mauve_rt.simulation.topics import SimulatedTopics
from mauve_rt.trace.format.message_decoding import Decoder

NODE = "/robot_1/executor"
ARCHITECTURE = """\
mauve: 1
executor:
  namespace: /robot_1
  record: [queue, pilot.latest]
  mirror: [place, {name: pilot.latest, field: data, topic: level, rate_hz: 20}]
components:
  pilot: {shell: executor_tests/PilotShell, core: executor_tests/Pilot, fsm: executor_tests/PilotFsm}
  caller: {shell: executor_tests/CallerShell, core: executor_tests/Caller, fsm: executor_tests/CallerFsm}
resources:
  attitude: {kind: shared_data, type: executor_tests/Attitude}
  place: {kind: shared_data, type: geometry_msgs/msg/Point}
  latest: {kind: latest_value, type: std_msgs/msg/Float64}
  queue: {kind: ring_buffer, type: std_msgs/msg/Float64, capacity: 5}
  beat: {kind: event}
  scan: {kind: shared_data, type: sensor_msgs/msg/LaserScan}
  words: {kind: ring_buffer, type: std_msgs/msg/String, capacity: 3,
          topic: {name: words, direction: subscribe}}
  lamp: {kind: executor_tests/Lamp}
connections:
  - [pilot.attitude, attitude.write]
  - [pilot.felt, attitude.read]
  - [pilot.place, place.write]
  - [pilot.latest, latest.write]
  - [pilot.queue, queue.write]
  - [pilot.beat, beat.raise]
  - [caller.lamp, lamp.set]
"""
NAMES = [
    *("roll", "rates[0]", "rates[1]", "rates[2]", "origin.x", "origin.y", "origin.z"),
    *("corners[0].x", "corners[0].y", "corners[0].z", "corners[1].x", "corners[1].y", "corners[1].z"),
    *("codes.length", "level", "round"),
]
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


@pytest.fixture
def running(start_executor: Callable[..., Any], tmp_path: Path, graph: Any) -> Any:
    path = tmp_path / "robot.yaml"
    path.write_text(ARCHITECTURE, encoding="utf-8")
    process = start_executor("-p", f"architecture:={path}", "-p", f"bags:={tmp_path}")
    graph.spin_until(lambda: graph.node.count_services(f"{NODE}/list_parameters") > 0, "all services")
    return process


@pytest.fixture
def mauve(domain: int, running: Any) -> Callable[..., subprocess.CompletedProcess[str]]:
    assert running.process.poll() is None
    environment = {**os.environ, "ROS_DOMAIN_ID": str(domain)}

    def run(*words: str, until: str = "", lines: int = 0) -> subprocess.CompletedProcess[str]:
        """`until`: Ctrl-C when this was printed; `lines`: when so many were."""
        command = [sys.executable, "-m", "mauve_rt.cli", *words]
        process = subprocess.Popen(
            command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        out = ""
        if until or lines:
            assert process.stdout is not None
            for number, line in enumerate(process.stdout, start=1):
                out += line
                if number == lines or (until and until in line):
                    break
            process.send_signal(2)
        rest, err = process.communicate(timeout=200)
        return subprocess.CompletedProcess(command, process.returncode, out + rest, err)

    return run


def ask(graph: Any, *names: str) -> list[Any]:
    return list(graph.ask(ReadValues, f"{NODE}/read_values", names=names, with_definitions=True).values)


def decoded(value: Any) -> Any:
    assert value.problem == ""
    return Decoder(value.type, value.definition).decode(bytes(value.data))


def test_values_of_every_kind_by_resource_and_by_port(running: Any, graph: Any) -> None:
    del running
    names = ("attitude", "pilot.attitude", "pilot.felt", "place", "latest", "queue", "beat")
    graph.spin_until(lambda: all(value.status == Value.WRITTEN for value in ask(graph, *names)), "values")
    for value in ask(graph, *names):
        message = decoded(value)
        assert (value.problem, value.status) == ("", Value.WRITTEN), value.name
        assert value.writes > 0
        assert value.age_ns >= 0
        if value.resource == "attitude":
            assert (message.roll, message.round) == (value.writes / 2, value.writes)
            assert list(message.rates) == [0.5, value.writes, -1.5]
            assert message.corners[1].z == message.round
            assert (len(message.codes), message.mode) == (message.round % 3, "cruise")
        elif value.resource == "beat":
            assert message.data == value.writes
        elif value.resource == "place":
            assert (message.x, message.z) == (value.writes / 2, -1.0)
        elif value.resource == "latest":
            assert message.data == value.writes / 2
        else:  # nobody reads the queue: its newest element is the last that found room
            assert (message.data, value.writes) == (2.5, 5)


def test_a_look_takes_nothing_away(running: Any, graph: Any) -> None:
    del running
    first = ask(graph, "queue")[0]
    assert [ask(graph, "queue")[0].data for _ in range(3)] == [first.data] * 3


def test_a_request_reads_a_limited_number_of_values(running: Any, graph: Any) -> None:
    del running
    reply = graph.ask(ReadValues, f"{NODE}/read_values", names=["place"] * 258)
    problems = [value.problem for value in reply.values]
    assert problems[:256] == [""] * 256
    assert [text.partition(";")[0] for text in problems[256:]] == ["a request reads at most 256 values"] * 2


def test_nothing_was_written_yet(running: Any, graph: Any) -> None:
    del running
    scan, words = ask(graph, "scan", "words")
    assert (scan.status, scan.writes, scan.age_ns) == (Value.NONE, 0, 0)
    assert len(decoded(scan).ranges) == 0
    assert (words.status, decoded(words).data) == (Value.NONE, "")


@pytest.mark.parametrize(
    ("name", "problem"),
    [
        ("atitude", "no resource or port is named 'atitude'; did you mean attitude?"),
        ("pilot.atitude", "no resource or port is named 'pilot.atitude'; did you mean pilot.attitude?"),
        (
            "caller.count",
            "port caller.count is connected to no resource, so it has no value; connect it first",
        ),
        ("caller.lamp", "caller.lamp is a call port, which has no value; choose a read, write or event port"),
        (
            "lamp",
            (
                "resource lamp is of kind executor_tests/Lamp, which has no value to show; "
                "choose a shared_data, latest_value, ring_buffer or event"
            ),
        ),
    ],
)
def test_names_without_a_value_are_told(
    running: Any, graph: Any, mauve: Callable[..., Any], name: str, problem: str
) -> None:
    del running
    assert [value.problem for value in ask(graph, name, "place")] == [problem, ""]
    for verb in ("echo", "mirror"):
        done = mauve(verb, NODE, name)
        assert (done.returncode, done.stdout) == (1, "")
        assert done.stderr.splitlines()[-1] == f"refused: {problem}"


def test_echo(mauve: Callable[..., Any], graph: Any) -> None:
    graph.spin_until(lambda: ask(graph, "place")[0].writes > 0, "a value")
    once = mauve("echo", NODE, "attitude", "--once")
    assert (once.returncode, once.stderr) == (0, "")
    assert " new, age " in once.stdout
    assert "\n  origin.x: 1.0\n" in once.stdout
    assert "\n  mode: cruise\n" in once.stdout
    field = mauve("echo", NODE, "pilot.felt", "--once", "--field", "corners[1].y")
    assert field.stdout.splitlines()[1:] == ["  corners[1].y: 8.0"]
    followed = mauve("echo", NODE, "place", "--rate", "50", until="z: -1.0")
    assert followed.returncode == 0
    told = "place: polled 50 times a second: writes between two polls are counted, not shown\n"
    assert followed.stderr == told
    counted = mauve("echo", NODE, "place", "--rate", "20", until="writes since the last poll are not shown")
    assert counted.returncode == 0, "the component writes 100 times a second"
    scan = mauve("echo", NODE, "scan", "--once")
    assert (scan.returncode, scan.stdout) == (1, "")
    assert scan.stderr == "scan (sensor_msgs/msg/LaserScan): nothing was written yet\n"
    wrong = mauve("echo", NODE, "place", "--once", "--field", "xx")
    assert wrong.returncode == 1
    assert wrong.stderr == (
        "refused: no field 'xx' in 'xx'; expected one of x, y, z (of geometry_msgs/msg/Point)\n"
    )
    for rate in ("0", "-1", "201", "fast"):
        bad = mauve("echo", NODE, "place", "--rate", rate)
        assert bad.returncode == 2
        assert "expected Hz above 0 and at most 200" in bad.stderr


def test_echo_as_a_table(mauve: Callable[..., Any]) -> None:
    done = mauve("echo", NODE, "place", "--csv", "--rate", "50", lines=20)
    rows = list(csv.DictReader(io.StringIO(done.stdout)))
    assert [*rows[0]] == ["time_ns", "monotonic_ns", "age_ns", "writes", "x", "y", "z"]
    written = [row for row in rows if row["writes"] != "0" and None not in row.values()]
    assert len(written) > 2
    assert all(float(row["x"]) == int(row["writes"]) / 2 for row in written)
    counts = [int(row["writes"]) for row in written]
    assert counts == sorted(counts)


def test_mirrors_of_the_file(running: Any, graph: Any) -> None:
    del running
    place = graph.hear(Point, f"{NODE}/mirror/place")
    level = graph.hear(Float64, "/robot_1/level")
    graph.spin_until(lambda: len(place) > 5 and len(level) > 5, "mirrored values")
    assert all(each.z == -1.0 for each in place)
    for heard in ([each.x for each in place], [each.data for each in level]):
        assert heard == sorted(set(heard)), "each value once, in order"
    reply = graph.ask(ListComponents, f"{NODE}/list_components")
    mirrors = {each.name: list(each.mirrors) for each in reply.resources if each.mirrors}
    assert mirrors == {"place": [f"{NODE}/mirror/place"], "latest": ["/robot_1/level"]}


def test_a_mirror_of_an_own_struct(running: Any, graph: Any) -> None:
    del running
    done = graph.ask(Mirror, f"{NODE}/mirror", name="pilot.attitude", rate_hz=200.0)
    topic = f"{NODE}/mirror/pilot/attitude"
    assert (done.success, list(done.topics)) == (True, [topic, f"{topic}/names"]), done.message
    assert done.type == "mauve_msgs/msg/Values"
    heard = graph.hear(Values, topic)
    names = graph.hear(ValueNames, f"{topic}/names", LATCHED)
    graph.spin_until(lambda: len(heard) > 5 and bool(names), "values and their names")
    assert (names[0].type, list(names[0].names)) == ("executor_tests/Attitude", NAMES)
    assert len(names) == 1
    for message in heard:
        values = dict(zip(NAMES, message.values, strict=True))
        assert values["roll"] == values["round"] / 2
        assert (values["corners[1].y"], values["corners[1].z"]) == (8.0, values["round"])
        assert values["codes.length"] == values["round"] % 3
        assert values["level"] == (values["round"] % 2 == 0)
    stamps = [message.stamp.sec * 10**9 + message.stamp.nanosec for message in heard]
    assert stamps == sorted(stamps)
    assert abs(stamps[-1] - time.time_ns()) < PATIENCE_S * 1e9
    again = graph.ask(Mirror, f"{NODE}/mirror", name="pilot.attitude", rate_hz=200.0)
    assert (again.success, list(again.topics)) == (True, list(done.topics)), "it stays as it is"
    ended = graph.ask(Mirror, f"{NODE}/mirror", stop=True, name="pilot.attitude")
    assert (ended.success, list(ended.topics)) == (True, [topic, f"{topic}/names"])
    graph.spin_until(lambda: graph.node.count_publishers(topic) == 0, "its end")


def test_a_mirror_of_one_element_of_a_sequence(running: Any, graph: Any) -> None:
    del running
    heard = {}
    for path in ("codes[1]", "codes.length", "corners[1].z", "rates[1]"):
        done = graph.ask(Mirror, f"{NODE}/mirror", name="attitude", field=path, rate_hz=200.0)
        assert (done.success, done.type) == (True, "std_msgs/msg/Float64"), done.message
        heard[path] = next(graph.hear(Float64, topic) for topic in done.topics)
    graph.spin_until(lambda: all(len(each) > 20 for each in heard.values()), "numbers")
    lengths = {each.data for each in heard["codes.length"]}
    assert lengths == {0.0, 1.0, 2.0}
    elements = [each.data for each in heard["codes[1]"]]
    assert any(math.isnan(each) for each in elements), "a shorter list has no such element"
    assert any(not math.isnan(each) for each in elements)
    assert all(each.data > 0 for each in heard["rates[1]"])


def test_rules_of_the_executor_take_elements_of_bounded_lists(
    start_executor: Callable[..., Any], tmp_path: Path, graph: Any
) -> None:
    (tmp_path / "robot.yaml").write_text(ARCHITECTURE, encoding="utf-8")
    fields = {"length": "codes.length, above: 1.5", "beyond": "'codes[3]', above: 1000"}
    rules = "".join(
        f"  - {{name: {name}, when: {{value: {{resource: attitude, field: {field}}}}}, "
        "do: [{kind: stop, target: caller}]}\n"
        for name, field in fields.items()
    )
    (tmp_path / "rules.yaml").write_text(f"mauve: 1\nrules:\n{rules}", encoding="utf-8")
    files = ("-p", f"architecture:={tmp_path / 'robot.yaml'}", "-p", f"rules:={tmp_path / 'rules.yaml'}")
    start_executor(*files)

    def held() -> set[str]:
        found = graph.ask(ListRules, f"{NODE}/list_rules").rules
        assert [each.problem for each in found] == [""] * 2
        return {each.name for each in found if each.known and each.holds}

    graph.spin_until(lambda: "length" in held(), "a list of two codes")
    graph.spin_until(lambda: "beyond" in held(), "no number where the list has no fourth code")


def test_get_prints_a_property_or_a_field(mauve: Callable[..., Any], graph: Any) -> None:
    graph.spin_until(lambda: ask(graph, "attitude")[0].writes > 0, "a value")
    for name, printed in (
        ("attitude.mode", "cruise"),
        ("attitude.corners[1].y", "8.0"),
        ("pilot.attitude.rates.length", "3"),
        ("caller.period_ms", None),
    ):
        done = mauve("get", NODE, name)
        assert (done.returncode, done.stderr) == (0, ""), name
        assert printed is None or done.stdout == f"{printed}\n"
    whole = json.loads(mauve("get", NODE, "place", "--json").stdout)
    assert sorted(whole) == ["x", "y", "z"]
    for name, problem in (
        ("plase", "no property, resource or port is named 'plase'; did you mean place?"),
        ("place.w", "no field 'w' in 'w'; expected one of x, y, z"),
        ("scan", "scan (sensor_msgs/msg/LaserScan): nothing was written yet"),
    ):
        refused = mauve("get", NODE, name)
        assert (refused.returncode, refused.stdout, refused.stderr) == (1, "", f"refused: {problem}\n")


def test_a_mirror_ends_with_its_resource(running: Any, graph: Any) -> None:
    del running
    assert graph.ask(Mirror, f"{NODE}/mirror", name="scan").success
    topic = f"{NODE}/mirror/scan"
    graph.spin_until(lambda: graph.node.count_publishers(topic) == 1, "a mirror")
    steps = [{"kind": "remove_resource", "target": "scan"}]
    reply = graph.ask(Reconfigure, f"{NODE}/reconfigure", steps=[_step(**step) for step in steps])
    assert reply.success, reply.message
    graph.spin_until(lambda: graph.node.count_publishers(topic) == 0, "its end")
    gone = graph.ask(Mirror, f"{NODE}/mirror", stop=True, name="scan")
    assert (gone.success, gone.message) == (
        False,
        "there is no mirror of scan; known: pilot.latest, place",
    )


def _step(**fields: str) -> Any:
    from mauve_msgs.msg import ReconfigurationStep  # noqa: PLC0415

    return ReconfigurationStep(**fields)


@pytest.mark.parametrize(
    ("request_", "message"),
    [
        ({"name": "place", "rate_hz": -1.0}, "rate: expected Hz above 0 and at most 1000, found -1"),
        ({"name": "place", "field": "w"}, "geometry_msgs/msg/Point has no number 'w'; known: x, y, z"),
        ({"name": "place", "topic": "/robot_1/words"}, "topic /robot_1/words is bound already"),
        ({"name": "place", "topic": "/robot_1/level"}, "topic /robot_1/level is bound already"),
        ({"name": "place", "topic": "/taken"}, "topic /taken has "),
        ({"name": "place", "topic": "no name"}, "topic 'no name': "),
        ({"name": "scan", "field": "ranges"}, "sensor_msgs/msg/LaserScan has no number 'ranges'"),
        ({"name": "scan", "field": "ranges[x]"}, "sensor_msgs/msg/LaserScan has no number 'ranges[x]'"),
        ({"name": "words", "field": "data"}, "std_msgs/msg/String has no number 'data'; mauve echo shows"),
    ],
)
def test_mirrors_that_cannot_be(running: Any, graph: Any, request_: dict[str, Any], message: str) -> None:
    del running
    taken = graph.node.create_publisher(Float64, "/taken", 1)
    assert taken is not None
    if request_.get("topic") == "/taken":
        for _ in range(100):  # until the executor knows the other publisher
            reply = graph.ask(Mirror, f"{NODE}/mirror", **request_)
            if not reply.success:
                break
            assert graph.ask(Mirror, f"{NODE}/mirror", stop=True, topic="/taken").success
    else:
        reply = graph.ask(Mirror, f"{NODE}/mirror", **request_)
    assert (reply.success, list(reply.topics)) == (False, [])
    assert reply.message.startswith(message)


def test_the_command_starts_and_stops_a_mirror(mauve: Callable[..., Any], graph: Any) -> None:
    started = mauve("mirror", NODE, "pilot.place", "--field", "x", "--topic", "height")
    assert (started.returncode, started.stderr) == (0, "")
    assert started.stdout == (
        "pilot.place is published on /robot_1/height (std_msgs/msg/Float64), at most 50 times a second\n"
    )
    heard = graph.hear(Float64, "/robot_1/height")
    graph.spin_until(lambda: len(heard) > 3, "heights")
    stopped = mauve("mirror", NODE, "--stop", "--topic", "height")
    assert (stopped.returncode, stopped.stdout) == (0, "stopped: /robot_1/height\n")
    everything = mauve("mirror", NODE, "--stop")
    assert everything.returncode == 0
    assert sorted(everything.stdout.removeprefix("stopped: ").strip().split(", ")) == [
        f"{NODE}/mirror/place",
        "/robot_1/level",
    ]
    none = mauve("mirror", NODE, "--stop")
    assert (none.returncode, none.stderr) == (1, "refused: there is no mirror\n")
    nothing = mauve("mirror", NODE)
    assert (nothing.returncode, nothing.stderr) == (
        2,
        "mauve: name a resource, or COMPONENT.PORT (see mauve list)\n",
    )


def recorded(bag: Path) -> dict[str, list[Any]]:
    """The messages of each topic of values, as rosbags decodes them by the definitions in the bag."""
    found: dict[str, list[Any]] = {}
    with AnyReader([bag]) as reader:
        for connection, _, data in reader.messages():
            if "/values/" in connection.topic:
                name = connection.topic.removeprefix(f"{NODE}/values/")
                found.setdefault(name, []).append(reader.deserialize(data, connection.msgtype))
    return found


def assert_each_write(values: dict[str, list[Any]], *, least: int) -> None:
    """Of the pilot's: not one is missing between the first and the last."""
    assert set(values) == {"attitude", "queue", "latest"}
    rounds = [message.round for message in values["attitude"]]
    assert len(rounds) > least
    assert rounds == list(range(rounds[0], rounds[0] + len(rounds)))
    assert all(message.roll == message.round / 2 for message in values["attitude"])
    assert all(message.mode == "cruise" for message in values["attitude"])
    rolls = [2 * message.data for message in values["latest"]]
    assert rolls == [rolls[0] + number for number in range(len(rolls))]
    assert len(rolls) > least


def test_every_write_is_recorded(running: Any, graph: Any, mauve: Callable[..., Any], tmp_path: Path) -> None:
    del running
    started = mauve("record", "start", NODE, "flight", "--value", "pilot.attitude")
    assert (started.returncode, started.stderr) == (0, "")
    begun = ask(graph, "latest")[0].writes
    graph.spin_until(lambda: ask(graph, "latest")[0].writes > begun + 150, "150 more writes")
    stopped = mauve("record", "stop", NODE)
    assert stopped.returncode == 0, stopped.stderr
    assert "were dropped" not in stopped.stdout
    values = recorded(tmp_path / "flight")
    values.setdefault("queue", [])  # nobody reads it: it was full before
    assert_each_write(values, least=150)
    with (tmp_path / "flight" / "flight_0.mcap").open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    schemas = {schema.name: schema.data.decode() for schema in summary.schemas.values()}
    assert "float32[3] rates" in schemas["executor_tests/msg/Attitude"]
    trace = mauve_rt.trace.open(tmp_path / "flight")
    assert trace.lost == 0
    assert len(list(trace.messages(f"{NODE}/values/attitude"))) == len(values["attitude"])


def test_every_write_is_recorded_in_virtual_time(tmp_path: Path, plugin_prefix: Path) -> None:
    del plugin_prefix
    path = tmp_path / "robot.yaml"
    path.write_text(ARCHITECTURE.replace("record: [", "record: [attitude, "), encoding="utf-8")
    simulation = Simulation()
    executor = SimulatedExecutor(simulation, SimulatedTopics(), path, tmp_path / "bag", complain=pytest.fail)
    simulation.deploy()
    executor.activate()
    for second in (1, 2):
        simulation.run_until(simulation.epoch_ns() + second * 10**9)
        executor.record()
    executor.close()
    values = recorded(tmp_path / "bag")
    ends = [values[name].pop() for name in ("attitude", "latest")]
    assert [ends[0].round, ends[1].data] == [0, 0.0], "the safe outputs of the stop"
    assert_each_write(values, least=199)
    assert values["attitude"][0].round == 1
    assert [message.data for message in values["queue"]] == [0.5, 1.0, 1.5, 2.0, 2.5]


def test_a_recording_goes_on_whatever_takes_the_name(
    running: Any, graph: Any, mauve: Callable[..., Any], tmp_path: Path
) -> None:
    """A resource without values, then one with values again."""
    del running
    assert mauve("record", "start", NODE, "flight", "--value", "scan", "--value", "latest").returncode == 0

    def become(value: str) -> None:
        steps = [_step(kind="remove_resource", target="scan")]
        steps.append(_step(kind="add_resource", target="scan", value=value))
        reply = graph.ask(Reconfigure, f"{NODE}/reconfigure", steps=steps)
        assert reply.success, reply.message
        begun = ask(graph, "latest")[0].writes
        graph.spin_until(lambda: ask(graph, "latest")[0].writes > begun + 50, "some flushes")

    become("{kind: executor_tests/Lamp}")
    become("{kind: shared_data, type: sensor_msgs/msg/LaserScan, topic: {name: scan, direction: subscribe}}")
    voice = graph.voice(LaserScan, "/robot_1/scan")
    voice.publish(LaserScan(range_max=7.0))
    graph.spin_until(lambda: ask(graph, "scan")[0].writes > 0, "the scan")
    stopped = mauve("record", "stop", NODE)
    assert stopped.returncode == 0, stopped.stderr
    assert "ended by itself" not in stopped.stdout
    values = recorded(tmp_path / "flight")
    assert [message.range_max for message in values["scan"]] == [7.0]
    rolls = [2 * message.data for message in values["latest"]]
    assert rolls == [rolls[0] + number for number in range(len(rolls))]
    assert len(rolls) > 100


@pytest.mark.parametrize(
    ("value", "problem"),
    [
        ("atitude", "value to record: no resource or port is named 'atitude'; did you mean attitude?"),
        ("lamp", "value to record: resource lamp is of kind executor_tests/Lamp, which has no value to show"),
    ],
)
def test_a_value_that_cannot_be_recorded_starts_nothing(
    running: Any, graph: Any, tmp_path: Path, value: str, problem: str
) -> None:
    del running
    reply = graph.ask(StartRecording, f"{NODE}/start_recording", bag="none", values=[value])
    assert (reply.success, reply.code) == (False, ReplyCode.INVALID)
    assert reply.message.startswith(problem)
    assert not (tmp_path / "none").exists()


def test_a_file_that_names_values_that_are_not_there(tmp_path: Path) -> None:
    path = tmp_path / "robot.yaml"
    text = ARCHITECTURE.replace("record: [queue", "record: [queu").replace("[place,", "[plac,")
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ArchitectureFileError) as raised:
        load_architecture(path)
    lines = raised.value.lines()
    assert any("there is no value 'queu'" in line and "did you mean queue?" in line for line in lines)
    assert any("there is no value 'plac'" in line for line in lines)
