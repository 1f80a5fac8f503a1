"""The rules that an executor runs itself, natively. Python only tells what they decided."""

import threading
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rclpy.lifecycle import LifecycleNode
from rclpy.qos import DurabilityPolicy, QoSProfile

from mauve_msgs.msg import SupervisorDecision
from mauve_rt._kernel import KEPT, Overlay, RuleFacts, RuleRunner, ToldDecision, monotonic_ns
from mauve_rt.control.judging import Judge, NotSchedulableError
from mauve_rt.control.requests import Code, Outcome, Request
from mauve_rt.control.runtime import Runtime
from mauve_rt.errors import ArchitectureFileError, MauveError, ParameterError
from mauve_rt.file_schema.yaml_file import YamlFile
from mauve_rt.model.step_kinds import STEP_KINDS
from mauve_rt.node.shared.watch import Watch

if TYPE_CHECKING:  # an executor without rules has no use for these, a tenth of its modules
    from mauve_rt.interfaces.told_decisions import DecisionMessages
    from mauve_rt.node.executor.rules_file import LoadedRules
    from mauve_rt.supervision.rules import Rule

KEPT_DECISIONS = 100
_WAIT_NS = 200_000_000  # how long the thread that tells may go on waiting when it should end


class ActiveSafetyRuleError(MauveError):
    """A safety rule is active, and the new rules lack it."""

    def __init__(self, rule: str) -> None:
        super().__init__(
            f"safety rule '{rule}' is active, and the file lacks it; to let go of it: --release {rule}"
        )


class OwnRules:
    """Those of one file at a time, from configure() to close(); they are at work from start() to stop().

    | member     | written by                          | read by   | guarded by          |
    | ---------- | ----------------------------------- | --------- | ------------------- |
    | `_loaded`  | configure(), load(), close()        | the same  | `_lock`             |
    | `_runner`, | start(), stop(), load(), close()    | any       | `_lock` to write; each |
    | `_names`   |                                     |           | is exchanged whole  |
    | `_rested`, | the same                            | the same  | `_lock`             |
    | `_known`   |                                     |           |                     |
    """

    def __init__(
        self,
        node: LifecycleNode,
        runtime: Runtime,
        *,
        judge: Judge,
        topics: Callable[[], dict[str, str]],
        listen: Callable[[set[str], set[str]], None],
        publish: Callable[[Any, str, Any, QoSProfile], None],
        event: Callable[[Request, Outcome], None],
        follow: Callable[[], None],
        snapshot: Callable[[], Path],
        watch: Watch,
        folder: Path,
    ) -> None:
        """`judge` says which actions are schedulable.

        `topics`: those that resources are bound to; `publish` sends and records a message.

        `listen` takes the resources whose silence rules wait for, and those whose link's.

        load() reads files below `folder` only.

        `event` tells of what was done; `follow` lets parameters follow it.

        `snapshot` begins to write a snapshot of the recording, and returns its folder.
        """
        self._node = node
        self._runtime = runtime
        self._judge = judge
        self._topics = topics
        self._listen = listen
        self._publish = publish
        self._event = event
        self._follow = follow
        self._snapshot = snapshot
        self._watch = watch
        self._folder = folder.absolute()
        self._qos = QoSProfile(depth=KEPT_DECISIONS, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._decisions = node.create_publisher(SupervisorDecision, "~/decisions", self._qos)
        self._lock = threading.RLock()
        self._loaded: LoadedRules | None = None
        self._runner: RuleRunner | None = None
        self._rested: RuleRunner | None = None  # stopped: what the next one goes on from
        self._names: list[str] = []
        self._known: dict[str, Rule] = {}  # of all files since the start, by name: the last one
        self._ending = threading.Event()
        self._thread: threading.Thread | None = None

    # ---- life cycle

    def configure(self, path: str) -> None:
        """Read and check the rules of a file; none: there are none.

        Raises:
            ArchitectureFileError: they cannot be used.
        """
        with self._lock:
            self._loaded = self._load(Path(path)) if path else None

    def start(self) -> None:
        """Let them work; the host is deployed.

        Raises:
            MauveError: a rule hears something that there is not.
        """
        with self._lock:
            if self._loaded is not None:
                self._begin_if_any(self._loaded)

    def stop(self) -> None:
        """Nothing is done after this; all that was decided is told. The rules go on at the next start()."""
        with self._lock:
            self._end()

    def close(self) -> None:
        """Forget the file."""
        with self._lock:
            self._end()
            self._loaded = self._rested = None

    def load(self, path: str, release: Sequence[str] = ()) -> int:
        """Put the rules of a file in the place of the present ones, all or none; returns how many there are.

        `release`: active safety rules that may be gone.

        Raises:
            ActiveSafetyRuleError: one is gone that is active, and not among these.
            ParameterError: the file lies elsewhere; whether there is one is not looked at.
            MauveError: they cannot be used; the present ones go on.
        """
        with self._lock:
            before = self._loaded
            if not path and before is None:
                raise ParameterError("no rules were loaded yet: name a file")
            if self._runner is None:
                self._rested = None  # the check of the new ones listens to the same components
            loaded = self._load(self._below(path) if path or before is None else before.path)
            self._check_release(loaded, release)
            if self._runner is not None or self._runtime.active:
                self._end()
                try:
                    self._begin_if_any(loaded)
                except MauveError:
                    if before is not None:
                        self._begin_if_any(before)
                    raise
            self._loaded, self._rested = loaded, None
            return len(loaded.rules)

    def _below(self, path: str) -> Path:
        file = self._folder / path
        if self._folder.resolve() not in file.resolve().parents:
            where = f"{self._folder} (the executor's parameter rules_folder)"
            raise ParameterError(f"rules file '{path}': expected a file below {where}; copy it there")
        return file

    def _load(self, path: Path) -> "LoadedRules":
        from mauve_rt.node.executor.rules_file import LoadedRules  # noqa: PLC0415

        # Of rules at work the runner's own error tells of the first trouble, without the place.
        topics = self._topics_of if self._runner is None else None
        loaded = LoadedRules.read(path, self._runtime, topics=topics)
        for warning in loaded.unschedulable(self._judge):
            self._node.get_logger().warning(warning)
        return loaded

    def _topics_of(self, rules: Sequence["Rule"]) -> dict[str, str]:
        """The resource that is bound to each topic, named as in the rules."""
        bound = self._topics()
        said = {str(leaf.parameters.get("topic") or "") for rule in rules for leaf in rule.when.leaves()}
        full = {name: self._node.resolve_topic_name(name) for name in said if name}
        return {name: bound[topic] for name, topic in full.items() if topic in bound}

    def _at_work(self) -> list[Overlay]:
        """What the executor's rules want or have not undone yet."""
        overlays = self._runtime.overlays()
        return overlays.at_work("") if overlays is not None else []

    def _check_release(self, loaded: "LoadedRules", release: Sequence[str]) -> None:
        names = {rule.name for rule in loaded.rules}
        for overlay in self._at_work():
            if overlay.safety and overlay.is_active and overlay.rule not in {*names, *release}:
                raise ActiveSafetyRuleError(overlay.rule)

    def _begin_if_any(self, loaded: "LoadedRules") -> None:
        """Where there are none, but some that are gone have to be undone, too."""
        if loaded.rules or self._at_work():
            self._begin(loaded)

    def _begin(self, loaded: "LoadedRules") -> None:
        topics = self._topics_of(loaded.rules)
        self._known.update({rule.name: rule for rule in loaded.rules})
        names = {rule.name for rule in loaded.rules}
        # As the runner adds them: those that are gone, and not undone yet.
        released = [self._known[each.rule] for each in self._at_work() if each.rule not in names]
        runner = loaded.runner(self._runtime.host, topics, self._rested)
        self._rested = None
        self._listen(*(_silent(kind, loaded.rules, topics) for kind in ("silence", "link_silence")))
        overlays = self._runtime.architecture.overlays
        for name in names:
            overlays.move(name, KEPT, "")  # it goes on
        runner.start()
        self._runner, self._names = runner, [rule.name for rule in loaded.rules]
        self._ending.clear()
        tell = self._teller(runner, loaded, released)
        self._thread = self._watch.thread("rules", tell, ending=self._ending)
        self._thread.start()

    def _end(self) -> None:
        runner, self._runner, self._names = self._runner, None, []
        if runner is None:
            return
        runner.stop()
        self._rested = runner
        self._listen(set(), set())
        self._ending.set()
        runner.wake()
        if self._thread is not None:
            self._thread.join()
            self._thread = None

    # ---- what there is

    def names(self) -> list[str]:
        """Of the rules that are at work."""
        return self._names

    def file_names(self) -> list[str]:
        """Of the rules of the file, at work or not."""
        return [rule.name for rule in self._of_file()]

    def latched(self) -> list[str]:
        """Those that only a reset ends."""
        return [rule.name for rule in self._of_file() if rule.latch]

    def safety(self) -> dict[str, set[str]]:
        """Safety rules, with the components that they are about."""
        rules = [rule for rule in self._of_file() if rule.safety]
        if not rules:
            return {}
        from mauve_rt.supervision.effects import touched  # noqa: PLC0415

        return {rule.name: touched(rule.do) for rule in rules}

    def _of_file(self) -> Sequence["Rule"]:
        loaded = self._loaded
        return loaded.rules if loaded is not None else ()

    def is_active(self, rule: str) -> bool:
        """Whether a rule of the executor is active."""
        return any(each.rule == rule and each.is_active for each in self._at_work())

    def reset(self, rule: str) -> str:
        """End an active rule whose condition is false, be it latched; "": done, else why not."""
        runner = self._runner
        return runner.reset(rule) if runner is not None else "the executor's rules are not at work"

    def beat(self) -> None:
        """Say that the executor's Python side works."""
        if (runner := self._runner) is not None:
            runner.beat()

    def facts(self) -> list[RuleFacts]:
        """How each of them fares."""
        runner = self._runner
        return runner.facts() if runner is not None else []

    def infos(self) -> list[Any]:
        """RuleInfo of each of them."""
        loaded = self._loaded
        return loaded.infos(self.facts()) if loaded is not None else []

    # ---- telling

    def _teller(
        self, runner: RuleRunner, loaded: "LoadedRules", released: Sequence["Rule"]
    ) -> Callable[[], None]:
        name = self._node.resolve_topic_name
        who = self._node.get_fully_qualified_name()
        messages = loaded.messages(self._runtime, released, who=who, name=name)
        tell_one = self._watch.guarded("a decision", self._tell)

        reported = 0

        def tell() -> None:
            nonlocal reported
            for told in runner.wait_told(_WAIT_NS):
                tell_one(messages, told)
            if (lost := runner.lost()) != reported:
                text = f"{lost - reported} decisions were left out: they came faster than they are reported"
                self._node.get_logger().warning(text)
                reported = lost

        return tell

    def _tell(self, messages: "DecisionMessages", told: ToldDecision) -> None:
        message, done = messages.message(told, self._stamp(told.decision.stamp_ns))
        if done is not None:
            if done.outcome.success and any(
                STEP_KINDS[step.kind].changes_parameters for step in done.request.steps
            ):
                self._follow()
            self._event(done.request, done.outcome)
        text = f"{message.rule}: {message.decision}: {message.reason}"
        console = self._node.get_logger()
        if late := messages.lateness(told, message):
            console.error(late)
        (console.error if message.decision == "failed" else console.info)(text)
        self._publish(self._decisions, messages.TYPE, message, self._qos)
        if message.decision == "do" and self._known[message.rule].snapshot:
            try:
                console.info(f"rule {message.rule}: its snapshot is written to {self._snapshot()}")
            except MauveError as error:
                console.error(f"rule {message.rule}: no snapshot: {error}")

    def _stamp(self, monotonic: int) -> Any:
        """An instant of the monotonic clock, as ROS counts."""
        clock = self._node.get_clock()
        past_ns = monotonic_ns() - monotonic
        now = clock.now()
        return type(now)(nanoseconds=now.nanoseconds - past_ns, clock_type=now.clock_type).to_msg()


def _silent(kind: str, rules: Sequence["Rule"], topics: Mapping[str, str]) -> set[str]:
    """The resources that conditions of this kind are about."""
    silences = [leaf.parameters for rule in rules for leaf in rule.when.leaves() if leaf.kind == kind]
    return {str(one.get("resource") or topics.get(str(one.get("topic")), "")) for one in silences} - {""}


def _may_be_shown(file: Path) -> bool:
    """Whether a reply may quote a file: it is there and looks like rules, or it is no file at all.

    Who asks may be another account of this machine, which must not read files of the executor's account so.
    """
    if not file.is_file():
        return True
    try:
        data = YamlFile(file, waits=False).data
    except ArchitectureFileError:
        return False
    return isinstance(data, dict) and {"mauve", "rules"} <= data.keys()


def _without_content(error: ArchitectureFileError) -> str:
    return (
        f"{error.file}:{error.line}:{error.column}: this is no rules file, so its content is not shown; "
        f"on the executor's computer `mauve rules check {error.file}` shows more"
    )


def load_reply(rules: OwnRules, path: str, release: Sequence[str] = ()) -> tuple[Code, str]:
    """What comes of loading a file: the code and the words of a reply."""
    try:
        count = rules.load(path, release)
    except ActiveSafetyRuleError as error:
        return Code.ACTIVE_SAFETY_RULE, str(error)
    except NotSchedulableError as error:
        return Code.NOT_SCHEDULABLE, str(error)
    except ArchitectureFileError as error:
        return Code.INVALID, str(error) if _may_be_shown(error.file) else _without_content(error)
    except ParameterError as error:
        return Code.INVALID, str(error)
    except MauveError as error:
        return Code.PREPARE_FAILED, str(error)
    return Code.OK, f"rules at work: {count}" if count else "no rule is the executor's"
