"""`mauve analyze FILE|NODE|BAG`: does each component of an architecture meet its deadline?"""

import argparse
import json
import math
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mauve_rt.cli.bag_arguments import is_bag
from mauve_rt.cli.verb import BAD_USAGE, FORECAST, NOT_PROVED, OK, REFUSED, REFUTED
from mauve_rt.counts import counted
from mauve_rt.unfinished import beside

if TYPE_CHECKING:
    from mauve_rt.analysis.bounds import Bound, Subject
    from mauve_rt.analysis.machines import ExecutionTime, Machine
    from mauve_rt.analysis.refutation import Measured
    from mauve_rt.model.threads import ThreadList
    from mauve_rt.modelling.package_model import PackageModel
    from mauve_rt.trace.reading.statistics import ComponentStatistics, Distribution

    Budgets = Mapping[str, ExecutionTime]


@dataclass(frozen=True)
class _Model:
    """What is analyzed."""

    components: "list[Machine]"
    threads: "ThreadList | None"
    """Beside the components; None: nothing tells of them."""


_LEAST_MARGIN = 1.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """What to analyze, and where missing times come from."""
    parser.add_argument(
        "target", metavar="FILE|NODE|BAG", help="an architecture file, the node of an executor, or a bag"
    )
    parser.add_argument(
        "--model",
        type=Path,
        action="append",
        default=[],
        metavar="MODEL",
        help="take parts of an architecture FILE from this model of a package; may be repeated",
    )
    parser.add_argument(
        "--budget-from",
        type=Path,
        metavar="BAG",
        help="for times that are not declared, take the longest that this bag measured",
    )
    parser.add_argument(
        "--margin",
        type=float,
        default=1.2,
        metavar="X",
        help="factor for the times of --budget-from (default 1.2)",
    )
    parser.add_argument(
        "--write",
        action="store_true",
        help="write the measured times into FILE as wcet_ns (nothing enforces wcet_ns)",
    )
    parser.add_argument(
        "--suppose",
        action="append",
        default=[],
        metavar="COMPONENT.STATE=TIME",
        help="assume this time of a state, e.g. guidance.Planning=20ms; may be repeated",
    )
    wakeup = parser.add_mutually_exclusive_group()
    wakeup.add_argument(
        "--wakeup-us",
        type=float,
        metavar="X",
        help="longest time from an instant to the start of its thread, in us, in place of the declared one",
    )
    parser.add_argument(
        "--overhead-ns",
        type=int,
        metavar="X",
        help="cost of a release beside the states, in ns, in place of the declared one",
    )
    wakeup.add_argument(
        "--doctor",
        type=Path,
        metavar="JSON",
        help="take both of them from this output of `mauve doctor --json`: the verdict is a forecast",
    )
    parser.add_argument(
        "--witness",
        type=Path,
        metavar="DIR",
        help="if a deadline is missed, write the run that misses it as a bag for mauve report",
    )
    parser.add_argument("--json", action="store_true", help="print the result as JSON")


def main(args: argparse.Namespace) -> int:
    """Print the model and the verdict; returns the exit status."""
    from mauve_rt.analysis.bounds import Subject, bounds_of  # noqa: PLC0415 - only this verb
    from mauve_rt.analysis.locks import with_measured_holds  # noqa: PLC0415
    from mauve_rt.analysis.obstacles import assumptions_about, unknown_costs  # noqa: PLC0415
    from mauve_rt.analysis.refutation import contradictions  # noqa: PLC0415
    from mauve_rt.analysis.threads import machines_of  # noqa: PLC0415
    from mauve_rt.analysis.verdict import judge  # noqa: PLC0415
    from mauve_rt.cli.supposed import with_supposed  # noqa: PLC0415

    if wrong := _wrong_arguments(args):
        print(f"mauve: {wrong}", file=sys.stderr)
        return BAD_USAGE
    model = _model(args.target, args.model)
    components = model.components
    bag = args.budget_from or (Path(args.target) if is_bag(Path(args.target)) else None)
    statistics = _statistics(bag) if bag is not None else {}
    measured = _measured(statistics)
    if args.budget_from is not None:
        budgets, holds = _budgets(args.budget_from, statistics, args.margin)
        declared = components
        components = [one.with_budgets(budgets.get(one.name, {})) for one in components]
        components = with_measured_holds(components, holds)
        if args.write:
            _write(Path(args.target), declared, components)
    components = with_supposed(components, args.suppose)
    threads = _with_costs(model.threads, args)
    machines = [*components, *machines_of(threads.tasks, components)]
    unknown = [*unknown_costs(threads)]
    if model.threads is None:
        unknown.append("the bag does not tell which threads run beside the components: record it again")
    wakeup_ns = max(threads.wakeup_ns, 0)
    overhead_ns = max(threads.overhead_ns, 0)
    subjects = [Subject.of(machine, machines, overhead_ns=overhead_ns) for machine in machines]
    bounds = bounds_of(subjects, wakeup_ns=wakeup_ns)
    verdict = judge(
        subjects,
        bounds,
        wakeup_ns=wakeup_ns,
        unknown=unknown,
        measured=["this computer"] if args.doctor is not None else [],
        contradictions=[*contradictions(subjects, bounds, measured, wakeup_ns=wakeup_ns)],
    )
    assumptions = [*assumptions_about(components)]
    assumptions += [
        f"the parts of {path} are written in C++, but for implementations with a module"
        for path in args.model
    ]
    if args.json:
        judged = {"outcome": verdict.outcome, "sentence": verdict.sentence, "unknown": unknown}
        parts = [_as_json(subject, bounds) for subject in subjects]
        told = {
            "components": [part for part in parts if part["is_component"]],
            "threads": [part for part in parts if not part["is_component"]],
            "wakeup_ns": wakeup_ns,
            "overhead_ns": overhead_ns,
            "verdict": judged,
            "assumptions": assumptions,
        }
        print(json.dumps(told, indent=2))
    else:
        from mauve_rt.cli.analyze_view import print_model, print_verdict  # noqa: PLC0415

        print_model(subjects, bounds, threads)
        print_verdict(verdict, subjects, assumptions, unknown)
    if verdict.witness is not None and args.witness is not None:
        from mauve_rt.cli.witness_bag import write_witness  # noqa: PLC0415

        write_witness(args.witness, [subject.machine for subject in subjects], verdict.witness)
        print(f"{args.witness}: a bag of that run; mauve report {args.witness} opens at it", file=sys.stderr)
    return STATUSES[verdict.outcome.name]


STATUSES = {
    "SCHEDULABLE": OK,
    "NOT_SCHEDULABLE": REFUSED,
    "NOT_PROVABLE": NOT_PROVED,
    "NOT_PROVED": NOT_PROVED,
    "FORECAST": FORECAST,
    "REFUTED": REFUTED,
}
"""By the outcome's name."""


def _wrong_arguments(args: argparse.Namespace) -> str:
    if not math.isfinite(args.margin) or args.margin < _LEAST_MARGIN:
        return f"--margin: expected 1 or more, found {args.margin:g}"
    if args.wakeup_us is not None and (not math.isfinite(args.wakeup_us) or args.wakeup_us < 0):
        return f"--wakeup-us: expected 0 or more, found {args.wakeup_us:g}"
    if args.overhead_ns is not None and args.overhead_ns < 0:
        return f"--overhead-ns: expected 0 or more, found {args.overhead_ns}"
    if args.write and (args.budget_from is None or not Path(args.target).is_file()):
        return "--write: expected an architecture FILE and --budget-from BAG"
    return ""


def _with_costs(told: "ThreadList | None", args: argparse.Namespace) -> "ThreadList":
    """The threads, with the costs of a release that the command line says."""
    from mauve_rt.model.threads import ThreadList  # noqa: PLC0415

    threads = told or ThreadList(-1, -1, ())
    if args.doctor is not None:
        threads = replace(threads, **_measured_costs(args.doctor))
    if args.wakeup_us is not None:
        threads = replace(threads, wakeup_ns=round(args.wakeup_us * 1e3))
    if args.overhead_ns is not None:
        threads = replace(threads, overhead_ns=args.overhead_ns)
    return threads


def _measured_costs(path: Path) -> dict[str, int]:
    """What a release costs by `mauve doctor --json`, as fields of a ThreadList.

    Raises:
        ParameterError: the file has no such figures.
    """
    from mauve_rt.errors import ParameterError, exception_text  # noqa: PLC0415

    try:
        wakeup = json.loads(path.read_text("utf-8"))["wakeup"]
        costs = {"wakeup_ns": float(wakeup["wakeup_us"]) * 1e3, "overhead_ns": float(wakeup["overhead_ns"])}
    except OSError as error:
        raise ParameterError(f"--doctor: {path}: {error.strerror}") from None
    except (ValueError, KeyError, TypeError) as error:
        what = f"--doctor: {path} has no wake-up latency ({exception_text(error)})"
        raise ParameterError(f"{what}; write it with `mauve doctor --json`, without --seconds 0") from None
    for name, cost_ns in costs.items():
        if not math.isfinite(cost_ns) or cost_ns < 0:
            raise ParameterError(f"--doctor: {path}: {name}: expected 0 or more, found {cost_ns:g}")
    return {name: math.ceil(cost_ns) for name, cost_ns in costs.items()}


def _model(target: str, models: Sequence[Path]) -> _Model:
    """The components of what is named, and the threads beside them."""
    path = Path(target)
    if not path.exists() and target.startswith("/"):
        return _of_node(target)
    return _of_bag(path) if is_bag(path) else _of_file(path, models)


def _of_file(path: Path, models: Sequence[Path]) -> _Model:
    from mauve_rt.analysis.machines import Machine  # noqa: PLC0415
    from mauve_rt.model import build, load_architecture, previewed_states  # noqa: PLC0415
    from mauve_rt.model.modelled_parts import modelled_parts  # noqa: PLC0415
    from mauve_rt.model.threads import thread_list, uses_of  # noqa: PLC0415
    from mauve_rt.modelling.loading import ModelLoader  # noqa: PLC0415

    model = load_architecture(path, runs_here=False)
    loader = ModelLoader(models)
    found = [loader.load(each) for each in models]
    parts = modelled_parts(found)
    in_python = {name: is_one for each in found for name, is_one in _modelled(each).items()}
    architecture = build(model, parts.registry, index=parts.index)
    states = previewed_states(model, architecture)
    kinds = {name: resource.kind for name, resource in model.resources.items()}
    machines = [
        Machine.of(
            part, states=states[part.name], is_python=_is_python(part, parts.index, in_python), kinds=kinds
        )
        for part in architecture.components()
    ]
    if models:
        machines = [
            machine if machine.is_python else machine.without_locks(_wait_free(part, kinds))
            for machine, part in zip(machines, architecture.components(), strict=True)
        ]
    has_bounds = any(state.limit_ns for machine in machines for state in machine.states)
    threads = thread_list(
        model.executor, uses_of(model), components=len(model.components), has_bounds=has_bounds
    )
    return _Model(machines, threads)


def _wait_free(part: Any, kinds: Mapping[str, str]) -> set[str]:
    """Resources that a part reads without a lock when it is in C++, as the parts of a model will be."""
    locking = {port.resource for port in part.ports if port.kind != "read"}
    return {port.resource for port in part.ports if kinds.get(port.resource) == "shared_data"} - locking


def _of_node(node: str) -> _Model:
    from mauve_msgs.srv import ListComponents, ListTasks  # noqa: PLC0415
    from mauve_rt.cli.client import connected  # noqa: PLC0415

    with connected(first=True) as client:
        reply = client.call(ListComponents, f"{node}/list_components", ListComponents.Request())
        threads = client.call(ListTasks, f"{node}/list_tasks", ListTasks.Request()).list
    kinds = {resource.name: resource.kind for resource in reply.resources}
    return _Model(_of_told(reply.components, kinds), _threads_of(threads))


def _threads_of(told: Any) -> "ThreadList":
    """Of a mauve_msgs/msg/TaskList."""
    from mauve_rt.model.threads import ThreadList  # noqa: PLC0415

    return ThreadList(int(told.wakeup_ns), int(told.overhead_ns), tuple(told.tasks))


def _of_bag(path: Path) -> _Model:
    import mauve_rt.trace  # noqa: PLC0415
    from mauve_rt.trace.errors import TraceError  # noqa: PLC0415

    trace = mauve_rt.trace.open(path)
    if not trace.architecture:
        raise TraceError(f"bag {path}: it does not tell the architecture; record it again with this version")
    threads = None if trace.threads is None else _threads_of(trace.threads)
    return _Model(_of_told(trace.architecture, {}), threads)


def _of_told(components: Iterable[Any], kinds: Mapping[str, str]) -> "list[Machine]":
    from mauve_rt.analysis.machines import Machine  # noqa: PLC0415
    from mauve_rt.model import PluginIndex  # noqa: PLC0415

    index = PluginIndex.installed()
    return [Machine.of(part, is_python=_is_python(part, index), kinds=kinds) for part in components]


def _modelled(model: "PackageModel") -> dict[str, bool]:
    """The parts of a model by their names, and whether they are said to be in Python."""
    content = model.content
    parts = dict.fromkeys((*content.shells, *content.fsms), False)
    for core in content.cores.values():
        parts |= {name: bool(one.module) for name, one in core.implementations.items()}
    return {model.registered(name): is_python for name, is_python in parts.items()}


def _is_python(part: Any, index: Any, modelled: Mapping[str, bool] | None = None) -> bool | None:
    """Whether one of its parts is in Python; None: not known. `modelled`: of parts that a model describes."""
    known = modelled or {}
    named = (("shell", part.shell), ("core", part.core), ("fsm", part.fsm))
    plugins = [index.find(kind, name) for kind, name in named if name not in known]
    if any(known.get(name) for _, name in named) or any(
        each is not None and each.is_python for each in plugins
    ):
        return True
    return None if None in plugins else False


def _statistics(bag: Path) -> "dict[str, ComponentStatistics]":
    import mauve_rt.trace  # noqa: PLC0415
    from mauve_rt.trace.reading.statistics import all_statistics  # noqa: PLC0415

    return all_statistics(mauve_rt.trace.open(bag))


def _measured(statistics: "Mapping[str, ComponentStatistics]") -> "dict[str, Measured]":
    from mauve_rt.analysis.refutation import Measured  # noqa: PLC0415

    return {
        name: Measured(
            response_ns=one.response.max_ns,
            wakeup_ns=one.wakeup.max_ns,
            execution_ns={state: each.max_ns for state, each in one.execution.items()},
            faults=one.faults,
        )
        for name, one in statistics.items()
    }


def _budgets(
    path: Path, statistics: "Mapping[str, ComponentStatistics]", margin: float
) -> "tuple[Mapping[str, Budgets], Budgets]":
    """What was measured: by component and state, and by resource the longest call of one of its services.

    Preemption is in both, in a call the wait for the lock too: too much rather than too little. A trace has
    the calls of call ports only: a resource that is only read and written has no measured time.
    """
    from mauve_rt.analysis.machines import ExecutionTime  # noqa: PLC0415

    def budget(*measured: "Distribution") -> ExecutionTime:
        count, longest_ns = sum(one.count for one in measured), max(one.max_ns for one in measured)
        origin = f"measured in {path.name} (n = {count:,}) x {margin:g}"
        return ExecutionTime(math.ceil(longest_ns * margin), origin, is_measured=True)

    states = {
        component: {state: budget(measured) for state, measured in one.execution.items() if measured.count}
        for component, one in statistics.items()
    }
    calls: dict[str, list[Distribution]] = {}
    for one in statistics.values():
        for service, measured in one.services.items():
            if measured.count:
                calls.setdefault(service.partition(".")[0], []).append(measured)
    return states, {resource: budget(*measured) for resource, measured in calls.items()}


def _write(path: Path, declared: "Iterable[Machine]", filled: "Iterable[Machine]") -> None:
    """Put what was filled in into the file, or leave it as it is.

    Raises:
        ArchitectureFileError: the file has no place for it, or would not be one any more.
    """
    from mauve_rt.errors import ArchitectureFileError, Problem  # noqa: PLC0415
    from mauve_rt.model import load_architecture  # noqa: PLC0415
    from mauve_rt.yaml.insertion import InsertionError, with_entry  # noqa: PLC0415

    text, count = path.read_bytes().decode(), 0
    for before, after in zip(declared, filled, strict=True):
        for state in after.states:
            if state.name not in before.missing or state.time.ns is None:
                continue
            place = ("components", after.name, "states", state.name)
            try:
                text = with_entry(text, place, "wcet_ns", str(state.time.ns), comment=state.time.origin)
            except InsertionError as error:
                problem = Problem(line=1, column=1, what=f"no time can be written: {error}")
                raise ArchitectureFileError(path, [problem]) from error
            count += 1
    whole = path.resolve()
    unfinished = beside(whole)
    try:
        unfinished.write_bytes(text.encode())
        unfinished.chmod(whole.stat().st_mode)
        load_architecture(unfinished)
        unfinished.replace(whole)
    finally:
        unfinished.unlink(missing_ok=True)
    print(f"{path}: {counted(count, 'time')} written as wcet_ns; nothing enforces them", file=sys.stderr)


def _response(bound: "Bound") -> dict[str, Any]:
    names = ("response_ns", "deadline_ns", "reason", "blocking_ns", "too_long")
    return {name: getattr(bound, name) for name in names}


def _as_json(subject: "Subject", bounds: "Mapping[str, Bound]") -> dict[str, Any]:
    machine = subject.machine
    bound = bounds.get(subject.name)
    times = {one.job: one.response_ns for one in bound.jobs} if bound is not None else {}
    response = {"response": _response(bound)} if bound is not None else {}
    told = asdict(machine)
    told["states"] = [
        {"name": state.name, "time_ns": state.time.ns, "origin": state.time.origin}
        for state in machine.states
        if not state.is_wait or len(state.successors) > 1
    ]
    jobs = [{**asdict(job), "response_ns": times.get(job)} for job in subject.task.jobs]
    return {**told, "jobs": jobs, "not_provable": list(subject.obstacles), **response}
