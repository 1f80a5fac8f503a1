"""An architecture at work: its deployer, its instance and its epoch. Knows nothing of ROS."""

import threading
import uuid
from collections.abc import Callable, Sequence

from mauve_rt._kernel import Architecture, ComponentDescription, Deployer, PluginRegistry, RealtimeStatus
from mauve_rt.errors import MauveError
from mauve_rt.model import ArchitectureModel, PluginIndex, allowed_cores, build, configure


class StillRunningError(MauveError):
    """A component that should be parked still executes a state."""

    def __init__(self, components: Sequence[ComponentDescription]) -> None:
        words = ", ".join(
            f"component '{part.name}' still executes state {part.current_state}" for part in components
        )
        super().__init__(f"{words}; wait for its end, or end the process")
        self.code = "timeout"
        self.component = components[0].name
        self.element, self.expected, self.found, self.remedy = components[0].current_state, "", "", ""


class Runtime:
    """One architecture from configure() to cleanup().

    `epoch` grows with every change: of a component's state or core, whoever made it (a fault too), and of a
    property.

    | member        | written by                                 | guarded by |
    | ------------- | ------------------------------------------ | ---------- |
    | `_epoch` ...  | observe(), touch(): any thread             | `_lock`    |
    | the others    | configure() ... cleanup(): one at a time   |            |
    """

    registry = PluginRegistry()  # one for the process: libraries are never closed

    def __init__(
        self, load: Callable[[], ArchitectureModel], *, require_realtime: bool = False, trace: bool = True
    ) -> None:
        self._load = load
        self._model: ArchitectureModel | None = None
        self.index = PluginIndex()
        self.instance_id = str(uuid.uuid4())
        self.active = False
        self._require_realtime = require_realtime
        self._trace = trace
        self._architecture: Architecture | None = None
        self._deployer: Deployer | None = None
        self._lock = threading.Lock()
        self._epoch = 0
        self._revision = 0
        self._seen: object = None

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
        if self._deployer is not None:
            return
        model = self.model
        self.index = PluginIndex.installed()
        architecture = build(model, self.registry, index=self.index)
        configure(model, architecture)
        require_realtime = self._require_realtime or model.require_realtime
        deployer = Deployer(architecture, require_realtime=require_realtime, trace=self._trace)
        try:
            deployer.prepare_process()
        except BaseException:
            architecture.cleanup()
            raise
        self._architecture, self._deployer = architecture, deployer
        self.observe()

    def activate(self) -> None:
        """Deploy: every component starts on the grid."""
        self.deployer.deploy()
        self.active = True
        self.observe()

    def deactivate(self) -> None:
        """Write safe outputs, park the components, join their threads."""
        self.active = False
        self.deployer.shutdown()
        self.observe()

    def cleanup(self) -> None:
        """Release the architecture; configure() builds it anew, from the file as it is then.

        Raises:
            MauveError: a component's state still executes, so that nothing it uses may be taken away.
        """
        if busy := self.busy():
            raise StillRunningError(busy)
        self._model = None
        architecture, self._architecture, self._deployer = self._architecture, None, None
        if architecture is not None:
            architecture.cleanup()

    def busy(self) -> list[ComponentDescription]:
        """After deactivate(): the components whose present state has not come to its end yet."""
        return (
            []
            if self.active
            else [part for part in self.components() if part.state in ("RUNNING", "STOPPING")]
        )

    @property
    def configured(self) -> bool:
        """Whether there is a deployer."""
        return self._deployer is not None

    @property
    def deployer(self) -> Deployer:
        """The deployer, between configure() and cleanup()."""
        if self._deployer is None:
            raise RuntimeError("not configured")
        return self._deployer

    # ---- what it looks like now

    def components(self) -> list[ComponentDescription]:
        """Every component as it is now; none while unconfigured. From any thread."""
        architecture = self._architecture
        return architecture.components() if architecture is not None else []

    def realtime_status(self) -> RealtimeStatus | None:
        """What was granted of the real-time rights; None while unconfigured."""
        deployer = self._deployer
        return deployer.realtime_status() if deployer is not None else None

    def deployment_epoch_ns(self) -> int:
        """The instant all grids count from; 0 while not deployed."""
        deployer = self._deployer
        return deployer.epoch_ns if deployer is not None and self.active else 0

    def alternatives(self, component: str) -> list[str]:
        """Cores that the component takes beside the one its file gives it."""
        return allowed_cores(self.model, component, self.index)

    @property
    def epoch(self) -> int:
        """How many changes there were, from 1."""
        with self._lock:
            return self._epoch

    def observe(self) -> bool:
        """Compare the architecture with what it was at the last look; count a change. True: there was one."""
        # A component held for a commit, or on its way to a stop, is on its way to something else that counts.
        states = {"HELD": "RUNNING", "STOPPING": "RUNNING"}
        with self._lock:
            parts = [(part.name, states.get(part.state, part.state), part.core) for part in self.components()]
            seen = (self.active, self._revision, parts)
            if seen == self._seen:
                return False
            self._seen = seen
            self._epoch += 1
            return True

    def touch(self) -> None:
        """Count a change that components() does not show, such as that of a property."""
        with self._lock:
            self._revision += 1
