"""The executor as a managed ROS 2 node: configure builds, activate deploys, deactivate stops."""

import functools
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn

from mauve_rt._bridge import NodeWatch
from mauve_rt._kernel import STOP_TIMEOUT_NS, process_ends
from mauve_rt.control.judging import Judge
from mauve_rt.control.limits import RequestLimits
from mauve_rt.control.requests import Code
from mauve_rt.control.runtime import Runtime
from mauve_rt.control.values import Values
from mauve_rt.counts import counted
from mauve_rt.errors import MauveError, ParameterError, exception_text, one_line
from mauve_rt.model.threads import real_time_threads
from mauve_rt.node.executor.bound_resources import BoundResources
from mauve_rt.node.executor.bounds import WatchedBounds
from mauve_rt.node.executor.console import Console, NameWatch, TopicWatch
from mauve_rt.node.executor.lost_supervisors import LostSupervisors
from mauve_rt.node.executor.mirrors import Mirrors
from mauve_rt.node.executor.parameters import Parameters
from mauve_rt.node.executor.part_log import PartLog
from mauve_rt.node.executor.recording import Recording, RecordingOrders
from mauve_rt.node.executor.rules import OwnRules, load_reply
from mauve_rt.node.executor.sentinel import Sentinel
from mauve_rt.node.executor.settings import DEFAULTS, PARAMETERS, rules_folder
from mauve_rt.node.executor.state import StatePublisher
from mauve_rt.node.executor.state_folder import StateFolder
from mauve_rt.node.shared.service_thread import refused_reply
from mauve_rt.node.shared.setting_parameters import NO_SIMULATED_TIME, declare_settings
from mauve_rt.node.shared.settings import OF_RCLPY, refusal
from mauve_rt.node.shared.wall_clock import WallClock
from mauve_rt.node.shared.watch import Watch
from mauve_rt.trace.bag.recorded import COMPRESSIONS, Split, Window
from mauve_rt.trace.errors import TraceError

if TYPE_CHECKING:
    from mauve_rt.control.control import Control
    from mauve_rt.control.probations import Verdict
    from mauve_rt.node.executor.services import Services
    from mauve_rt.node.executor.stop_guard import StopGuard

NODE_NAME = "executor"
_HEALTH_S = 1.0
_LAST_STATES_S = 2.0  # how long a shutdown waits for states that still execute, as where Python has just hung
_SAFE_STOP = (
    "a signal makes outputs safe within 5 ms and the longest state that runs; a state that runs on for "
    f"{STOP_TIMEOUT_NS / 1e6:g} ms is given up"
)


class ExecutorNode(LifecycleNode):
    """Services, topics and states of one `Runtime`.

    Requests to change, stop and start, lifecycle transitions, listing and recorded topics have a callback
    group each, so that none delays the others. Requests, in `control_group`, are for `ServiceThreads`, the
    others for an executor with a thread for each: `THREADS`. Messages and calls of bound resources do not
    come by here: they have threads of their own, in C++.
    """

    THREADS = 3

    def __init__(self, runtime: Runtime, *, namespace: str, settings: Mapping[str, Any] = DEFAULTS) -> None:
        """Create the node with all that transitions need; the runtime may be configured already. Then open().

        `settings`: the values of PARAMETERS.
        """
        # Transitions are in the node's default group.
        self.watch = Watch(lambda text: self.get_logger().error(text))
        super().__init__(
            NODE_NAME,
            namespace=namespace,
            start_parameter_services=False,
            parameter_overrides=list(NO_SIMULATED_TIME),
        )
        self._answer_every_transition()
        self.control_group = MutuallyExclusiveCallbackGroup()
        self._runtime = runtime
        # A signal may come while a transition starts or ends threads: nobody else may do that then.
        self._starting_or_ending = threading.Lock()
        self._settings = settings
        declare_settings(self, PARAMETERS, settings)
        self._bound = BoundResources(self)
        self._values = Values(runtime)
        self._sentinel = Sentinel(self, runtime, self._bound)
        self._mirrors = Mirrors(self, self._values, self._bound)
        self._recording = Recording(
            self,
            runtime,
            self._bound,
            queue_bytes=settings["record_queue_bytes"],
            waits_for_room=settings["bag_waits_for_room"],
        )
        self._part_log = PartLog(self, runtime, self._recording, self.watch)
        self._state = StatePublisher(self, runtime, self._recording, self.watch)
        self._properties = Parameters(self, runtime)
        self._judge = Judge(runtime, uses=self._bound.bindings, others=real_time_threads)
        self._rules = OwnRules(
            self,
            runtime,
            judge=self._judge,
            topics=self._bound.heard,
            listen=self._bound.listen_for_silence,
            publish=self._state.send,
            event=self._state.event,
            follow=self._properties.follow,
            snapshot=lambda: self._recording.snapshot().directory,
            watch=self.watch,
            folder=rules_folder(settings),
        )
        self._bounds = WatchedBounds(self, runtime, self._judge, publish=self._state.send, watch=self.watch)
        self._state.rules = self._rules.names
        self._state.changed = self._sentinel.follow
        self._folder = StateFolder(
            self, self._rules, folder=settings["state_folder"], forget=settings["forget"]
        )
        self.access = ""  # who reaches its services; known once there is a participant
        self._node_watch: NodeWatch | None = None
        self._guard: StopGuard | None = None

    def open(self) -> None:
        """Offer services and diagnostics. Once, before anything spins the node.

        Loads their modules and type supports, a quarter of a start's work, and keeps the interpreter's lock
        while it does.
        """
        from mauve_rt.control.control import Control  # noqa: PLC0415
        from mauve_rt.node.executor.diagnostics import Diagnostics  # noqa: PLC0415
        from mauve_rt.node.executor.parameter_services import ParameterServices  # noqa: PLC0415
        from mauve_rt.node.executor.services import Services  # noqa: PLC0415
        from mauve_rt.node.executor.stop_guard import StopGuard  # noqa: PLC0415

        query_group = MutuallyExclusiveCallbackGroup()
        self._diagnostics = Diagnostics(
            self,
            self._runtime,
            self._bound,
            self._recording,
            self._rules,
            folder=self._folder,
            sentinel=self._sentinel,
            bounds=self._bounds,
        )
        self._topic_watch = TopicWatch(self.get_logger())
        self._name_watch = NameWatch(self)
        self._wall_clock = WallClock()
        control = Control(
            self._runtime,
            phase_timeout_s=self._settings["report_phase_timeout_s"],
            outside=self._bound,
            recordings=RecordingOrders(self._recording, self._runtime, folder=Path(self._settings["bags"])),
            limits=_limits(self._settings),
            judge=self._judge,
        )
        self._state.completed = control.complete
        services = Services(
            self,
            self._runtime,
            control=control,
            bound=self._bound,
            values=self._values,
            mirrors=self._mirrors,
            state=self._state,
            parameters=self._properties,
            rules=self._rules,
            bounds=self._bounds,
            load_rules=self._load_rules,
            watch=self.watch,
            warnings=self._name_watch.warnings,
            access=lambda: self.access,
            control_group=self.control_group,
            query_group=query_group,
        )
        self._state.decided = functools.partial(_go_back, control, services)
        self._guard = services.guard = StopGuard(
            self,
            self._runtime,
            self.watch,
            stop=services.stop_service,
            change_state=self._service_change_state,
            tell=services.tell_answered,
        )
        self._guard.follow(self._runtime)
        ParameterServices(
            self,
            self._properties,
            services.handle,
            refusal=self._refusal,
            control_group=self.control_group,
            query_group=query_group,
        )
        self._lost_supervisors = LostSupervisors(self, self._runtime, services.handle, self.watch)
        silent_after_ns = round(self._settings["node_silent_after_s"] * 1e9)
        self._part_log.open_services(query_group)
        self._node_watch = NodeWatch(super().get_logger().name, silent_after_ns=silent_after_ns)
        self.create_timer(_HEALTH_S, self._tell_health, callback_group=query_group)
        if self._runtime.active:
            NodeWatch.notify("READY=1")

    def get_logger(self) -> Console:
        """As rclpy's, but quick."""
        return Console(super().get_logger().name)

    # ---- callbacks, none of which may raise: rclpy would leave the others of its group waiting for ever

    def create_service(self, srv_type: Any, srv_name: str, callback: Any, **options: Any) -> Any:
        """As rclpy's."""
        guarded = self.watch.guarded(f"the handler of {srv_name}", callback, otherwise=refused_reply)
        return super().create_service(srv_type, srv_name, guarded, **options)

    def create_timer(self, timer_period_sec: float, callback: Any, *more: Any, **options: Any) -> Any:
        """As rclpy's, but by the monotonic clock."""
        guarded = self.watch.guarded("a timer's work", callback)
        options.setdefault("clock", Clock(clock_type=ClockType.STEADY_TIME))
        return super().create_timer(timer_period_sec, guarded, *more, **options)

    def create_subscription(
        self, msg_type: Any, topic: str, callback: Any, *more: Any, **options: Any
    ) -> Any:
        """As rclpy's."""
        guarded = self.watch.guarded(f"receiving from {topic}", callback)
        return super().create_subscription(msg_type, topic, guarded, *more, **options)

    def sign(self, response: Any) -> None:
        """Put into a reply who replies, and at which revision, where it has words for that."""
        if hasattr(response, "instance_id"):
            response.instance_id, response.revision = self._runtime.instance_id, self._runtime.revision

    # ---- transitions
    #
    # What a user can correct (a bad file, rights that are missing) is a FAILURE: everything is as before, and
    # can be tried again. Whatever else goes wrong is an ERROR: on_error() releases all. ~/state says why.

    def on_configure(self, _state: LifecycleState) -> TransitionCallbackReturn:
        """Load and check the file, build the architecture, open topics and bag."""
        return self._transition(self._configure, undo=self._release)

    def on_activate(self, _state: LifecycleState) -> TransitionCallbackReturn:
        """Deploy: all components start on one grid."""
        return self._transition(self._activate, undo=self.quiesce)

    def on_deactivate(self, _state: LifecycleState) -> TransitionCallbackReturn:
        """Write safe outputs, park the components, the last one first, end the threads."""
        return self._transition(self.quiesce)

    def on_cleanup(self, _state: LifecycleState) -> TransitionCallbackReturn:
        """Seal the bag, release the architecture; refused while a component's state still executes."""
        return self._transition(self._clean_up)

    def on_shutdown(self, _state: LifecycleState) -> TransitionCallbackReturn:
        """As deactivate and cleanup."""
        return self._transition(self._end)

    def on_error(self, _state: LifecycleState) -> TransitionCallbackReturn:
        """Release everything: back to unconfigured, or finalized where a component's state still executes."""
        return self._transition(self._end, error=self._state.error)

    def _configure(self) -> None:
        self._runtime.configure()
        if self._guard is not None:
            self._guard.follow(self._runtime)
        self._properties.follow()
        self._bound.configure(self._runtime.model, self._runtime.architecture)
        self._sentinel.configure()
        self._mirrors.configure(self._runtime.model.mirrors)
        with self._properties.lock:
            names = ("rules", "bag", "record_topics", "record_topic_regexes")
            rules, bag, topics, expressions = (self.get_parameter(name).value for name in names)
            split, compression, window = self._split(), self._compression(), self._window()
        self._rules.configure(rules)
        self._folder.configure(self._runtime)
        if bag:
            self._recording.start(
                Path(bag),
                topics,
                split=split,
                expressions=expressions,
                compression=compression,
                window=window,
            )
        self._log_realtime()
        parts = counted(len(self._runtime.components()), "component")
        resources = counted(len(self._runtime.described_resources()), "resource")
        where = "memory, snapshots to " if window is not None else ""
        recorded = f", recording to {where}{bag}" if bag else ""
        self.get_logger().info(f"configured: {self._runtime.model.path}: {parts}, {resources}{recorded}")

    def _compression(self) -> str:
        name = str(self.get_parameter("bag_compression").value)
        if name not in COMPRESSIONS:
            raise ParameterError(
                f"parameter bag_compression: expected {' or '.join(COMPRESSIONS)}, found '{name}'"
            )
        return name

    def _window(self) -> Window | None:
        names = ("bag_snapshot_s", "bag_snapshot_bytes")
        seconds, max_bytes = (self.get_parameter(name).value for name in names)
        return Window(seconds=seconds, max_bytes=max_bytes) if seconds else None

    def _split(self) -> Split:
        names = ("bag_split_s", "bag_split_bytes", "bag_max_size_bytes")
        after_s, after_bytes, max_bytes = (self.get_parameter(name).value for name in names)
        split = Split(after_s=after_s, after_bytes=after_bytes, max_bytes=max_bytes)
        if misfit := split.misfit():
            raise ParameterError(f"parameter bag_max_size_bytes: {misfit}")
        return split

    def _activate(self) -> None:
        self._sentinel.arm()  # before a component writes
        with self._starting_or_ending:
            try:
                self._runtime.activate()
            except MauveError:
                if not process_ends():
                    raise
                return  # a signal came in between: nothing runs, and the node closes next
            self._bound.start()
            self._rules.start()  # first, so that ~/state names them from the first time on
            self._state.start(self._runtime.host)
            self._bounds.start()
            if self._node_watch is not None:  # else it is not open yet
                NodeWatch.notify("READY=1")
        self.get_logger().info(f"activated: {counted(len(self._runtime.components()), 'component')}")
        self.get_logger().info(_SAFE_STOP)

    def _clean_up(self) -> None:
        self._release()
        self.get_logger().info("cleaned up: nothing is configured")

    def _end(self) -> None:
        self.quiesce()
        self._runtime.await_parked(_LAST_STATES_S)
        self._release()

    def _transition(
        self, work: Callable[[], None], *, undo: Callable[[], None] | None = None, error: str = ""
    ) -> TransitionCallbackReturn:
        """What came of a transition's work, told in ~/state; `error`: what led to it."""
        result, reason = TransitionCallbackReturn.SUCCESS, error
        try:
            try:
                work()
            except (MauveError, TraceError) as failure:
                result, reason = TransitionCallbackReturn.FAILURE, str(failure)
                if undo is not None:
                    undo()
        except BaseException as failure:  # noqa: BLE001 - rclpy would swallow it without a word
            result = TransitionCallbackReturn.ERROR
            reason = exception_text(failure)
        if result != TransitionCallbackReturn.SUCCESS:
            reason = one_line(f"{reason}; after {error}" if error else reason)
            self.get_logger().error(reason)
        self._state.error = reason
        self._state.refresh(again=True)
        return result

    def _answer_every_transition(self) -> None:
        """Say no to a transition that the present state does not have: rclpy would say nothing."""
        service = self._service_change_state
        change_state = service.callback

        def answer(request: Any, response: Any) -> Any:
            try:
                return change_state(request, response)
            except BaseException as error:  # noqa: BLE001 - RCLError, of which rclpy publishes no name
                self.get_logger().warning(one_line(f"transition refused: {error}"))
                response.success = False
                return response

        service.callback = answer

    def quiesce(self) -> None:
        """Outputs safe, components parked, last words published, threads joined. May be called again."""
        self._runtime.make_safe()  # first: a request that lasts may hold the lock
        with self._starting_or_ending:
            self._rules.stop()
            if self._runtime.active:
                self._runtime.deactivate()
                self.watch.guarded("~/state", self._state.refresh)()
                self.get_logger().info("deactivated: outputs are safe, components parked")
            self._bounds.stop()
            self._state.stop()
            self._bound.stop()
        self._sentinel.disarm()  # all outputs of the stop are sent

    def close(self) -> None:
        """End everything this node holds, in order: components, threads, bag, node.

        A component whose state still executes keeps its memory until the process ends.
        """
        NodeWatch.notify("STOPPING=1")
        try:
            self.quiesce()
            try:
                self._release()
            except MauveError as error:
                self.get_logger().error(str(error))
                self._recording.stop()
                self._rules.close()
                self._folder.close()
                self._sentinel.close()
                self._bound.close()
        finally:
            if self._guard is not None:
                self._guard.stop()
            if self._node_watch is not None:
                self._node_watch.stop()
            self._state.close()
            self._part_log.close()
            self.destroy_node()

    def destroy_node(self) -> None:
        """As rclpy's, which forgets the state machine: that would keep the node, and so the DDS participant.

        A participant that is not disposed of stays in others' graphs for its lease of 20 s, and its shared
        memory in /dev/shm for ever.
        """
        super().destroy_node()
        self._state_machine.destroy_when_not_in_use()

    def _release(self) -> None:
        self._runtime.require_parked()
        self._state.flush()
        self._part_log.write_last()
        self._recording.stop()
        self._rules.close()
        self._folder.close()
        self._sentinel.close()
        self._bound.close()
        if self._guard is not None:
            self._guard.release()
        self._runtime.cleanup()
        self._properties.follow()

    def _load_rules(self, path: str, release: Sequence[str]) -> tuple[Code, str]:
        """Rules in the place of the present ones; not while a transition starts or ends threads."""
        with self._starting_or_ending:
            if not self._runtime.configured:
                return (
                    Code.NOT_ACTIVE,
                    "configure the executor first: nothing is there that rules could be about",
                )
            return load_reply(self._rules, path, release)

    def _tell_health(self) -> None:
        if self._node_watch is not None:
            self._node_watch.beat()
        self._rules.beat()
        self._sentinel.follow()
        self._lost_supervisors.look()
        self._state.look_for_hung()
        if step := self._wall_clock.look():
            self.get_logger().warning(step)
        self._diagnostics.publish(error=self._state.error, clock=self._wall_clock.recent())
        self._topic_watch.look(self._bound.topics(), self._bound.other_types())
        self._recording.look()
        self._name_watch.look()

    def _log_realtime(self) -> None:
        status = self._runtime.realtime_status()
        for missing in status.missing if status is not None else ():
            self.get_logger().warning(f"no real time: {missing}")

    # ---- parameters

    def _refusal(self, parameter: str) -> str:
        setting = PARAMETERS.get(parameter) or OF_RCLPY.get(parameter)
        return "" if setting is None else refusal(parameter, setting, configured=self._runtime.configured)


def _go_back(control: "Control", services: "Services", verdict: "Verdict") -> None:
    """A reload was put on probation, and a core of it has gone back: so does the rest of it."""
    if (request := control.way_back(verdict)) is not None:
        services.handle(request)


def _limits(settings: Mapping[str, Any]) -> RequestLimits:
    return RequestLimits(**{item.name: settings[item.name] for item in fields(RequestLimits)})
