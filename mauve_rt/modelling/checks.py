"""What is wrong with a model whose form is right: names that do not fit, machines that cannot run.

Each problem has its line and column, what was expected and found, and the remedy.
"""

from collections.abc import Iterable, Iterator, Mapping

from mauve_rt.errors import Problem
from mauve_rt.file_schema.words import did_you_mean, listed
from mauve_rt.file_schema.yaml_file import Location, YamlFile
from mauve_rt.modelling.durations import NS_OF, Duration
from mauve_rt.modelling.keywords import languages_of_keyword
from mauve_rt.modelling.schema import CoreModel, CppType, FsmModel, ModelFile, ShellModel, StateModel
from mauve_rt.modelling.scope import Scope
from mauve_rt.modelling.type_names import NUMBERS, TypeName
from mauve_rt.parts.message_types import PARTS_OF_ACTIONS, action_of

_RESERVED_OF_SHELLS = frozenset(
    """
    ports properties find_port find_property set_context set_bytes bytes configure cleanup description
    implementation read_port write_port call_port event_port add_port property clock_ns period_ns
    log
    """.split()  # noqa: SIM905
)
"""Members of every shell: no port or property has one of these names."""
_RESERVED = frozenset(
    """
    shell configure_hook cleanup_hook adopt take state_fields budget_ns clock_ns period_ns accepts configure
    cleanup description implementation log
    """.split()  # noqa: SIM905 - a list would have a line for each
)
"""Methods of every core: no action or guard has one of these names."""


def problems(file: YamlFile, content: ModelFile, scope: Scope) -> Iterator[Problem]:
    """Everything that is wrong, but for names that another model lacks."""
    checks = _Checks(file, content, scope)
    yield from checks.names()
    yield from checks.types()
    for name, shell in content.shells.items():
        yield from checks.shell(("shells", name), shell)
    for name, core in content.cores.items():
        yield from checks.core(("cores", name), core)
    for name, fsm in content.fsms.items():
        yield from checks.fsm(("fsms", name), fsm)


def warnings(file: YamlFile, content: ModelFile) -> Iterator[Problem]:
    """What is right, but has no effect."""
    used = {core.shell for core in content.cores.values()}
    for name in content.shells if content.cores else ():  # without cores, they are for other packages
        if name not in used:
            yield file.key_problem(
                ("shells", name), f"no core uses shell '{name}'", remedy="remove it, or write a core for it"
            )
    run = {fsm.core for fsm in content.fsms.values()}
    for name in content.cores if content.fsms else ():
        if name not in run:
            yield file.key_problem(
                ("cores", name), f"no fsm calls core '{name}'", remedy="remove it, or write an fsm for it"
            )


def abstract_class(core: str) -> str:
    """The class whose methods an fsm calls, and from which implementations derive; also of `package/Name`."""
    return f"{core}Core"


class _Checks:
    def __init__(self, file: YamlFile, content: ModelFile, scope: Scope) -> None:
        self._file = file
        self._scope = scope
        self._content = content
        self._no_lengths: set[tuple[int, str]] = set()  # properties of shells that were named once

    def names(self) -> Iterator[Problem]:
        """Keywords, and two classes of one name."""
        seen: dict[str, Location] = {}
        for at, name in self._classes():
            yield from self._keyword(at, str(at[-1]))
            if name in seen:
                line = self._file.position(seen[name], key=True)[0]
                remedy = f"rename one of them; the other is in line {line}"
                yield self._file.key_problem(
                    at, f"there are two classes '{name}'", remedy=remedy, code="duplicate_name"
                )
            seen.setdefault(name, at)

    def _classes(self) -> Iterator[tuple[Location, str]]:
        """The places of names, and the classes that are made of them."""
        content = self._content
        for section in ("types", "shells", "fsms", "resources"):
            yield from (((section, name), name) for name in getattr(content, section))
        for name, core in content.cores.items():
            yield ("cores", name), abstract_class(name)
            yield from ((("cores", name, "implementations", one), one) for one in core.implementations)

    def _keyword(self, place: Location, name: str) -> Iterator[Problem]:
        if languages := languages_of_keyword(name):
            what = f"'{name}' is a keyword of {languages[0]}"
            yield self._file.key_problem(
                place, what, expected="a name in C++ and in Python", remedy="rename it"
            )

    def types(self) -> Iterator[Problem]:
        """Structs of the model: their fields, and whether one is within itself."""
        for name, own in self._content.types.items():
            if isinstance(own, CppType):
                continue
            for field, of in own.items():
                yield from self._keyword(("types", name, field), field)
                yield from self._type(("types", name, field), of, is_port=False)
                if isinstance(existing := self._scope.types.get(of.item), CppType):
                    what = f"a message has no field of '{of.item}', a struct that exists in C++"
                    remedy = f"write {existing.name}" if "/msg/" in existing.name else "name its fields here"
                    yield self._file.problem(("types", name, field), what, remedy=remedy)
                if action_of(of.item):
                    what = f"a message has no field of '{of.item}', a message of an action"
                    yield self._file.problem(("types", name, field), what, remedy="name its fields here")
            if name in self._within(name):
                what = f"type '{name}' is within itself"
                yield self._file.key_problem(("types", name), what, remedy="break the cycle")

    def _within(self, name: str) -> set[str]:
        """All types of the model within one."""
        found: set[str] = set()
        ahead = [name]
        while ahead:
            own = self._content.types.get(ahead.pop())
            for of in own.values() if isinstance(own, Mapping) else ():
                if of.item in self._content.types and of.item not in found:
                    found.add(of.item)
                    ahead.append(of.item)
        return found

    def _type(self, place: Location, of: TypeName, *, is_port: bool) -> Iterator[Problem]:
        known = self._scope.types
        numbers = () if is_port else (*NUMBERS, "string")
        if of.item not in (*known, *numbers) and "/" not in of.item:
            remedy = did_you_mean(of.item, [*known, *numbers])
            what = f"unknown type '{of.item}'"
            expected = "a type of the model, or a message such as geometry_msgs/msg/Point"
            yield self._file.problem(place, what, expected=expected, remedy=remedy, code="unknown_type")
        elif "/action/" in of.item and not action_of(of.item):
            what = f"an action is no type of values, found '{of.item}'"
            expected = listed([f"{of.item}_{part}" for part in PARTS_OF_ACTIONS])
            yield self._file.problem(place, what, expected=expected)
        elif is_port and (of.is_list or of.length is not None):
            what = f"a port has values of one type, found '{of.text}'"
            yield self._file.problem(place, what, remedy="make a type with a list in it")
        elif not is_port and not of.is_bounded:
            yield self._unbounded(place, of)

    def _unbounded(self, place: Location, of: TypeName) -> Problem:
        item = f"string<={of.length or 32}" if of.item == "string" else of.item
        example = f"{item}[<=64]" if of.is_list else item
        return self._file.problem(
            place,
            f"type '{of.text}' has no bound",
            expected=f"one with a bound, such as {example}",
            found=of.text,
        )

    def shell(self, place: Location, shell: ShellModel) -> Iterator[Problem]:
        """Names and types of ports and properties."""
        for section, names in (("properties", shell.properties), ("ports", shell.ports)):
            for name in names:
                yield from self._keyword((*place, section, name), name)
                if name in _RESERVED_OF_SHELLS:
                    what = f"every shell has a member '{name}'"
                    yield self._file.key_problem((*place, section, name), what, remedy="rename it")
        for name in shell.ports:
            if name in shell.properties:
                what = f"there are a port and a property '{name}'"
                at = (*place, "ports", name)
                yield self._file.key_problem(at, what, remedy="rename one of them", code="duplicate_name")
        for name, port in shell.ports.items():
            for kind, of in (("read", port.read_type), ("write", port.write)):
                if of is not None:
                    yield from self._type((*place, "ports", name, kind), of, is_port=True)

    def core(self, place: Location, core: CoreModel) -> Iterator[Problem]:
        """Its shell, its methods, its state and what its implementations say of them."""
        if core.shell not in self._scope.shells and "/" not in core.shell:
            yield self._unknown((*place, "shell"), "shell", core.shell, self._scope.shells)
        seen: dict[str, str] = {}
        for kind, names in (("actions", core.actions), ("guards", core.guards), ("state", core.state)):
            for key, name in _entries(names):
                yield from self._method((*place, kind, key), kind, name, seen)
        for name, of in core.state.items():
            yield from self._type((*place, "state", name), of, is_port=False)
        methods = [*core.actions, *core.guards]
        if core.handover is not None:
            yield from self._fixed((*place, "handover", "budget"), core.handover.budget)
        for name, implementation in core.implementations.items():
            for method, wcet in implementation.wcet.items():
                at = (*place, "implementations", name, "wcet", method)
                if method not in methods:
                    what = f"core '{place[1]}' has no action or guard '{method}'"
                    yield self._file.key_problem(at, what, remedy=did_you_mean(method, methods))
                yield from self._fixed(at, wcet)

    def _method(self, place: Location, kind: str, name: str, seen: dict[str, str]) -> Iterator[Problem]:
        point = self._file.key_problem if kind == "state" else self._file.problem
        if languages := languages_of_keyword(name):
            what = f"'{name}' is a keyword of {languages[0]}"
            yield point(place, what, expected="a name in C++ and in Python", remedy="rename it")
        elif name in _RESERVED:
            yield point(place, f"every core has a method '{name}'", remedy="rename it")
        if name in seen:
            what = f"'{name}' is among {seen[name]} already"
            yield point(place, what, remedy="name it once", code="duplicate_name")
        seen.setdefault(name, kind)

    def _fixed(self, place: Location, duration: Duration) -> Iterator[Problem]:
        """A time that no property changes."""
        if duration.property_name or duration.is_forever:
            yield self._file.problem(place, "a worst case is a time of its own", expected="such as 0.2 ms")

    def fsm(self, place: Location, fsm: FsmModel) -> Iterator[Problem]:
        """Its core, its states and where they lead."""
        core = self._scope.cores.get(fsm.core)
        if core is None and "/" not in fsm.core:
            yield self._unknown((*place, "core"), "core", fsm.core, self._scope.cores)
        shell = self._scope.shells.get(core.shell) if core is not None else None
        if fsm.initial not in fsm.states:
            yield self._unknown((*place, "initial"), "state", fsm.initial, fsm.states)
        if fsm.periodic is not None:
            yield from self._wait((*place, "periodic"), fsm.periodic, shell)
        for name, state in fsm.states.items():
            at = (*place, "states", name)
            yield from self._keyword(at, name)
            if core is not None:
                yield from self._methods_of(at, fsm.core, core, state)
            yield from self._branches(at, fsm, state)
            yield from self._waits_of(at, fsm, state, shell)
        if fsm.initial in fsm.states:
            yield from self._paths(place, fsm)

    def _methods_of(
        self, place: Location, name: str, core: CoreModel, state: StateModel
    ) -> Iterator[Problem]:
        if state.run is not None and state.run not in core.actions:
            yield self._no_method((*place, "run"), name, "action", state.run, core)
        for index, branch in enumerate(state.next):
            if branch.guard and branch.guard not in core.guards:
                yield self._no_method((*place, "next", index, "if"), name, "guard", branch.guard, core)

    def _no_method(self, place: Location, core_name: str, kind: str, method: str, core: CoreModel) -> Problem:
        known, others = (core.actions, core.guards) if kind == "action" else (core.guards, core.actions)
        remedy = f"'{method}' is {'a guard' if kind == 'action' else 'an action'}" if method in others else ""
        remedy = remedy or did_you_mean(method, known)
        return self._file.problem(place, f"core '{core_name}' has no {kind} '{method}'", remedy=remedy)

    def _branches(self, place: Location, fsm: FsmModel, state: StateModel) -> Iterator[Problem]:
        last = len(state.next) - 1
        for index, branch in enumerate(state.next):
            at = (*place, "next", index)
            if branch.to not in fsm.states:
                yield self._unknown((*at, "to"), "state", branch.to, fsm.states)
            if index == last and branch.guard:
                what = "the last branch of 'next' has a guard"
                remedy = "add the state for when no guard holds, at the end and without `if`"
                yield self._file.problem(at, what, remedy=remedy)
            if index != last and not branch.guard:
                what = f"the branches behind '{branch.to}' are never taken"
                yield self._file.problem(at, what, remedy="only the last branch has no `if`")
        if state.next and state.wait is not None and state.wait.is_forever:
            what = "a wait that is ended by a stop alone leads nowhere"
            yield self._file.key_problem((*place, "next"), what, remedy="remove `next`")

    def _waits_of(
        self, place: Location, fsm: FsmModel, state: StateModel, shell: ShellModel | None
    ) -> Iterator[Problem]:
        if fsm.periodic is not None and state.run is None:
            kind = "wait" if state.wait is not None else "wait_event"
            what = "a state of a periodic machine executes an action; its wait is the period"
            yield self._file.key_problem((*place, kind), what, expected="run: an action")
        if state.wait is not None:
            yield from self._wait((*place, "wait"), state.wait, shell)
        if (event := state.wait_event) is None:
            return
        yield from self._wait((*place, "wait_event", "timeout"), event.timeout, shell)
        yield from self._wait((*place, "wait_event", "min_interarrival"), event.min_interarrival, shell)
        if event.min_interarrival.is_forever:
            at = (*place, "wait_event", "min_interarrival")
            yield self._file.problem(at, "two releases are a time apart", expected="a time such as 10 ms")
        for index, name in enumerate(event.inputs):
            port = shell.ports.get(name) if shell is not None else None
            if shell is not None and (port is None or port.read_type is None):
                known = [each for each, one in shell.ports.items() if one.read_type is not None]
                what = f"the shell has no read port '{name}'"
                yield self._file.problem(
                    (*place, "wait_event", "inputs", index), what, remedy=did_you_mean(name, known)
                )

    def _wait(self, place: Location, duration: Duration, shell: ShellModel | None) -> Iterator[Problem]:
        """Whether a property that is the length of a wait can be one."""
        name = duration.property_name
        if not name or shell is None:
            return
        one = shell.properties.get(name)
        if one is None:
            yield self._unknown(place, "property", name, shell.properties)
            return
        remedy = ""
        if one.type != "int64" or one.unit not in NS_OF:
            remedy = f"give it the type int64 and one of the units {listed(NS_OF)}"
        elif one.minimum is None or one.minimum < 1:
            remedy = "give it a minimum of 1 or more: a wait has a length"
        elif one.maximum is not None and duration.factor * int(one.maximum) * NS_OF[one.unit] >= 2**63:
            remedy = "lower its maximum: the wait is longer than 292 years"
        elif "fsm" not in one.read_by:
            remedy = "add `read_by: fsm` to it: a machine reads it when it is configured"
        if remedy and (id(shell), name) not in self._no_lengths:
            self._no_lengths.add((id(shell), name))
            what = f"property '{name}' is no length of a wait"
            yield self._file.problem(place, what, found=_told(one.type, one.unit, one.minimum), remedy=remedy)

    def _paths(self, place: Location, fsm: FsmModel) -> Iterator[Problem]:
        """States that nothing leads to, and cycles without a wait."""
        reached = {fsm.initial}
        ahead = [fsm.initial]
        while ahead:
            for branch in fsm.states[ahead.pop()].next:
                if branch.to in fsm.states and branch.to not in reached:
                    reached.add(branch.to)
                    ahead.append(branch.to)
        for name in fsm.states:
            if name not in reached:
                what = f"state '{name}' is never reached from '{fsm.initial}'"
                remedy = "lead a state to it, or remove it"
                yield self._file.key_problem((*place, "states", name), what, remedy=remedy)
        if fsm.periodic is None and (cycle := _cycle_without_wait(fsm, reached)):
            what = f"the cycle {' -> '.join([*cycle, cycle[0]])} has no wait"
            remedy = "put a wait into it: a component that never waits is an error"
            at = (*place, "states", cycle[0])
            yield self._file.key_problem(at, what, remedy=remedy, code="loop_without_wait")

    def _unknown(self, place: Location, kind: str, name: str, known: Iterable[str]) -> Problem:
        return self._file.problem(place, f"there is no {kind} '{name}'", remedy=did_you_mean(name, known))


def _entries(names: list[str] | Mapping[str, object]) -> Iterator[tuple[int | str, str]]:
    return enumerate(names) if isinstance(names, list) else zip(names, names, strict=True)


def _told(type_name: str, unit: str, minimum: float | None) -> str:
    return f"type {type_name}, unit '{unit}', " + (
        "no minimum" if minimum is None else f"minimum {minimum:g}"
    )


def _cycle_without_wait(fsm: FsmModel, reached: set[str]) -> list[str]:
    """The first cycle of execution states alone, in the order of the file; empty: there is none."""
    done: set[str] = set()

    def visit(name: str, path: list[str]) -> list[str]:
        if name in path:
            return path[path.index(name) :]
        state = fsm.states.get(name)
        if state is None or state.run is None or name in done:
            return []
        for branch in state.next:
            if found := visit(branch.to, [*path, name]):
                return found
        done.add(name)
        return []

    for name in fsm.states:
        if name in reached and (found := visit(name, [])):
            return found
    return []
