"""What rules and persons decided, over a restart of the process: put in force, and kept in a file. No ROS."""

import shutil
import time
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from mauve_rt._kernel import (
    HELD_STOPPED,
    KEPT,
    ActionStep,
    KeptState,
    OverlaySpec,
    StateKeeper,
    read_state_file,
)
from mauve_rt.control.limits import RequestLimits
from mauve_rt.control.requests import BY_RULE, RefusalError
from mauve_rt.control.runtime import Runtime
from mauve_rt.control.steps import Plan
from mauve_rt.control.wishes import step_of
from mauve_rt.errors import MauveError, one_line
from mauve_rt.model.steps import Step

_ABOVE_ALL = 2**62  # priority of what holds components stopped


class Remark(NamedTuple):
    """What is found at the start; `level`: a function of a logger."""

    level: str
    text: str


class Restart:
    """The state file of one executor, from configure() to close(). A native thread writes it."""

    def __init__(self, path: Path, *, forget: bool) -> None:
        self._path = path
        self._forget = forget  # once
        self._keeper: StateKeeper | None = None

    def configure(
        self, runtime: Runtime, rules: Iterable[str], safety: Mapping[str, Iterable[str]]
    ) -> list[Remark]:
        """Put in force what the file holds, then follow decisions. The architecture does not run yet.

        `safety`: safety rules, and the components that each is about. Where the file is damaged or cannot be
        written these stay stopped.
        """
        self.close()
        keeper = StateKeeper(runtime.architecture, str(self._path))  # sees the architecture of the file
        state, remarks = self._read()
        is_damaged = any(remark.level == "error" for remark in remarks)
        remarks += _put_in_force(runtime, state, set(rules))
        if is_damaged:
            remarks += _hold_all(runtime, safety)
        keeper.start()
        if problem := keeper.problem():
            remarks.append(Remark("error", f"{problem}; what is decided now does not outlast this process"))
            if not is_damaged:
                remarks += _hold_all(runtime, safety)
        self._keeper = keeper
        return remarks

    def close(self) -> None:
        """Write for the last time."""
        if self._keeper is not None:
            self._keeper.stop()
            self._keeper = None

    def problem(self) -> str:
        """Why the present state is not in the file; "": it is."""
        return self._keeper.problem() if self._keeper is not None else ""

    def _read(self) -> tuple[KeptState, list[Remark]]:
        forget, self._forget = self._forget, False
        try:
            if forget and self._path.exists():
                text = f"{self._path} is put aside as {self._put_aside()}: a fresh start"
                return KeptState(), [Remark("warning", text)]
            return read_state_file(str(self._path)) or KeptState(), []
        except (MauveError, OSError) as error:
            text = f"{self._path}: {one_line(str(error))}; it is put aside as {self._put_aside()}"
            return KeptState(), [Remark("error", text)]

    def _put_aside(self) -> str:
        """A copy of the file: the file itself is there until another one takes its place, whole."""
        aside = self._path.with_suffix(f".{time.strftime('%Y%m%d-%H%M%S')}")
        try:
            shutil.copyfile(self._path, aside)
        except OSError as error:
            return f"nothing: {error.strerror}"
        return aside.name


def _put_in_force(runtime: Runtime, state: KeptState, rules: set[str]) -> list[Remark]:
    architecture = runtime.architecture
    left_out = architecture.restore(state, rules)
    remarks = [
        Remark(
            "warning",
            f"{step_of(base.step)}, asked for by {base.author} before the restart, is not put in: the "
            "architecture file has another value now",
        )
        for base in left_out
    ]
    overlays = architecture.overlays
    for overlay in overlays.active():
        steps = "; ".join(str(step_of(one)) for one in overlay.assigns)
        text = f"rule {overlay.rule} is active, as before the restart: {steps}"
        if overlay.source == KEPT:
            text += f"; no rule of the rules file has its name: mauve rules release {overlay.rule} ends it"
        if overlay.source == HELD_STOPPED:
            text += f"; mauve rules reset {overlay.rule} ends it"
        remarks.append(Remark("warning", text))
    for step in overlays.rejected():
        remarks.append(Remark("warning", f"in quarantine, as before the restart: {step_of(step)}"))
        _take_fallback(runtime, step)
    return remarks + _make(runtime, architecture.restoring_steps())


def _take_fallback(runtime: Runtime, rejected: ActionStep) -> None:
    """The fallback core, where a rejected core leaves the component without one."""
    overlays = runtime.architecture.overlays
    declared = runtime.declared(rejected.target)
    if declared is None or not declared.fallback or overlays.wanted(rejected).by != "none":
        return
    overlays.set_base(ActionStep("replace_core", rejected.target, declared.fallback), "fallback")


def _make(runtime: Runtime, wanted: Sequence[tuple[str, ActionStep]]) -> list[Remark]:
    """One transaction for each author. What a rule wants and cannot be made holds its components stopped."""
    by_author: dict[str, list[Step]] = {}
    for author, step in wanted:
        by_author.setdefault(author, []).append(step_of(step))
    remarks = []
    for author, steps in by_author.items():
        is_rule = author.startswith(BY_RULE)
        if not (why := _commit(runtime, author, steps)):
            if not is_rule:
                words = "; ".join(map(str, steps))
                remarks.append(Remark("info", f"as before the restart, by {author}: {words}"))
        elif is_rule:
            rule = author.removeprefix(BY_RULE)
            targets = {
                step.target
                for overlay in runtime.architecture.overlays.active()
                if overlay.rule == rule
                for step in overlay.assigns
            }
            remarks.append(Remark("error", f"{author} cannot be put in force: {why}"))
            remarks.append(_hold(runtime, rule, targets))
        else:
            failures = [(one, _commit(runtime, author, [one])) for one in steps]
            remarks += [
                Remark("error", f"{one}, by {author} before the restart: {why}")
                for one, why in failures
                if why
            ]
    return remarks


def _commit(runtime: Runtime, author: str, steps: Sequence[Step]) -> str:
    """Why it is not made; "": it is."""
    try:
        plan = Plan(steps, runtime, runtime.components(), limits=RequestLimits(), taken={})
        plan.transaction.by(author)
        runtime.host.commit(plan.transaction)
        runtime.declare(added=plan.added, removed=plan.removed)
    except (RefusalError, MauveError) as error:
        return one_line(str(error))
    return ""


def _hold_all(runtime: Runtime, safety: Mapping[str, Iterable[str]]) -> list[Remark]:
    return [_hold(runtime, rule, components) for rule, components in safety.items()]


def _hold(runtime: Runtime, rule: str, components: Iterable[str]) -> Remark:
    """Keep components stopped until the rule is reset, also over further restarts."""
    overlays = runtime.architecture.overlays
    held = {
        step.target
        for overlay in overlays.at_work(HELD_STOPPED)
        if overlay.rule == rule
        for step in overlay.assigns
    }
    names = sorted(held.union(components))
    for name in names:
        overlays.set_base(ActionStep("start", name), "")
    stops = [ActionStep("stop", name) for name in names]
    spec = OverlaySpec(rule, stops, priority=_ABOVE_ALL, safety=True, latch=True)
    overlay = overlays.put(HELD_STOPPED, spec)
    overlays.set_engaged(overlay, is_engaged=True)
    overlays.set_active(overlay, is_active=True)
    return Remark("error", f"stopped until mauve rules reset {rule}: {', '.join(names)}")
