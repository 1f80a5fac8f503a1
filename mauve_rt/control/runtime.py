"""An architecture at work: its host, its instance and its revision. Knows nothing of ROS."""

import os
import threading
import time
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import NamedTuple

from mauve_rt._kernel import (
    Architecture,
    ComponentDescription,
    Deployer,
    Host,
    LogEntries,
    Overlays,
    PluginRegistry,
    ProbationRecord,
    RealtimeStatus,
    RecentMaxima,
    ResourceDescription,
    ShadowRecord,
)
from mauve_rt.errors import MauveError
from mauve_rt.model import ArchitectureModel, PluginIndex, PluginLoader, allowed_parts, build, configure
from mauve_rt.model.schema import ComponentModel, DiagnosticsModel

_MOMENT_S = 0.3
_POLL_S = 0.005


class StillBusyError(MauveError):
    """A component that should be parked still executes a state, or a change is still being prepared."""

    def __init__(self, what: str, *, component: str = "", element: str = "") -> None:
        super().__init__(f"{what}; wait for its end, or end the process")
        self.code = "timeout"
        self.component, self.element = component, element
        self.expected, self.found, self.remedy = "", "", ""


@dataclass(frozen=True)
class _Declared:
    """A component as the file or a request declared it; the cores that it takes, with their shells."""

    model: ComponentModel
    cores: Mapping[str, str]


class Observed(NamedTuple):
    """The components at a revision."""

    revision: int
    components: list[ComponentDescription]


def _is_executing(part: ComponentDescription) -> bool:
    """Whether its thread is in a state, also of one that was given up, which is FAULTED by then."""
    return part.state in ("RUNNING", "STOPPING") or (part.state == "FAULTED" and part.state_age_ns > 0)


class Runtime:
    """One architecture from configure() to cleanup().

    `revision` grows with every change: of a component's state, parts, properties or connections and of the
    lists of components and resources, whoever made it (a fault too).

    | member        | written by                                 | guarded by      |
    | ------------- | ------------------------------------------ | --------------- |
    | `_revision` ...  | observe(): any thread                      | `_lock`         |
    | `_left_log`   | configure(), cleanup(), take_log()         | `_lock`         |
    | `_declared`   | configure(), and who is in loading()       | exchanged whole |
    | `_changing`, `_unchanging` | who is in changing(): one at a time | itself    |
    | `registry`, `index` | configure(), and who is in loading() | `_loading`; exchanged whole |
    | the others    | configure() ... cleanup(): one at a time   |                 |
    """

    registry = PluginRegistry()  # one for the process: libraries are never closed
    _loading = threading.Lock()

    def __init__(
        self, load: Callable[[], ArchitectureModel], *, require_realtime: bool = False, trace: bool = True
    ) -> None:
        self._load = load
        self._model: ArchitectureModel | None = None
        self.index = PluginIndex()
        self.instance_id = os.urandom(16).hex()  # the module uuid loads a library
        self.active = False
        self._changing = ""  # the change that is being prepared or made, in words
        self._unchanging = threading.Event()
        self._unchanging.set()
        self._require_realtime = require_realtime
        self._trace = trace
        self._declared: Mapping[str, _Declared] = {}
        self._architecture: Architecture | None = None
        self._host: Host | None = None
        self._lock = threading.Lock()
        self._revision = 0
        self._claimed = 0  # the last revision that a request's own change was counted by
        self._seen: object = None
        self._observed = Observed(0, [])
        self._left_log: list[LogEntries] = []  # of architectures that are gone
        self._mark: object = None  # by which the kernel tells whether there is anything new to be seen

    # ---- life cycle

    @property
    def model(self) -> ArchitectureModel:
        """The architecture file, read at the first look and again after cleanup().

        Raises:
            MauveError: it cannot be read, or none was named.
        """
        if self._model is None:
            self._model = self._load()
        return self._model

    def configure(self) -> None:
        """Build and configure the architecture; does nothing when that was done already.

        Raises:
            ArchitectureFileError: it cannot be built or configured.
            MauveError: real time is required and was not granted.
        """
        if self._host is not None:
            return
        model = self.model
        self.index = PluginIndex.installed()
        if model.parts is not None:
            self.registry, self.index = model.parts.registry, model.parts.index
        with self._loading:
            architecture = build(model, self.registry, index=self.index)
        try:
            configure(model, architecture)
        except BaseException:
            self._keep_log(architecture)
            raise
        require_realtime = self._require_realtime or model.require_realtime
        host = self._make_host(architecture, require_realtime=require_realtime)
        try:
            host.prepare_process()
        except BaseException:
            architecture.cleanup()
            self._keep_log(architecture)
            raise
        with self.loading() as loader:
            self._declared = self._with_cores(model.components, loader)
        self._architecture, self._host = architecture, host
        self.observe()

    def _make_host(self, architecture: Architecture, *, require_realtime: bool) -> Host:
        return Deployer(architecture, require_realtime=require_realtime, trace=self._trace)

    def activate(self) -> None:
        """Deploy: every component starts on the grid.

        Raises:
            MauveError: a change of before is still being prepared, or the host's reason.
        """
        self.require_unchanging()
        if not self.host.is_deployed():  # with others of the same simulation
            self.host.deploy()
        self.active = True
        self.observe()

    def make_safe(self) -> None:
        """Write safe outputs and park the components, whatever else is done; deactivate() does the rest."""
        host = self._host
        if host is not None:
            host.shutdown()

    def deactivate(self) -> None:
        """Write safe outputs, park the components, join their threads; a change under way is called off."""
        self.active = False
        self.host.shutdown()
        self.observe()

    def await_parked(self, timeout_s: float) -> None:
        """After deactivate(): wait for the states that still execute, for `timeout_s` at most."""
        deadline = time.monotonic() + timeout_s
        while self.busy() and time.monotonic() < deadline:
            time.sleep(_POLL_S)

    def cleanup(self) -> None:
        """Release the architecture; configure() builds it anew, from the file as it is then.

        Raises:
            MauveError: a component's state still executes, or a change is still being prepared, so that
                nothing they use may be taken away.
        """
        self.require_parked()
        self._model = None
        architecture, self._architecture, self._host = self._architecture, None, None
        self._mark = None
        if architecture is not None:
            architecture.cleanup()
            self._keep_log(architecture)

    def _keep_log(self, architecture: Architecture) -> None:
        entries = architecture.take_log()
        with self._lock:
            self._left_log.append(entries)

    def take_log(self) -> list[LogEntries]:
        """The log lines since the last call, also of an architecture that is gone. One thread at a time."""
        architecture = self._architecture
        present = [architecture.take_log()] if architecture is not None else []
        with self._lock:
            left, self._left_log = self._left_log, []
        return [*left, *present]

    def require_parked(self) -> None:
        """Whether cleanup() may be called.

        Raises:
            MauveError: a component's state still executes, or a change is still being prepared.
        """
        if busy := self.busy():
            words = (f"component '{part.name}' still executes state {part.current_state}" for part in busy)
            raise StillBusyError(", ".join(words), component=busy[0].name, element=busy[0].current_state)
        self.require_unchanging()

    @contextmanager
    def changing(self, change: str) -> Iterator[None]:
        """Around a change, which may take long to prepare."""
        self._changing = change
        self._unchanging.clear()
        try:
            yield
        finally:
            self._unchanging.set()

    def require_unchanging(self) -> None:
        """Whether no change is under way, or only for a moment more.

        Raises:
            MauveError: one is still being prepared.
        """
        if not self._unchanging.wait(_MOMENT_S):
            raise StillBusyError(f"a change is still being prepared: {self._changing}")

    def busy(self) -> list[ComponentDescription]:
        """After deactivate(): the components whose present state has not come to its end yet."""
        return [] if self.active else [part for part in self.components() if _is_executing(part)]

    @property
    def configured(self) -> bool:
        """Whether there is a host."""
        return self._host is not None

    @property
    def host(self) -> Host:
        """What runs the architecture, between configure() and cleanup()."""
        if self._host is None:
            raise RuntimeError("not configured")
        return self._host

    @property
    def architecture(self) -> Architecture:
        """The architecture, between configure() and cleanup()."""
        if self._architecture is None:
            raise RuntimeError("not configured")
        return self._architecture

    def overlays(self) -> Overlays | None:
        """What rules and persons want; None while unconfigured. From any thread."""
        architecture = self._architecture
        return architecture.overlays if architecture is not None else None

    # ---- what it looks like now

    def components(self) -> list[ComponentDescription]:
        """Every component as it is now; none while unconfigured. From any thread."""
        architecture = self._architecture
        return architecture.components() if architecture is not None else []

    def has_python_parts(self, part: ComponentDescription) -> bool:
        """Whether the component runs under the interpreter's lock."""
        named = (("shell", part.shell), ("core", part.core), ("fsm", part.fsm))
        plugins = [self.index.find(kind, name) for kind, name in named]
        return any(plugin is not None and plugin.is_python for plugin in plugins)

    def probations(self) -> list[ProbationRecord]:
        """Of each component the last verdict, then the core on probation now; none while unconfigured."""
        host = self._host
        return host.probations() if host is not None else []

    def shadows(self) -> list[ShadowRecord]:
        """Of each component the shadow that runs, or the last one; none while unconfigured."""
        host = self._host
        return host.shadows() if host is not None else []

    def threads_left_behind(self) -> int:
        """Threads of removed components that still run a timed-out execution."""
        architecture = self._architecture
        return architecture.threads_left_behind() if architecture is not None else 0

    def take_recent_maxima(self) -> list[RecentMaxima]:
        """The largest figures of every component since the last call; none while unconfigured."""
        architecture = self._architecture
        return architecture.take_recent_maxima() if architecture is not None else []

    def realtime_status(self) -> RealtimeStatus | None:
        """What was granted of the real-time rights; None while unconfigured."""
        host = self._host
        return host.realtime_status() if host is not None else None

    def deployment_epoch_ns(self) -> int:
        """The instant all grids count from; 0 while not deployed."""
        host = self._host
        return host.epoch_ns if host is not None and self.active else 0

    def resources(self) -> list[str]:
        """Names of the resources there are now; none while unconfigured. From any thread."""
        return [resource.name for resource in self.described_resources()]

    def described_resources(self) -> list[ResourceDescription]:
        """Every resource as it is now; none while unconfigured. From any thread."""
        architecture = self._architecture
        return architecture.resources() if architecture is not None else []

    def authors(self) -> dict[str, dict[str, str]]:
        """Who changed what since the file, by target and element. From any thread."""
        architecture = self._architecture
        found: dict[str, dict[str, str]] = {}
        for target, element, author in architecture.authors() if architecture is not None else ():
            found.setdefault(target, {})[element] = author
        return found

    def kernel_revision(self) -> int:
        """The kernel's own count of changes, by which a commit tells whether there was one meanwhile."""
        architecture = self._architecture
        return architecture.revision() if architecture is not None else 0

    @contextmanager
    def loading(self) -> Iterator[PluginLoader]:
        """The plug-ins installed by now, for one at a time: loading changes the registry."""
        with self._loading:
            if self.index.is_stale:
                self.index = PluginIndex.installed()
                declared = {name: known.model for name, known in self._declared.items()}
                self._declared = self._with_cores(declared, PluginLoader(self.registry, self.index))
            yield PluginLoader(self.registry, self.index)

    def code_of(self, core: str) -> tuple[int, int]:
        """The generation of a core's code, and when its file was written (ns since 1970; 0: not known)."""
        loader = PluginLoader(self.registry, self.index)
        source = loader.source_of("core", core)
        return self.registry.generation_of("core", core), PluginLoader.built_ns(source)

    def declared(self, component: str) -> ComponentModel | None:
        """What the file, or the request that added it, says of a component; None while it is being added."""
        declared = self._declared.get(component)
        return None if declared is None else declared.model

    def diagnostics(self, component: str) -> DiagnosticsModel:
        """The thresholds of a component: the executor's, overridden by its own. From any thread."""
        model, declared = self._model, self._declared.get(component)
        everybodys = DiagnosticsModel() if model is None else model.diagnostics
        return everybodys if declared is None else everybodys.overridden_by(declared.model.diagnostics)

    def loaded_anew(self) -> None:
        """Code was loaded anew: look up again which shell each core was written for."""
        declared = {name: known.model for name, known in self._declared.items()}
        with self.loading() as loader:
            self._declared = self._with_cores(declared, loader)

    def declare(self, *, added: Mapping[str, ComponentModel], removed: Collection[str]) -> None:
        """Note what a transaction added and removed."""
        if not added and not removed:
            return
        gone = set(removed)
        with self.loading() as loader:
            kept = {name: declared for name, declared in self._declared.items() if name not in gone}
            self._declared = {**kept, **self._with_cores(added, loader)}

    def cores_of(self, part: ComponentDescription) -> list[str]:
        """Cores that replace_core accepts for a component, beside the one it has."""
        declared = self._declared.get(part.name)
        cores = declared.cores if declared is not None else {}  # none: being added at this moment
        return [core for core, shell in cores.items() if shell == part.shell and core != part.core]

    def _with_cores(
        self, models: Mapping[str, ComponentModel], loader: PluginLoader
    ) -> dict[str, "_Declared"]:
        declared = {}
        for name, model in models.items():
            cores = {core: loader.shell_of(core) for core in allowed_parts(model, "core", loader)}
            declared[name] = _Declared(model, cores)
        return declared

    @property
    def revision(self) -> int:
        """How many changes there were, from 1."""
        with self._lock:
            return self._revision

    def observe(self, *, changed_since: int | None = None, anew: bool = False) -> Observed:
        """The components; a change since the last look is counted. Figures may be those of the last change.

        `changed_since`: a revision after which the caller made a change, which need not show: a core replaced
        by another one of its kind, or a restart, counts all the same. Of changes made at once each counts.
        `anew`: figures are those of now.
        """
        with self._lock:
            mark = (
                self._architecture,
                self.active,
                self.kernel_revision(),
            )  # first: what comes after is news
            # Until each component has taken a change, descriptions follow without another kernel revision.
            is_settled = self._host is None or not self._host.open_changes()
            is_own = changed_since is not None and self._revision in (changed_since, self._claimed)
            if anew or mark != self._mark or is_own:
                parts = self.components()
                seen = (self.active, [_facts(part) for part in parts], self.resources())
                if seen != self._seen or is_own:
                    self._seen = seen
                    self._revision += 1
                self._mark = mark if is_settled else None
                self._observed = Observed(self._revision, parts)
            if changed_since is not None:
                self._claimed = self._revision
            return self._observed


def _facts(part: ComponentDescription) -> tuple[object, ...]:
    """What is a change when it changes."""
    # A component that stops runs until it is STOPPED: only the end of the stop is a change.
    state = "RUNNING" if part.state == "STOPPING" else part.state
    wiring = [(port.name, port.resource, port.service) for port in part.ports]
    properties = [(item.name, item.value) for item in part.properties]
    return (part.name, state, part.shell, part.core, part.fsm, part.fault, wiring, properties)
