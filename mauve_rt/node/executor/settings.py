"""What the command line says to an executor before there is a node."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any, Self

from mauve_rt._kernel import TASK_SETTINGS
from mauve_rt.control.limits import RequestLimits
from mauve_rt.control.runtime import Runtime
from mauve_rt.errors import MauveError, ParameterError
from mauve_rt.file_schema.words import shown
from mauve_rt.model import ArchitectureModel, Overrides, load_architecture
from mauve_rt.node.shared.ros_arguments import RosArguments, parse_ros_arguments
from mauve_rt.node.shared.settings import Setting, check_given, near_misses, usage, values_of
from mauve_rt.trace.bag.recorded import MIN_WINDOW_BYTES, SNAPSHOT_BYTES

_LIMITS = RequestLimits()
MAX_PHASE_TIMEOUT_S = 2.0  # events that come later may have to wait for it
_CONFIGURED: Any = "when configured"

PARAMETERS: dict[str, Setting] = {
    "architecture": Setting("", "architecture file"),
    "bag": Setting(
        "",
        "folder of a bag to record from the start; must not exist yet; with bag_snapshot_s the folder in "
        "which snapshots are created; empty: no recording",
        _CONFIGURED,
    ),
    "bags": Setting("", "folder in which ~/start_recording creates bags; empty: the working directory"),
    "record_topics": Setting(
        [],
        "further topics to record: name, name:package/msg/Type or name:package/msg/Type:qos; "
        "/camera/* takes topics by a pattern, also those that appear later",
        _CONFIGURED,
    ),
    "record_topic_regexes": Setting(
        [],
        "regular expressions: topics whose names contain a match are recorded, also later ones",
        _CONFIGURED,
    ),
    "record_queue_bytes": Setting(
        67_108_864,  # 64 MiB
        "messages of other nodes that may wait for the recorder, in bytes; it counts those beyond as lost",
        minimum=1_000_000,
    ),
    "bag_split_s": Setting(
        60.0, "time after which a recording goes on in a new file, in s; 0: never", _CONFIGURED, minimum=0
    ),
    "bag_split_bytes": Setting(
        0, "size at which a recording goes on in a new file, in bytes; 0: never", _CONFIGURED, minimum=0
    ),
    "bag_max_size_bytes": Setting(
        0,
        "size of all files of a recording beyond which it deletes its oldest file, in bytes; 0: never",
        _CONFIGURED,
        minimum=0,
    ),
    "bag_compression": Setting("none", "compression of the chunks of a recording: none or zstd", _CONFIGURED),
    "bag_snapshot_s": Setting(
        0.0,
        "time of which a recording keeps the last data in memory, for ~/write_snapshot, in s; "
        "0: it writes a bag",
        _CONFIGURED,
        minimum=0,
    ),
    "bag_snapshot_bytes": Setting(
        SNAPSHOT_BYTES,
        "largest memory of bag_snapshot_s, in bytes; beyond it the oldest data is dropped sooner",
        _CONFIGURED,
        minimum=MIN_WINDOW_BYTES,
    ),
    "bag_waits_for_room": Setting(
        default=False,
        description="a disk that is full or fails pauses a recording until it writes again; else it ends it",
    ),
    "rules": Setting("", "rules file; the executor runs its rules `in: executor`; empty: none", _CONFIGURED),
    "rules_folder": Setting(
        "",
        "folder below which ~/load_rules reads files; empty: that of `rules`, or else of `architecture`",
    ),
    "state_folder": Setting(
        "",
        "folder in which latched rules, quarantine and what persons changed outlast a restart; "
        "empty: nothing outlasts it",
    ),
    "forget": Setting(default=False, description="start without what `state_folder` holds; it is put aside"),
    "autostart": Setting(default=True, description="configure and activate at the start"),
    "require_realtime": Setting(default=False, description="refuse to start without real-time rights"),
    "trace": Setting(default=True, description="write trace records"),
    "report_phase_timeout_s": Setting(
        1.0,
        "longest time for which ~/events waits for the release after a commit, in s",
        minimum=0,
        maximum=MAX_PHASE_TIMEOUT_S,
    ),
    "node_silent_after_s": Setting(
        5.0, "silence of the Python side after which the executor logs an error, in s", minimum=2
    ),
    "max_request_bytes": Setting(
        _LIMITS.max_request_bytes, "largest size of one request, all texts together, in bytes", minimum=1
    ),
    "max_requested_bytes": Setting(
        _LIMITS.max_requested_bytes,
        "largest memory that requests may add: stacks, traces, buffers, in bytes",
        minimum=1,
    ),
    "max_requested_priority": Setting(
        _LIMITS.max_requested_priority,
        "highest priority that a request may give a component",
        minimum=1,
        maximum=TASK_SETTINGS["priority"].most,
    ),
}
DEFAULTS: Mapping[str, Any] = MappingProxyType(values_of({}, PARAMETERS))
# Not declared: without a value the file's peers count, which are no default that could be told.
PEERS = Setting([], "names of the other robots; overrides `peers` of the file")


@dataclass(frozen=True, kw_only=True)
class Settings:
    """The executor's parameters; those of the node with the same names are for people to look at."""

    values: Mapping[str, Any] = field(default_factory=lambda: DEFAULTS)
    overrides: Overrides = Overrides()  # noqa: RUF009 - immutable
    remarks: tuple[str, ...] = ()  # to be told; nothing is refused for them

    @classmethod
    def of(cls, words: Sequence[str]) -> Self:
        """The settings of a command line.

        Raises:
            ParameterError: a value of the wrong type, `use_sim_time`, or a name that no parameter has.
        """
        arguments = parse_ros_arguments(words, node="executor")
        namespace = _namespace(arguments)
        given = arguments.within(namespace)
        settings = {**PARAMETERS, "peers": PEERS}
        check_given(arguments, settings, namespace=namespace)
        peers = given.get("peers")
        if peers is not None and not (
            isinstance(peers, list) and all(isinstance(peer, str) for peer in peers)
        ):
            raise ParameterError(
                f"parameter peers: expected a list of names such as [robot_2], found {peers}"
            )
        properties = {}
        for name, value in given.items():
            component, dot, property_name = name.partition(".")
            if not dot or component == "qos_overrides":  # told to nodes of any name
                continue
            if not isinstance(value, bool | int | float | str):
                expected = f"expected true, false, a number or text, found {shown(value)}"
                raise ParameterError(f"parameter {name}: {expected}", element=name)
            properties[component, property_name] = value
        return cls(
            values=values_of(given, PARAMETERS),
            overrides=Overrides(namespace=arguments.namespace, peers=peers, properties=properties),
            remarks=near_misses(arguments, settings, namespace=namespace),
        )

    @property
    def architecture(self) -> str:
        """The file; empty: none."""
        return str(self.values["architecture"])

    @property
    def autostart(self) -> bool:
        """Whether to configure and activate at the start."""
        return bool(self.values["autostart"])

    def runtime(self) -> Runtime:
        """The runtime of the named file, nothing loaded yet."""
        return Runtime(
            self._load, require_realtime=self.values["require_realtime"], trace=self.values["trace"]
        )

    def node_namespace(self) -> str:
        """The namespace of the node before remapping.

        Raises:
            MauveError: the file cannot be read.
        """
        return self._load().namespace if self.architecture else "/"

    def _load(self) -> ArchitectureModel:
        if not self.architecture:
            usage = "ros2 run mauve_rt executor --ros-args -p architecture:=FILE"
            raise ParameterError(f"parameter 'architecture' is missing: {usage}")
        return load_architecture(Path(self.architecture), overrides=self.overrides)


def rules_folder(values: Mapping[str, Any]) -> Path:
    """The folder below which requests may name rules files."""
    named = str(values["rules_folder"])
    return Path(named) if named else Path(values["rules"] or values["architecture"]).parent


def help_text() -> str:
    """What `executor --help` says."""
    more = [
        ("peers:=string_array", f"{PEERS.description} (default: as in the architecture file)"),
        ("COMPONENT.PROPERTY:=VALUE", "property of a component (default: as in the architecture file)"),
    ]
    return usage("ros2 run mauve_rt executor", PARAMETERS, more=more)


def _namespace(arguments: RosArguments) -> str:
    """That of the node: remapped, or the one its architecture file has. A bad file is another's business."""
    if arguments.namespace or not arguments.names_namespaces:
        return "/" + arguments.namespace.strip("/")
    try:
        return load_architecture(str(arguments.parameters.get("architecture", ""))).namespace
    except MauveError:
        return "/"
