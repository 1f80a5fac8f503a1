"""Architecture files: what is read from good ones, and the one line that each bad one gets."""

from pathlib import Path

import pytest

from mauve_rt._kernel import Architecture, PluginRegistry
from mauve_rt.errors import ArchitectureFileError, MauveError
from mauve_rt.model import Overrides, build, configure, load_architecture
from mauve_rt.model.graph import architecture_graph

GOOD = """\
mauve: 1
executor: {namespace: /robot_1, peers: [robot_2, robot_3]}
components:
  source: {shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm,
           alternatives: [executor_tests/Backwards], priority: 40, cpus: [0], offset_ms: 2.5,
           properties: {step: 2, list_file: lists/a.txt, label: "$(name) of $(peers)"}}
  sink:
    shell: executor_tests/CounterShell
    core: executor_tests/Counter
    fsm: executor_tests/CounterFsm
    reconfigurable: false
resources:
  count: {kind: shared_data, type: std_msgs/msg/Float64,
          topic: {name: count, direction: publish, qos: reliable}}
  queue: {kind: ring_buffer, type: std_msgs/msg/Float64, capacity: 4}
connections:
  - [source.count, count.write]
  - [sink.set, count.read]
"""
TOPIC = "type: std_msgs/msg/Float64,\n          topic: {name: count, direction"
REGISTRY = PluginRegistry()

# what is replaced, by what; then what stands at the place that the message names, and a part of the message
BAD = {
    "version": ("mauve: 1", "mauve: 2", "2", "bad mauve: expected 1, found 2"),
    "no version": ("mauve: 1\n", "", "executor:", "the file has no 'mauve'"),
    "top key": ("resources:", "resorces:", "resorces:", "unknown key 'resorces'; did you mean resources?"),
    "key": (
        "priority: 40",
        "prioritty: 40",
        "prioritty: 40",
        "unknown key 'prioritty' of component 'source'; did you mean",
    ),
    "executor key": (
        "peers:",
        "peer:",
        "peer: [robot_2",
        "unknown key 'peer' in 'executor'; did you mean peers?",
    ),
    "diagnostics key": (
        "priority: 40",
        "diagnostics: {overrun: {warn: 1}}",
        "overrun: {warn",
        "unknown key 'overrun' in diagnostics of component 'source'; did you mean overruns?",
    ),
    "threshold key": (
        "peers: [robot_2, robot_3]",
        "diagnostics: {skipped: {wran: 1}}",
        "wran: 1",
        "unknown key 'wran' in 'executor.diagnostics.skipped'; did you mean warn?",
    ),
    "threshold": (
        "priority: 40",
        "diagnostics: {wakeup_max_us: {warn: 0}}",
        "0}}",
        "bad warn in diagnostics.wakeup_max_us of component 'source': expected more than 0, found 0",
    ),
    "threshold order": (
        "priority: 40",
        "diagnostics: {overruns: {warn: 5, error: 2}}",
        "overruns: {warn",
        "bad overruns in diagnostics of component 'source': expected an error that is no less than warn",
    ),
    "threshold of nothing": (
        "priority: 40",
        "diagnostics: {overruns: {}}",
        "overruns: {}",
        "bad overruns in diagnostics of component 'source': expected warn or error or both of them",
    ),
    "duplicate key": ("  sink:\n", "  source:\n", "source:", "key 'source' given twice"),
    "missing key": ("    core: executor_tests/Counter\n", "", "sink:", "component 'sink' has no 'core'"),
    "unknown component": (
        "[sink.set",
        "[sinc.set",
        "sinc.set",
        "unknown component 'sinc'; did you mean sink?",
    ),
    "unknown port": (
        "[sink.set",
        "[sink.sett",
        "sink.sett",
        "component 'sink' has no port 'sett'; did you mean set?",
    ),
    "unknown resource": (
        "set, count.",
        "set, cuont.",
        "cuont.read",
        "unknown resource 'cuont'; did you mean count?",
    ),
    "unknown service": (
        "count.read",
        "count.reed",
        "count.reed",
        "has no service 'reed'; did you mean read?",
    ),
    "wrong direction": (
        "count.read",
        "count.write",
        "count.write",
        "kind read and type std_msgs/msg/Float64, found one of kind write",
    ),
    "wrong type": (
        "set, count.read",
        "set, point.read",
        "point.read",
        "type std_msgs/msg/Float64, found one of kind read and type geo",
    ),
    "half a connection": (
        "[sink.set, count.read]",
        "[sink.set]",
        "[sink.set]",
        "bad connection 2: expected at least 2",
    ),
    "no connection": (
        "[sink.set, count.read]",
        "sink",
        "sink",
        "bad connection 2: expected a list, found 'sink'",
    ),
    "connected twice": (
        "[sink.set,",
        "[source.count,",
        "source.count",
        "port 'source.count' is connected twice",
    ),
    "unknown property": (
        "step: 2",
        "stepp: 2",
        "stepp: 2",
        "unknown property 'stepp' of component 'source'; did you mean step?",
    ),
    "property type": (
        "step: 2",
        "step: two",
        "two",
        "bad property 'step' of component 'source': expected a number",
    ),
    "property range": ("step: 2", "step: 11", "11", "expected at least 0 and at most 10, found 11"),
    "property nan": ("step: 2", "step: .nan", ".nan", "found nan"),
    "property list": (
        "step: 2",
        "step: [2]",
        "step: [2",
        "expected true, false, a number or text, found a list of 1",
    ),
    "text property": (
        'label: "$(name) of $(peers)"',
        "label: 5",
        "5",
        "expected text, found 5; put it in quotes",
    ),
    "priority 0": (
        "priority: 40",
        "priority: 0",
        "0",
        "bad priority of component 'source': expected at least 1, found 0",
    ),
    "priority 99": (
        "priority: 40",
        "priority: 99",
        "99",
        "at most 98, found 99; 1 is the lowest, 98 the highest; 99 is kept",
    ),
    "priority text": ("priority: 40", "priority: high", "high", "expected a whole number, found 'high'"),
    "cpu": (
        "cpus: [0]",
        "cpus: [0, 4000]",
        "4000",
        "a CPU that this machine does not have: expected one of 0",
    ),
    "no such cpu of the sender": (
        "peers: [robot_2, robot_3]",
        "sender: {cpus: [4000]}",
        "4000",
        "executor's sender asks for a CPU that this machine does not have: expected one of 0",
    ),
    "sender key": (
        "peers: [robot_2, robot_3]",
        "sender: {prioritty: 1}",
        "prioritty: 1",
        "unknown key 'prioritty' in 'executor.sender'; did you mean priority?",
    ),
    "no cpu": (
        "cpus: [0]",
        "cpus: []",
        "cpus: [",
        "bad cpus of component 'source': expected at least 1 of them",
    ),
    "overrun": ("offset_ms: 2.5", "overrun: skp", "skp", "expected skip, catch_up or fault, found 'skp'"),
    "negative offset": ("offset_ms: 2.5", "offset_ms: -1", "-1", "expected at least 0, found -1"),
    "loop without a wait": (
        "executor_tests/CounterFsm,\n",
        "executor_tests/LoopFsm,\n",
        "executor_tests/LoopFsm",
        "Count",
    ),
    "fallback": (
        "priority: 40",
        "fallback: executor_tests/Backwrds",
        "executor_tests/Backwrds",
        "core 'executor_tests/Backwrds' is not installed; did you mean executor_tests/Backwards?",
    ),
    "fallback for another shell": (
        "priority: 40",
        "fallback: executor_tests/Twin",
        "executor_tests/Twin",
        "does not fit component 'source': expected one written for shell executor_tests/CounterShell",
    ),
    "alternative for another shell": (
        "[executor_tests/Backwards]",
        "[executor_tests/TwinFsm]",
        "executor_tests/TwinFsm",
        "'executor_tests/TwinFsm' does not fit component 'source'",
    ),
    "trace records": (
        "priority: 40",
        "trace_records: 1",
        "1",
        "bad trace_records of component 'source': expected at least 2, found 1",
    ),
    "unknown class": (
        "executor_tests/Backwards",
        "executor_tests/Backward",
        "executor_tests/Backward",
        "is not installed; did you mean executor_tests/Backwards?",
    ),
    "no class name": (
        "executor_tests/Backwards",
        "Backwards",
        "Backwards",
        "expected package/Class, found 'Backwards'",
    ),
    "not in the library": (
        "executor_tests/Backwards",
        "executor_tests/Missing",
        "executor_tests/Missing",
        "has no core 'executor_tests/Missing'",
    ),
    "not in the module": (
        "executor_tests/Backwards",
        "executor_tests/PyMissing",
        "executor_tests/PyMissing",
        "cannot load executor_tests_cores:Nobody",
    ),
    "shell of another": (
        "shell: executor_tests/CounterShell\n",
        "shell: executor_tests/OtherShell\n",
        "executor_tests/Counter",
        "does not fit component 'sink'",
    ),
    "alternatives": (
        "[executor_tests/Backwards]",
        "all",
        "all",
        "a list of cores, fsms and shells, or the word installed, found 'all'",
    ),
    "resource kind": (
        "kind: ring_buffer",
        "kind: ringbuffer",
        "ringbuffer",
        "expected shared_data, ring_buffer, latest_value, event, client or",
    ),
    "ring without capacity": (
        ", capacity: 4",
        "",
        "queue: {kind: ring_buffer",
        "resource 'queue' has no capacity",
    ),
    "ring of nothing": (
        "capacity: 4",
        "capacity: 0",
        "0",
        "bad capacity of resource 'queue': expected at least 1, found 0",
    ),
    "capacity of shared data": (
        "count: {kind: shared_data",
        "count: {capacity: 2, kind: shared_data",
        "capacity: 2",
        "only a ring_buffer has one",
    ),
    "overwriting latest value": (
        "count: {kind: shared_data",
        "count: {overwrite: true, kind: latest_value",
        "overwrite: true",
        "of kind latest_value has no overwrite; only a ring_buffer has one",
    ),
    "readers of shared data": (
        "count: {kind: shared_data",
        "count: {max_readers: 2, kind: shared_data",
        "max_readers: 2",
        "only a latest_value has one",
    ),
    "no readers": (
        "count: {kind: shared_data",
        "count: {max_readers: 0, kind: latest_value",
        "0",
        "bad max_readers of resource 'count': expected at least 1, found 0",
    ),
    "too many readers": (
        "count: {kind: shared_data",
        "count: {max_readers: 1, kind: latest_value",
        "count.read]",
        "too many readers of resource 'count' of kind latest_value",
    ),
    "second writer": (
        "count: {kind: shared_data",
        "count: {kind: latest_value",
        "count.write]",
        "a second writer of resource 'count' of kind latest_value; it has one; see line 17, or use",
    ),
    "port beside a topic": (
        f"count: {{kind: shared_data, {TOPIC}: publish",
        f"count: {{kind: latest_value, {TOPIC}: subscribe",
        "count.write]",
        "a second writer of resource 'count' of kind latest_value; it has one; see line 14",
    ),
    "latest value of no plain type": (
        "queue: {kind: ring_buffer, type: std_msgs/msg/Float64, capacity: 4}",
        "queue: {kind: latest_value, type: executor_tests/Owning}",
        "executor_tests/Owning",
        "expected a trivially copyable type, found one with a copy constructor of its own; use shared_data",
    ),
    "type of an event": (
        "queue: {kind: ring_buffer, type: std_msgs/msg/Float64, capacity: 4}",
        "queue: {kind: event, type: std_msgs/msg/Int32}",
        "std_msgs/msg/Int32",
        "resource 'queue' of kind event cannot be said by that message: expected std_msgs/msg/Empty",
    ),
    "unknown type": (
        "Float64, capacity",
        "Flaot64, capacity",
        "std_msgs/msg/Flaot64",
        "did you mean std_msgs/msg/Float64?",
    ),
    "no type": (
        "count: {kind: shared_data, type: std_msgs/msg/Float64,",
        "count: {kind: shared_data,",
        "count: {kind: shared_data",
        "resource 'count' has no type",
    ),
    "topic of no message": (
        "type: std_msgs/msg/Float64,\n",
        "type: executor_tests/Private,\n",
        "topic: {name: count",
        "its type is no ROS message",
    ),
    "topic name": (
        "name: count",
        "name: 2count",
        "2count",
        "expected a ROS name such as scan, /map or ~/status, found '2count'",
    ),
    "topic direction": (
        "direction: publish",
        "direction: out",
        "out",
        "expected publish or subscribe, found 'out'",
    ),
    "topic qos": ("qos: reliable", "qos: relaible", "relaible", "found 'relaible'"),
    "client without a service": (
        "  queue:",
        "  lamp: {kind: client, type: std_srvs/srv/SetBool}\n  queue:",
        "lamp: {",
        "resource 'lamp' of kind client calls no service: expected service: {name: ...}",
    ),
    "client without a type": (
        "  queue:",
        "  lamp: {kind: client, service: {name: x}}\n  queue:",
        "lamp: {",
        "resource 'lamp' has no type: expected e.g. std_srvs/srv/SetBool",
    ),
    "client of no registered type": (
        "  queue:",
        "  lamp: {kind: client, type: std_srvs/srv/SetBol, service: {name: x}}\n  queue:",
        "std_srvs/srv/SetBol",
        "did you mean std_srvs/srv/SetBool?",
    ),
    "client that offers": (
        "  queue:",
        "  lamp: {kind: client, type: std_srvs/srv/SetBool, service: {name: x, offers: y}}\n  queue:",
        "offers: y",
        "resource 'lamp' of kind client cannot offer a service",
    ),
    "client's time": (
        "  queue:",
        "  lamp: {kind: client, type: std_srvs/srv/SetBool, service: {name: x, timeout_ms: 0}}\n  queue:",
        "0}",
        "found 0",
    ),
    "unknown key of a service": (
        "  queue:",
        "  lamp: {kind: executor_tests/Lamp, service: {name: x, offer: set}}\n  queue:",
        "offer: set",
        "did you mean offers?",
    ),
    "client with a topic": (
        "  queue:",
        (
            "  lamp: {kind: client, type: std_srvs/srv/SetBool, "
            "topic: {name: x, direction: publish},\n         service: {name: x}}\n  queue:"
        ),
        "topic: {",
        "resource 'lamp' of kind client is bound to a topic",
    ),
    "service of nothing": (
        "  queue:",
        "  lamp: {kind: executor_tests/Lamp, service: {name: x}}\n  queue:",
        "service: {name: x}",
        "does not say which of its calls the ROS service is",
    ),
    "offered call of no ROS type": (
        "  queue:",
        "  lamp: {kind: executor_tests/Lamp, service: {name: x, offers: look}}\n  queue:",
        "look",
        "expected one of its calls with a ROS type, found 'executor_tests/Look'",
    ),
    "offered call that is none": (
        "  queue:",
        "  lamp: {kind: executor_tests/Lamp, service: {name: x, offers: sett}}\n  queue:",
        "sett",
        "did you mean set?",
    ),
    "time of an offered call": (
        "  queue:",
        "  lamp: {kind: executor_tests/Lamp, service: {name: x, offers: set, timeout_ms: 5}}\n  queue:",
        "timeout_ms",
        "only a client has one",
    ),
    "namespace": ("namespace: /robot_1", "namespace: /robot 1", "/robot 1", "bad namespace in 'executor'"),
    "one name twice": (
        "  queue:",
        "  sink:",
        "sink: {kind: ring_buffer",
        "'sink' is the name of a component and of a resource",
    ),
    "component name": ("  sink:\n", "  my sink:\n", "my sink:", "bad name 'my sink' in 'components'"),
    "no such package": (
        "lists/a.txt",
        "$(share nowhere)/a.txt",
        "$(share nowhere)",
        "$(share nowhere), a package that is not installed",
    ),
    "unknown place": ("lists/a.txt", "$(shore it)/a.txt", "$(shore it)", "known: $(share PACKAGE)"),
    "syntax": ("resources:", "resources: [}", "}", "not YAML"),
    "tab": ("    core: executor", "\tcore: executor", "\tcore", "not YAML: found character '\\t'"),
}


def _load(folder: Path, text: str | bytes, *, overrides: Overrides | None = None) -> Architecture:
    path = folder / "robot.yaml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    model = load_architecture(path, overrides=overrides)
    architecture = build(model, REGISTRY)
    configure(model, architecture)
    return architecture


@pytest.mark.parametrize("case", BAD)
def test_bad_file_gets_one_line_with_its_place(case: str, tmp_path: Path, plugin_prefix: Path) -> None:
    before, after, culprit, message = BAD[case]
    text = GOOD.replace(before, after, 1) if case != "wrong type" else GOOD.replace(before, after)
    if case == "wrong type":
        text = text.replace(
            "connections:", "  point: {kind: shared_data, type: geometry_msgs/msg/Point}\nconnections:"
        )
    if case == "too many readers":
        text += "  - [source.set, count.read]\n"
    if case == "second writer":
        text += "  - [sink.count, count.write]\n"
    assert text != GOOD
    with pytest.raises(ArchitectureFileError) as caught:
        _load(tmp_path, text)
    error, line = caught.value, str(caught.value)
    assert line.startswith(f"{tmp_path}/robot.yaml:{error.line}:{error.column}: ")
    assert text.splitlines()[error.line - 1][error.column - 1 :].startswith(culprit)
    assert message in line
    assert "\n" not in line
    assert isinstance(caught.value, MauveError)


def test_all_problems_are_told_in_the_order_of_the_file(tmp_path: Path, plugin_prefix: Path) -> None:
    text = (
        GOOD.replace("step: 2", "step: 99")
        .replace("[sink.set", "[sink.seet")
        .replace("count.write", "count.rite")
    )
    with pytest.raises(ArchitectureFileError) as caught:
        _load(tmp_path, text)
    assert [problem.line for problem in caught.value.problems] == [6, 17, 18]
    assert (caught.value.line, caught.value.code, caught.value.component) == (6, "out_of_range", "source")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (b"", ":1:1: not an architecture file: expected the keys mauve, executor, components"),
        (b"- 1\n", ":1:1: not an architecture file"),
        (b"mauve: 1\nx: \xe9\n", ":2:4: not text in UTF-8; save it as UTF-8"),
        (b"x: \xc3\xa9\xff\n", ":1:5: not text in UTF-8"),  # the column counts characters
        ("mauve: 1\n".encode("utf-16"), ":1:1: not text in UTF-8"),
        (b"mauve: 1\n\0", ":2:1: not YAML: the character U+0000 is not allowed"),
        (b"mauve: 1\n---\nmauve: 1\n", ":2:1: not YAML: expected a single document"),
        (b"a: &a [*a]\n", "the file has no 'mauve'"),
        (
            b"a: &a [1,1,1,1,1,1,1,1,1]\n"
            + b"".join(b"%c: &%c [%s]\n" % (c, c, b",".join([b"*%c" % (c - 1)] * 9)) for c in b"bcdefgh"),
            "nested",
        ),
        (b"a: " + b"[" * 5000, "nested too deeply"),
        (b"mauve: 1\n#" + b"x" * 2_000_000, "at most 1000000 bytes"),
    ],
)
def test_what_is_no_architecture_file(text: bytes, message: str, tmp_path: Path) -> None:
    with pytest.raises(ArchitectureFileError) as caught:
        _load(tmp_path, text)
    assert message in str(caught.value)


def test_a_folder_is_no_file(tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").mkdir()
    with pytest.raises(ArchitectureFileError, match=r"robot.yaml:1:1: cannot read the file: Is a directory"):
        load_architecture(tmp_path / "robot.yaml")


def test_missing_file(tmp_path: Path) -> None:
    with pytest.raises(ArchitectureFileError, match=r"robot.yaml:1:1: cannot read the file: No such file"):
        load_architecture(tmp_path / "robot.yaml")


def test_good_file_is_built_as_written(tmp_path: Path, plugin_prefix: Path) -> None:
    source, sink = _load(tmp_path, GOOD).components()
    assert (source.name, source.core, source.alternatives) == (
        "source",
        "executor_tests/Counter",
        ["executor_tests/Backwards"],
    )
    assert (source.period_ns, source.offset_ns) == (10_000_000, 2_500_000)
    assert (source.reconfigurable, sink.reconfigurable) == (True, False)
    values = {item.name: item.value for item in source.properties}
    assert values["step"] == 2.0
    assert values["list_file"] == str(tmp_path / "lists" / "a.txt")  # relative to the file
    assert values["label"] == "robot_1 of robot_2,robot_3"
    ports = {port.name: (port.resource, port.service) for port in sink.ports}
    assert ports == {"set": ("count", "read"), "count": ("", "")}


def test_latest_values_and_events_are_built_as_written(tmp_path: Path, plugin_prefix: Path) -> None:
    text = GOOD.replace("count: {kind: shared_data", "count: {kind: latest_value, max_readers: 1").replace(
        "  queue: {kind: ring_buffer, type: std_msgs/msg/Float64, capacity: 4}",
        "  bumped: {kind: event, topic: {name: bumped, direction: publish}}\n"
        "  asked: {kind: event, topic: {name: asked, direction: subscribe}}\n"
        "  heard: {kind: latest_value, type: std_msgs/msg/Float64,\n"
        "          topic: {name: heard, direction: subscribe}}",
    )
    resources = {resource.name: resource for resource in _load(tmp_path, text).resources()}
    assert {name: resource.kind for name, resource in resources.items()} == {
        "count": "latest_value",
        "bumped": "event",
        "asked": "event",
        "heard": "latest_value",
    }
    services = {(service.name, service.kind, service.type) for service in resources["bumped"].services}
    assert services == {("raise", "event", ""), ("read", "read", "std_msgs/msg/UInt64")}


def test_installed_alternatives_are_all_that_is_installed(tmp_path: Path, plugin_prefix: Path) -> None:
    index = plugin_prefix / "share/ament_index/resource_index/mauve_rt_plugins/executor_tests"
    text = index.read_text(encoding="utf-8")
    index.write_text(
        "".join(line for line in text.splitlines(keepends=True) if "Missing" not in line), encoding="utf-8"
    )
    try:
        source, _ = _load(tmp_path, GOOD.replace("[executor_tests/Backwards]", "installed")).components()
    finally:
        index.write_text(text, encoding="utf-8")
    assert source.alternatives == ["*"], "to the kernel; the executor looks what is installed at each request"


def test_alternatives_may_be_fsms_and_shells_and_a_fallback_is_declared(
    tmp_path: Path, plugin_prefix: Path
) -> None:
    names = ("CalmFsm", "TwinShell", "Twin", "TwinFsm")
    listed = ", ".join(f"executor_tests/{name}" for name in names)
    text = GOOD.replace("[executor_tests/Backwards]", f"[{listed}], fallback: executor_tests/Backwards")
    source, _ = _load(tmp_path, text.replace("priority: 40", "trace_records: 64, priority: 40")).components()
    assert source.alternatives == ["executor_tests/Twin"], "what the kernel takes as cores"
    assert (source.fallback, source.fell_back) == ("executor_tests/Backwards", False)


def test_overrides_of_the_command_line(tmp_path: Path, plugin_prefix: Path) -> None:
    given = {("source", "step"): 3, ("source", "label"): "$(namespace) with $(peers)"}
    overrides = Overrides(namespace="/robot_7", peers=["robot_8"], properties=given)
    source, _ = _load(tmp_path, GOOD, overrides=overrides).components()
    values = {item.name: item.value for item in source.properties}
    assert (values["step"], values["label"]) == (3.0, "/robot_7 with robot_8")


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (
            {("source", "step"): 33},
            "bad property 'step' of component 'source' (parameter source.step): expected at least 0",
        ),
        (
            {("sauce", "step"): 3},
            "parameter 'sauce.step' sets a property of an unknown component; did you mean source?",
        ),
        (
            {("source", "stap"): 3},
            "unknown property 'stap' of component 'source' (parameter source.stap); did you mean step?",
        ),
    ],
)
def test_bad_overrides(
    given: dict[tuple[str, str], int], message: str, tmp_path: Path, plugin_prefix: Path
) -> None:
    with pytest.raises(ArchitectureFileError) as caught:
        _load(tmp_path, GOOD, overrides=Overrides(properties=given))
    assert message in str(caught.value)


def test_graph_follows_the_data(tmp_path: Path) -> None:
    path = tmp_path / "robot.yaml"
    path.write_text(GOOD, encoding="utf-8")
    graph = architecture_graph(load_architecture(path))
    assert set(graph.edges()) == {("source", "count"), ("count", "sink")}
    assert graph.nodes["queue"]["kind"] == "resource"
    assert graph.edges["count", "sink", 0]["port"] == "set"
