"""A good architecture file, and changes each of which makes it a bad one."""

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
    "sentinel": (
        "peers: [robot_2, robot_3]",
        "sentinel: often",
        "often",
        "bad sentinel",
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
        "ring_buffer, latest_value, event, client, action_server, action_client, transform_tree or the name",
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
        "found one with a copy constructor of its own, as one with sequences; use shared_data",
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
        "resource 'lamp' of kind client has no service: expected service: {name: ...}",
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
        "resource 'lamp' of kind client takes no topic; bind it by service",
    ),
    "client with an action": (
        "  queue:",
        (
            "  lamp: {kind: client, type: std_srvs/srv/SetBool, service: {name: x},\n"
            "         action: {name: x}}\n  queue:"
        ),
        "action: {",
        "resource 'lamp' of kind client takes no action; bind it by service",
    ),
    "server without an action": (
        "  queue:",
        "  drive: {kind: action_server, type: mauve_msgs/action/DriveTo}\n  queue:",
        "drive: {",
        "resource 'drive' of kind action_server has no action: expected action: {name: ...}",
    ),
    "server without a type": (
        "  queue:",
        "  drive: {kind: action_server, action: {name: x}}\n  queue:",
        "drive: {",
        "resource 'drive' has no type: expected e.g. mauve_msgs/action/DriveTo",
    ),
    "server of no registered type": (
        "  queue:",
        "  drive: {kind: action_server, type: mauve_msgs/action/DriveT, action: {name: x}}\n  queue:",
        "mauve_msgs/action/DriveT",
        "did you mean mauve_msgs/action/DriveTo?",
    ),
    "server with a topic": (
        "  queue:",
        (
            "  drive: {kind: action_server, type: mauve_msgs/action/DriveTo,\n         "
            "action: {name: x}, topic: {name: y, direction: publish}}\n  queue:"
        ),
        "topic: {name: y",
        "resource 'drive' of kind action_server takes no topic; bind it by action",
    ),
    "client of an action with a service": (
        "  queue:",
        (
            "  dock: {kind: action_client, type: mauve_msgs/action/DriveTo,\n         "
            "action: {name: x}, service: {name: y}}\n  queue:"
        ),
        "service: {name: y",
        "resource 'dock' of kind action_client takes no service; bind it by action",
    ),
    "time for an answer": (
        "  queue:",
        (
            "  drive: {kind: action_server, type: mauve_msgs/action/DriveTo, "
            "action: {name: x, answer_ms: 0}}\n  queue:"
        ),
        "0}",
        "found 0",
    ),
    "goals": (
        "  queue:",
        (
            "  drive: {kind: action_server, type: mauve_msgs/action/DriveTo, "
            "action: {name: x}, goals: 0}\n  queue:"
        ),
        "0}",
        "bad goals of resource 'drive'",
    ),
    "name of an action": (
        "  queue:",
        "  drive: {kind: action_server, type: mauve_msgs/action/DriveTo, action: {name: x y}}\n  queue:",
        "x y",
        "bad name",
    ),
    "key of an action": (
        "  queue:",
        (
            "  drive: {kind: action_server, type: mauve_msgs/action/DriveTo, "
            "action: {name: x, answer_s: 1}}\n  queue:"
        ),
        "answer_s",
        "did you mean answer_ms?",
    ),
    "action of data": (
        "  queue:",
        "  lamp: {kind: executor_tests/Lamp, action: {name: x}}\n  queue:",
        "action: {",
        "resource 'lamp' of kind executor_tests/Lamp takes no action; only resources of kind",
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
    "hold of zero": (
        "capacity: 4",
        "capacity: 4, longest_hold_ns: 0",
        "0}",
        "bad longest_hold_ns of resource 'queue': expected at least 1",
    ),
    "hold too long": (
        "capacity: 4",
        "capacity: 4, longest_hold_ns: 2305843009213693952",
        "2305843009213693952",
        "bad longest_hold_ns of resource 'queue': expected at most 2305843009213693951",
    ),
    "hold in ms": (
        "capacity: 4",
        "capacity: 4, longest_hold_ns: 2.5",
        "2.5",
        "bad longest_hold_ns of resource 'queue': expected a whole number, found 2.5",
    ),
    "frame with a slash": (
        "capacity: 4",
        "capacity: 4, frame: /map",
        "/map",
        "bad frame of resource 'queue': expected a frame such as map or $(name)/base: no spaces, no slash",
    ),
    "frame with a space": ("capacity: 4", "capacity: 4, child_frame: a base", "a base", "bad child_frame of"),
    "empty frame": ("capacity: 4", 'capacity: 4, frame: ""', '""', "bad frame of resource 'queue'"),
    "unknown place in a frame": (
        "reconfigurable: false",
        "frames: {set: $(nme)/base}",
        "$(nme)/base",
        "bad set in frames of component 'sink'",
    ),
    "no frame": ("reconfigurable: false", "frames: {set: {}}", "set: {}", "expected frame or child_frame"),
    "frame of no port": (
        "reconfigurable: false",
        "frames: {sett: map}",
        "sett: map",
        "component 'sink' has no port 'sett' that reads or writes values; did you mean set?",
    ),
    "max_slew of no number": (
        "priority: 40",
        "max_slew: {count: 1.0}",
        "count",
        "a write port, a dot and the",
    ),
    "max_slew of no port": (
        "priority: 40",
        "max_slew: {cuont.data: 1.0}",
        "cuont.data",
        "the shell has no such port: expected one of",
    ),
    "max_slew of an input": (
        "priority: 40",
        "max_slew: {set.data: 1.0}",
        "set.data",
        "max_slew is of numbers that the component writes: expected a write port, found a port of kind read",
    ),
    "max_slew of another field": (
        "priority: 40",
        "max_slew: {count.speed: 1.0}",
        "count.speed",
        "the output has no such number: expected a field of std_msgs/msg/Float64",
    ),
    "max_slew of 0": ("priority: 40", "max_slew: {count.data: 0}", "0}", "expected more than 0, found 0"),
    "max_slew below 0": ("priority: 40", "max_slew: {count.data: -1.5}", "-1.5", "more than 0, found -1.5"),
    "max_slew without an end": ("priority: 40", "max_slew: {count.data: .inf}", ".inf", "found inf"),
    "max_slew in words": ("priority: 40", "max_slew: {count.data: slow}", "slow", "found 'slow'"),
    "port and resource in different frames": (
        "{kind: shared_data,",
        "{kind: shared_data, frame: odom,",
        "[source.count, count.write]",
        "expected frame map, as the port declares, found frame odom of count.write; connect another",
    ),
    "ports in different frames": (
        "reconfigurable: false",
        "frames: {set: odom}",
        "[sink.set, count.read]",
        "component 'sink': port set: two ports of a resource are in different frames; expected frame odom,",
    ),
    "syntax": ("resources:", "resources: [}", "}", "not YAML"),
    "tab": ("    core: executor", "\tcore: executor", "\tcore", "not YAML: found character '\\t'"),
}
