"""What is wanted of each element: the kernel beside the reference, over random histories."""

import random
from dataclasses import replace

import pytest
from overlays_model import ModelRule, OverlaysModel

from mauve_rt._kernel import ActionStep, Overlays, OverlaySpec, RuleEngine, RuleSpec, WhenSpec

HISTORIES = 2_000
EVENTS = 40
ELEMENTS = ("core a", "core b", "runs a", "limit b")
STOPPED, RUNNING = 1.0, 2.0  # of a component, on which a part of each condition depends
STATES = {"running": "start", "stopped": "stop"}


def _step(element: str, value: str) -> ActionStep:
    what, target = element.split()
    if what == "core":
        return ActionStep("replace_core", target, value)
    if what == "runs":
        return ActionStep(STATES[value], target)
    return ActionStep("set_property", target, what, value)


def _value(element: str, step: ActionStep) -> str:
    what, _ = element.split()
    if what == "core":
        return step.name
    if what == "runs":
        return next(value for value, kind in STATES.items() if kind == step.kind)
    return str(step.value)


class Beside:
    """The kernel's overlays, and the reference."""

    def __init__(self, random_: random.Random) -> None:
        self.random = random_
        self.kernel = Overlays()
        self.model = OverlaysModel({name: "running" if name == "runs a" else "nominal" for name in ELEMENTS})
        for name, value in self.model.base.items():
            self.kernel.set_base(_step(name, value), "")
        self.names = 0
        self.now_ns = 0
        self.load(self.any_rules())

    # ---- what happens to both

    def any_rules(self) -> list[ModelRule]:
        rules = [
            ModelRule(
                "estop",
                0,
                (("core a", "safe"), ("runs a", "stopped"), ("limit b", "0")),
                safety=True,
                latch=self.random.random() < 0.5,
            )
        ]
        for number in range(4):
            picked = self.random.sample(ELEMENTS, self.random.randint(1, 3))
            do = tuple((name, self._any_value(name, number)) for name in picked)
            latch, whole = self.random.random() < 0.2, self.random.random() < 0.2
            rules.append(ModelRule(f"r{number}", self.random.randrange(3), do, latch=latch, whole=whole))
        return rules

    def _any_value(self, element: str, number: int) -> str:
        return self.random.choice(("running", "stopped")) if element == "runs a" else f"v{number}"

    def load(self, rules: list[ModelRule]) -> None:
        kept = {rule.name for rule in rules}
        for overlay in self.kernel.at_work(""):
            if overlay.rule not in kept:
                self.kernel.set_active(overlay, is_active=False)
        self.kernel.settle_ended()
        specs = [
            OverlaySpec(
                rule.name,
                [_step(*each) for each in rule.do],
                priority=rule.priority,
                safety=rule.safety,
                whole=rule.whole,
            )
            for rule in rules
        ]
        self.overlays = {overlay.rule: overlay for overlay in self.kernel.load("", specs)}
        self.kernel.settle_ended()
        self.model.load(rules)
        self.model.conditions = dict.fromkeys(self.model.rules)  # nothing was received by these
        self._load_engine(rules)

    def _load_engine(self, rules: list[ModelRule]) -> None:
        self.numbers = {rule.name: number for number, rule in enumerate(rules)}
        self.engine = RuleEngine([self._spec(rule) for rule in rules])
        for name, number in self.numbers.items():
            if self.overlays[name].is_active:
                self.engine.adopt(number, is_active=True, now_ns=self.now_ns)
        self.engine.arm(self.now_ns)
        self._follow()

    def _spec(self, rule: ModelRule) -> RuleSpec:
        value = WhenSpec("value", parameters={"topic": rule.name, "field": "x", "above": 0.5})
        known = WhenSpec("not", parts=[WhenSpec("fault", parameters={"component": "c"})])
        when = WhenSpec("all", parts=[value, known])
        return RuleSpec(
            rule.name,
            when,
            undoes=True,
            priority=rule.priority,
            about=sorted({name.split()[1] for name in rule.assigns}),
            safety=rule.safety,
            latch=rule.latch,
        )

    def condition(self) -> None:
        name = self.random.choice(list(self.model.rules))
        holds = self.random.choice([True, False, None])
        before = {element: self.model.wanted(element) for element in ELEMENTS}
        self.model.condition(name, holds=holds)
        number = self.numbers[name]
        self.now_ns += 1
        if holds is None:
            assert before == {element: self.model.wanted(element) for element in ELEMENTS}
        value, *states = range(3 * number, 3 * number + 3)  # of the value, and two of the component
        self.engine.tell(value, self.now_ns, 0.0 if holds is False else 1.0)
        for state in states:
            self.engine.tell(state, self.now_ns, STOPPED if holds is None else RUNNING)
        self._follow()

    def _follow(self) -> None:
        """Let the engine decide; what it wants done is done at once, but for a few that fail."""
        self.engine.step(self.now_ns)
        while (pending := self.engine.pending) is not None:
            self.engine.begun(self.now_ns)
            how = self.random.choice(["done", "done", "done", "refused"])
            self.engine.ended(pending.rule, pending.act, how, self.now_ns)
            self.engine.step(self.now_ns)
        for name, overlay in self.overlays.items():
            self.kernel.set_active(overlay, is_active=self.engine.status(self.numbers[name]).active)
        self.kernel.settle_ended()

    def edit(self) -> None:
        name = self.random.choice(list(self.model.rules))
        rules = self.model.rules.values()
        new = [replace(one, do=one.do[:1]) if one.name == name else one for one in rules]
        self.load(new)

    def drop(self) -> None:
        name = self.random.choice(list(self.model.rules))
        rules = list(self.model.rules.values())
        self.load([one for one in rules if one.name != name] if len(rules) > 1 else self.any_rules())

    def request(self) -> None:
        element = self.random.choice([name for name in ELEMENTS if name != "runs a"])
        over = self.random.choice([None, None, "", "estop"])
        self.names += 1
        value = f"by hand {self.names}"
        step = _step(element, value)
        holder = self.kernel.holder_against(step)
        assert self.model.request(element, value, over=over) == (not holder or over is not None)
        if holder and over is not None:
            self.kernel.put_over(step, over)
        elif not holder:
            self.kernel.note(step, "operator")

    def stop(self) -> None:
        self.model.stopped.add("runs a")
        self.kernel.note(ActionStep("stop", "a"), "operator")

    def start(self) -> None:
        self.model.stopped.discard("runs a")
        self.kernel.lift_stop("a")

    def reject(self) -> None:
        element = self.random.choice(ELEMENTS)
        value, who = self.model.wanted(element)
        self.model.reject(element)
        if who not in ("none", "stop"):
            self.kernel.reject(_step(element, value))
            assert self.model.wanted(element)[0] != value

    def reset(self) -> None:
        name = self.random.choice(list(self.model.rules))
        assert self.engine.reset(self.numbers[name], self.now_ns) == self.model.reset(name)
        self._follow()

    # ---- what must be

    def check(self) -> None:
        assert {name for name, one in self.overlays.items() if one.is_active} == self.model.active
        for element, value in self.model.base.items():
            wanted = self.kernel.wanted(_step(element, value))
            expected, who = self.model.wanted(element)
            found = wanted.rule if wanted.by == "rule" else wanted.by
            assert found == who, f"{element}: wanted by {who}"
            if who != "none":
                assert wanted.step is not None
                assert _value(element, wanted.step) == expected, element
        for element, value in self.model.rules["estop"].do if "estop" in self.model.active else ():
            over = self.model.over.get(element, ("", ""))[1]
            excuse = (
                (element, value) in self.model.rejected or element in self.model.stopped or over == "estop"
            )
            assert excuse or self.model.wanted(element) == (value, "estop"), "a safety rule is not in force"


@pytest.mark.parametrize("first", range(0, HISTORIES, 200))
def test_what_is_wanted_is_as_the_reference_says(first: int) -> None:
    """Conditions, loads, requests, stops, rejections and resets in any order."""
    events = ["condition"] * 6 + ["edit", "drop", "request", "request", "stop", "start", "reject", "reset"]
    for seed in range(first, first + 200):
        both = Beside(random.Random(seed))  # noqa: S311
        said = []
        for _ in range(EVENTS):
            event = both.random.choice(events)
            said.append(event)
            try:
                getattr(both, event)()
                both.check()
            except AssertionError as error:
                raise AssertionError(f"seed {seed}, after {', '.join(said)}: {error}") from error
