"""What rules and persons want, as requests see it: what they may set, and what it comes to. No ROS."""

import json
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace

from mauve_rt._kernel import ActionStep, ComponentDescription, Overlay, Overlays, OverlaySpec
from mauve_rt.control.requests import OVER_RULES, Code, RefusalError, Request
from mauve_rt.control.runtime import Runtime
from mauve_rt.model.declared_values import read_declared
from mauve_rt.model.schema import PropertyValue
from mauve_rt.model.step_kinds import STEP_KINDS
from mauve_rt.model.steps import Step
from mauve_rt.yaml.text import YamlError, read_yaml

_WAYS_ON = (
    "to put this above the rule, ask over the rules (--over-rules{}); to change what comes back when the "
    "rule ends, ask for the base (--base)"
)


@contextmanager
def wanted(request: Request, runtime: Runtime) -> Iterator[Request]:
    """Around a change: the request with the steps that are to be done now.

    Of a rule: those that lead to what is wanted once it is active, or has ended. Of a person: those that no
    rule keeps from being done.

    Raises:
        RefusalError: HELD_BY_RULE.
    """
    if request.dry_run and request.rule:
        yield request
    elif request.rule:
        with _of_rule(request, runtime) as steps:
            yield replace(request, steps=tuple(steps))
    else:
        with _of_person(request, runtime) as steps:
            yield replace(request, steps=tuple(steps))


def assignment_of(step: Step) -> ActionStep:
    """What a step sets, in plain values."""
    value: PropertyValue | None = None
    if STEP_KINDS[step.kind].value in ("scalar", "resource.service"):
        try:
            read = read_yaml(step.value)
        except YamlError:
            read = step.value
        value = read if isinstance(read, bool | int | float | str) else step.value
    return ActionStep(step.kind, step.target, step.name, value)


def with_declared_values(request: Request, parts: Iterable[ComponentDescription]) -> Request:
    """The request with the values of its properties in the types that the present components declare."""
    if all(step.kind != "set_property" for step in request.steps):
        return request
    types = {(part.name, item.name): item.type for part in parts for item in part.properties}
    steps = tuple(
        _with_declared_value(step, types.get((step.target, step.name), "")) for step in request.steps
    )
    return replace(request, steps=steps)


def _with_declared_value(step: Step, type_name: str) -> Step:
    if step.kind != "set_property" or not type_name:
        return step
    try:
        read, declared = read_yaml(step.value), read_declared(step.value, type_name)
    except YamlError:
        return step  # the plan refuses it
    if type(read) is type(declared):
        return step
    text = read.strip() if isinstance(read, str) else json.dumps(declared, ensure_ascii=False)
    return replace(step, value=text)


def step_of(assignment: ActionStep, known: Sequence[Step] = ()) -> Step:
    """The step that sets this; the one of `known` that does, with all that its value says."""
    found = (assignment.kind, assignment.target, assignment.name)
    for step in known:
        if (step.kind, step.target, step.name) == found and assignment_of(step).is_equal(assignment):
            return step
    value = "" if assignment.value is None else json.dumps(assignment.value)
    return Step(*found, value)


def spec_of(request: Request, present: Overlay | None = None) -> OverlaySpec:
    """What a rule wants by its request; of a release, what that of the `present` overlay leaves."""
    stated = [assignment_of(step) for step in request.steps]
    if not request.release or present is None:
        return OverlaySpec(
            request.rule, stated, priority=request.priority, ends_with_source=request.release_on_loss
        )
    assigns = present.assigns
    stays = len(stated) == len(assigns) and all(map(ActionStep.is_equal, stated, assigns))
    return OverlaySpec(
        request.rule,
        assigns,
        leaves=stated,
        priority=present.priority,
        leaves_over_persons=stays,  # a rule without `undo`: what it did stays
    )


@contextmanager
def _of_rule(request: Request, runtime: Runtime) -> Iterator[list[Step]]:
    architecture = runtime.architecture
    overlays = architecture.overlays
    source = request.requested_by or "a request"
    if request.release:
        overlay = _found(runtime, request.rule, source)
        if overlay is None:
            yield []
            return
        architecture.follow()  # what of it is in force
        overlay = overlays.put(source, spec_of(request, overlay))
        yield _steps(runtime, overlay, request, is_active=False)
        _end(overlays, overlay)
        architecture.note_overlays()
        return
    overlay = overlays.put(source, spec_of(request))
    was_active = overlay.is_active
    architecture.follow()  # what is there before
    steps = _steps(runtime, overlay, request, is_active=True)
    overlays.set_engaged(overlay, is_engaged=True)
    overlays.set_active(overlay, is_active=True)
    try:
        yield steps
    except BaseException:
        if not was_active:
            _end(overlays, overlay)
        raise
    architecture.note_overlays()


def _end(overlays: Overlays, overlay: Overlay) -> None:
    overlays.set_active(overlay, is_active=False)
    overlays.settle_ended()
    overlays.set_engaged(overlay, is_engaged=False)


def _found(runtime: Runtime, rule: str, source: str) -> Overlay | None:
    return next((one for one in runtime.architecture.overlays.at_work(source) if one.rule == rule), None)


def _steps(runtime: Runtime, overlay: Overlay, request: Request, *, is_active: bool) -> list[Step]:
    description = runtime.architecture.describe()
    assignments = runtime.architecture.overlays.steps_if(overlay, is_active, description)
    return [step_of(one, request.steps) for one in assignments]


@contextmanager
def _of_person(request: Request, runtime: Runtime) -> Iterator[list[Step]]:
    overlays = runtime.architecture.overlays
    steps, over, base = _sorted(request, runtime)
    if request.dry_run:
        yield steps
        return
    safety_rule = request.over if request.over != OVER_RULES else ""
    for assignment in over:
        overlays.put_over(assignment, safety_rule)
    try:
        yield steps
    except BaseException:
        for assignment in over:
            overlays.take_off_element(assignment)
        raise
    for assignment in base:
        overlays.set_base(assignment, request.author)
    if base or over:
        runtime.architecture.note_overlays()


def _sorted(request: Request, runtime: Runtime) -> tuple[list[Step], list[ActionStep], list[ActionStep]]:
    """What is to be done now, what of it is over rules, and what is about the base only."""
    overlays = runtime.architecture.overlays
    steps, over, base = [], [], []
    for step in request.steps:
        assignment = assignment_of(step)
        if step.kind == "start" and not request.dry_run:
            overlays.lift_stop(step.target)
        holder = "" if step.kind == "stop" else overlays.holder_against(assignment)
        if holder and request.base:
            base.append(assignment)
            continue
        if holder:
            _check_over(request, step, holder, runtime)
            over.append(assignment)
        steps.append(step)
    return steps, over, base


def _check_over(request: Request, step: Step, holder: str, runtime: Runtime) -> None:
    found = runtime.architecture.overlays.find(holder)
    is_safety = found is not None and found.safety
    if request.over == holder or (request.over == OVER_RULES and not is_safety):
        return
    element = STEP_KINDS[step.kind].element(step.name) or "presence"
    what = f"safety rule '{holder}'" if is_safety else f"rule '{holder}'"
    ways = _WAYS_ON.format(f" {holder}" if is_safety else "")
    raise RefusalError(Code.HELD_BY_RULE, f"the {element} of '{step.target}' is held by {what}; {ways}")
