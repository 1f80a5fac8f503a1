"""`mauve analyze FILE|NODE|BAG`: does each component of an architecture meet its deadline?"""

import argparse
import json
import math
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mauve_rt.cli.bag_arguments import is_bag
from mauve_rt.cli.verb import BAD_USAGE, NOT_PROVED, OK, REFUSED
from mauve_rt.counts import counted
from mauve_rt.unfinished import beside

if TYPE_CHECKING:
    from mauve_rt.analysis.bounds import Subject
    from mauve_rt.analysis.machines import ExecutionTime, Machine
    from mauve_rt.modelling.package_model import PackageModel
    from mauve_rt.trace.reading.statistics import Distribution

    Budgets = Mapping[str, ExecutionTime]

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
    parser.add_argument(
        "--wakeup-us",
        type=float,
        default=0.0,
        metavar="X",
        help="longest time from an instant to the start of its thread, in us (default 0)",
    )
    parser.add_argument(
        "--witness",
        type=Path,
        metavar="DIR",
        help="if a deadline is missed, write the run that misses it as a bag for mauve report",
    )
    parser.add_argument("--json", action="store_true", help="print the result as JSON")


def main(args: argparse.Namespace) -> int:
    """Print the model and the verdict; returns the exit status: 0 schedulable, 1 not, 3 not proved."""
    from mauve_rt.analysis.bounds import Subject, bounds_of  # noqa: PLC0415 - only this verb
    from mauve_rt.analysis.locks import with_measured_holds  # noqa: PLC0415
    from mauve_rt.analysis.obstacles import assumptions_about  # noqa: PLC0415
    from mauve_rt.analysis.verdict import Outcome, judge  # noqa: PLC0415
    from mauve_rt.cli.supposed import with_supposed  # noqa: PLC0415

    if not math.isfinite(args.margin) or args.margin < _LEAST_MARGIN:
        print(f"mauve: --margin: expected 1 or more, found {args.margin:g}", file=sys.stderr)
        return BAD_USAGE
    if not math.isfinite(args.wakeup_us) or args.wakeup_us < 0:
        print(f"mauve: --wakeup-us: expected 0 or more, found {args.wakeup_us:g}", file=sys.stderr)
        return BAD_USAGE
    if args.write and (args.budget_from is None or not Path(args.target).is_file()):
        print("mauve: --write: expected an architecture FILE and --budget-from BAG", file=sys.stderr)
        return BAD_USAGE
    machines, sender_priority = _machines(args.target, args.model)
    if args.budget_from is not None:
        budgets, holds = _budgets(args.budget_from, args.margin)
        declared, machines = machines, [one.with_budgets(budgets.get(one.name, {})) for one in machines]
        machines = with_measured_holds(machines, holds)
        if args.write:
            _write(Path(args.target), declared, machines)
    machines = with_supposed(machines, args.suppose)
    wakeup_ns = round(args.wakeup_us * 1e3)
    subjects = [Subject.of(machine, machines) for machine in machines]
    bounds = bounds_of(subjects, wakeup_ns=wakeup_ns)
    verdict = judge(subjects, bounds, wakeup_ns=wakeup_ns)
    assumptions = [*assumptions_about(machines, wakeup_us=args.wakeup_us, sender_priority=sender_priority)]
    assumptions += [
        f"the parts of {path} are written in C++, but for implementations with a module"
        for path in args.model
    ]
    if args.json:
        parts = [{**_as_json(subject), "response": asdict(bounds[subject.name])} for subject in subjects]
        judged = {"outcome": verdict.outcome, "sentence": verdict.sentence}
        print(json.dumps({"components": parts, "verdict": judged, "assumptions": assumptions}, indent=2))
    else:
        from mauve_rt.cli.analyze_view import print_model, print_verdict  # noqa: PLC0415

        print_model(subjects, bounds)
        print_verdict(verdict, subjects, assumptions)
    if verdict.witness is not None and args.witness is not None:
        from mauve_rt.cli.witness_bag import write_witness  # noqa: PLC0415

        write_witness(args.witness, [subject.machine for subject in subjects], verdict.witness)
        print(f"{args.witness}: a bag of that run; mauve report {args.witness} opens at it", file=sys.stderr)
    statuses = {Outcome.SCHEDULABLE: OK, Outcome.NOT_SCHEDULABLE: REFUSED}
    return statuses.get(verdict.outcome, NOT_PROVED)


def _machines(target: str, models: Sequence[Path]) -> "tuple[list[Machine], int]":
    """The components of what is named, and the priority of the executor's sender."""
    path = Path(target)
    if not path.exists() and target.startswith("/"):
        return _of_node(target), 1
    if is_bag(path):
        return _of_bag(path), 1
    return _of_file(path, models)


def _of_file(path: Path, models: Sequence[Path]) -> "tuple[list[Machine], int]":
    from mauve_rt._kernel import PluginRegistry  # noqa: PLC0415
    from mauve_rt.analysis.machines import Machine  # noqa: PLC0415
    from mauve_rt.model import PluginIndex, build, load_architecture, previewed_states  # noqa: PLC0415
    from mauve_rt.model.modelled_parts import add_modelled_parts  # noqa: PLC0415
    from mauve_rt.modelling.package_model import load_model  # noqa: PLC0415

    model = load_architecture(path)
    registry, index = PluginRegistry(), PluginIndex.installed()
    in_python: dict[str, bool] = {}
    for each in models:
        found = load_model(each)
        index = add_modelled_parts(found, registry, index)
        in_python |= _modelled(found)
    architecture = build(model, registry, index=index)
    states = previewed_states(model, architecture)
    kinds = {resource.name: resource.kind for resource in architecture.resources()}
    machines = [
        Machine.of(part, states=states[part.name], is_python=_is_python(part, index, in_python), kinds=kinds)
        for part in architecture.components()
    ]
    return machines, model.sender.priority


def _of_node(node: str) -> "list[Machine]":
    from mauve_msgs.srv import ListComponents  # noqa: PLC0415
    from mauve_rt.cli.client import connected  # noqa: PLC0415

    with connected(first=True) as client:
        reply = client.call(ListComponents, f"{node}/list_components", ListComponents.Request())
    return _of_told(reply.components, {resource.name: resource.kind for resource in reply.resources})


def _of_bag(path: Path) -> "list[Machine]":
    import mauve_rt.trace  # noqa: PLC0415
    from mauve_rt.trace.errors import TraceError  # noqa: PLC0415

    trace = mauve_rt.trace.open(path)
    if not trace.architecture:
        raise TraceError(f"bag {path}: it does not tell the architecture; record it again with this version")
    return _of_told(trace.architecture, {})


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


def _budgets(path: Path, margin: float) -> "tuple[Mapping[str, Budgets], Budgets]":
    """What was measured: by component and state, and by resource the longest call of one of its services.

    Preemption is in both, in a call the wait for the lock too: too much rather than too little. A trace has
    the calls of call ports only: a resource that is only read and written has no measured time.
    """
    import mauve_rt.trace  # noqa: PLC0415
    from mauve_rt.analysis.machines import ExecutionTime  # noqa: PLC0415
    from mauve_rt.trace.reading.statistics import all_statistics  # noqa: PLC0415

    def budget(*measured: "Distribution") -> ExecutionTime:
        count, longest_ns = sum(one.count for one in measured), max(one.max_ns for one in measured)
        origin = f"measured in {path.name} (n = {count:,}) x {margin:g}"
        return ExecutionTime(math.ceil(longest_ns * margin), origin)

    statistics = all_statistics(mauve_rt.trace.open(path))
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


def _as_json(subject: "Subject") -> dict[str, Any]:
    machine = subject.machine
    told = asdict(machine)
    told["states"] = [
        {"name": state.name, "time_ns": state.time.ns, "origin": state.time.origin}
        for state in machine.states
        if not state.is_wait
    ]
    jobs = [asdict(job) for job in subject.task.jobs]
    return {**told, "jobs": jobs, "not_provable": list(subject.obstacles)}
