"""What can be told of a request without a look at the steps' effects: form and time. Knows no ROS."""

import math

from mauve_rt._kernel import ComponentDescription
from mauve_rt.control.requests import Code, RecordingOrder, RefusalError, ReloadOrder, Request
from mauve_rt.control.runtime import Runtime
from mauve_rt.file_schema.words import did_you_mean, shown
from mauve_rt.model.step_kinds import STEP_KINDS
from mauve_rt.model.steps import LONGEST_IDLE_S, Step
from mauve_rt.trace.bag.recorded import COMPRESSIONS, FILES_OF_A_BAG, MIN_WINDOW_BYTES, Split

MAX_TIMEOUT_S = 10.0
MAX_TEXT = 1000
MAX_VALUE = 20_000
MAX_STEPS = 100
MAX_TOPICS = 100
MAX_TARGETS = 100
MIN_SPLIT_S, MAX_SPLIT_S = 1.0, 1e6
MIN_SPLIT_BYTES = 100_000
MIN_SNAPSHOT_S = 1.0


def _check_seconds(name: str, found_s: float, most_s: float) -> None:
    if not math.isfinite(found_s) or not 0.0 <= found_s <= most_s:
        text = f"bad {name}: expected 0 (the default) to {most_s:g} s, found {found_s:g}"
        raise RefusalError(Code.INVALID, text)


def check_form(request: Request) -> None:
    """Whether a request makes sense at all.

    Raises:
        RefusalError: INVALID.
    """
    _check_seconds("timeout", request.timeout_s, MAX_TIMEOUT_S)
    _check_seconds("idle_within_s", request.idle_within_s, LONGEST_IDLE_S)
    if request.clock_ns < 0:
        text = f"bad clock_ns: expected 0 or an instant, found {request.clock_ns}"
        raise RefusalError(Code.INVALID, text)
    texts = [request.request_id, request.requested_by, request.cause]
    texts += [text for step in request.steps for text in (step.kind, step.target, step.name)]
    if any(len(text) > MAX_TEXT for text in texts):
        raise RefusalError(Code.INVALID, f"a text of the request is longer than {MAX_TEXT} characters")
    if any(len(step.value) > MAX_VALUE for step in request.steps):
        raise RefusalError(Code.INVALID, f"the value of a step is longer than {MAX_VALUE} characters")
    if request.recording is not None:
        _check_recording(request.recording)
        return
    if request.reload is not None:
        _check_reload(request.reload)
        return
    _check_rule(request)
    if not (0 if request.release else 1) <= len(request.steps) <= MAX_STEPS:
        found = f"of {len(request.steps)} steps" if request.steps else "without a step"
        raise RefusalError(Code.INVALID, f"a transaction {found}: expected 1 to {MAX_STEPS}")
    for number, step in enumerate(request.steps, start=1):
        if step.kind not in STEP_KINDS:
            where = f"step {number}: " if len(request.steps) > 1 else ""
            text = f"{where}unknown kind of step {shown(step.kind)}; {did_you_mean(step.kind, STEP_KINDS)}"
            raise RefusalError(Code.INVALID, text)


def check_time(request: Request, runtime: Runtime) -> None:
    """Whether it is the moment for a request.

    Raises:
        RefusalError: NOT_ACTIVE or WRONG_REVISION.
    """
    only_properties = all(step.kind == "set_property" for step in request.steps)
    if not runtime.active and not (only_properties and runtime.configured):
        needed = "configure" if only_properties else "activate"
        text = f"the executor is not active; {needed} it first (lifecycle)"
        raise RefusalError(Code.NOT_ACTIVE, text)
    check_revision(request, runtime)


def check_revision(request: Request, runtime: Runtime) -> None:
    """Whether the architecture is at the revision that the request expects.

    Raises:
        RefusalError: WRONG_REVISION.
    """
    revision = runtime.revision
    if request.expected_revision not in (0, revision):
        text = f"the architecture is at revision {revision}, the request expected {request.expected_revision}"
        raise RefusalError(Code.WRONG_REVISION, f"{text}; read ~/state, then ask again")


def _check_reload(order: ReloadOrder) -> None:
    if len(order.targets) > MAX_TARGETS or any(len(text) > MAX_TEXT for text in order.targets):
        text = f"expected at most {MAX_TARGETS} targets, and none longer than {MAX_TEXT} characters"
        raise RefusalError(Code.INVALID, text)
    if len(order.probation) > MAX_VALUE:
        raise RefusalError(Code.INVALID, f"the probation is longer than {MAX_VALUE} characters")
    if order.back and order.probation:
        text = "the way back needs no probation: that code ran before; leave probation_s out"
        raise RefusalError(Code.INVALID, text)


def _check_rule(request: Request) -> None:
    if request.release and not request.rule:
        raise RefusalError(Code.INVALID, "a release is of a rule: name it")
    if request.rule and (request.over or request.base):
        raise RefusalError(Code.INVALID, "over and base are of persons' requests: leave them or the rule out")


def _check_recording(order: RecordingOrder) -> None:
    texts = [order.bag, *order.topics, *order.topic_regexes, *order.values]
    many = max(len(order.topics) + len(order.topic_regexes), len(order.values))
    if many > MAX_TOPICS or any(len(text) > MAX_TEXT for text in texts):
        what = f"{MAX_TOPICS} topics and {MAX_TOPICS} values"
        text = f"expected at most {what}, and no text longer than {MAX_TEXT} characters"
        raise RefusalError(Code.INVALID, text)
    if "\0" in order.bag:
        raise RefusalError(Code.INVALID, "bag: a folder's name has no null character")
    if order.split_s != 0 and not MIN_SPLIT_S <= order.split_s <= MAX_SPLIT_S:
        text = f"bad split_s: expected 0 (the default) or {MIN_SPLIT_S:g} to {MAX_SPLIT_S:g} s"
        raise RefusalError(Code.INVALID, f"{text}, found {order.split_s:g}")
    if order.split_bytes != 0 and order.split_bytes < MIN_SPLIT_BYTES:
        text = f"bad split_bytes: expected 0 (any size) or at least {MIN_SPLIT_BYTES:,}"
        raise RefusalError(Code.INVALID, f"{text}, found {order.split_bytes:,}")
    _check_window(order)
    if order.compression not in ("", *COMPRESSIONS):
        text = f"bad compression: expected {' or '.join(COMPRESSIONS)}, found {shown(order.compression)}"
        raise RefusalError(Code.INVALID, text)
    if order.max_size_bytes != 0:
        split = Split(after_bytes=order.split_bytes, max_bytes=order.max_size_bytes)
        least = f"expected 0 (no limit) or at least {FILES_OF_A_BAG * MIN_SPLIT_BYTES:,} bytes"
        small = f"{least}, found {split.max_bytes:,}" if split.file_bytes < MIN_SPLIT_BYTES else ""
        if misfit := small or split.misfit():
            raise RefusalError(Code.INVALID, f"bad max_size_bytes: {misfit}")


def check_state(step: Step, component: ComponentDescription) -> None:
    """Whether a start or stop finds the component in the other state.

    Raises:
        RefusalError: NOT_RUNNING or ALREADY_RUNNING.
    """
    if step.kind == "stop" and component.state in ("STOPPED", "UNCONFIGURED"):
        raise RefusalError(Code.NOT_RUNNING, f"component '{component.name}' is already stopped")
    if step.kind == "start" and component.state == "RUNNING":
        raise RefusalError(Code.ALREADY_RUNNING, f"component '{component.name}' is already running")


def _check_window(order: RecordingOrder) -> None:
    if order.snapshot_s != 0 and not MIN_SNAPSHOT_S <= order.snapshot_s <= MAX_SPLIT_S:
        text = f"bad snapshot_s: expected 0 (record into a bag) or {MIN_SNAPSHOT_S:g} to {MAX_SPLIT_S:g} s"
        raise RefusalError(Code.INVALID, f"{text}, found {order.snapshot_s:g}")
    if order.snapshot_bytes != 0 and not order.snapshot_s:
        text = "bad snapshot_bytes: it limits the memory of snapshot_s; give snapshot_s, too"
        raise RefusalError(Code.INVALID, text)
    if order.snapshot_bytes != 0 and order.snapshot_bytes < MIN_WINDOW_BYTES:
        text = f"bad snapshot_bytes: expected 0 (the default) or at least {MIN_WINDOW_BYTES:,}"
        raise RefusalError(Code.INVALID, f"{text}, found {order.snapshot_bytes:,}")
