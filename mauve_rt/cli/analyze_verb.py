"""`mauve analyze FILE|NODE|BAG`: does each component of an architecture meet its deadline?"""

import argparse
import json
import math
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mauve_rt.cli.bag_arguments import is_bag
from mauve_rt.cli.verb import BAD_USAGE, FORECAST, NOT_PROVED, OK, REFUSED, REFUTED
from mauve_rt.counts import counted
from mauve_rt.unfinished import beside, discard

if TYPE_CHECKING:
    from mauve_rt.analysis.bounds import Bound, Subject
    from mauve_rt.analysis.machines import Machine
    from mauve_rt.analysis.study import Study, Surroundings
    from mauve_rt.cli.analyze_chains import JudgedChain
    from mauve_rt.cli.analyze_plan import Plan
    from mauve_rt.cli.analyzed import Analyzed

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
        "--beside",
        action="append",
        default=[],
        metavar="FILE|NODE",
        help="another executor on this computer: its threads count, and are not judged; may be repeated",
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
        help="write the measured times into FILE as wcet_ns (enforced where enforce_wcet is set)",
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
    parser.add_argument(
        "--plan",
        type=Path,
        metavar="STEPS|RULES|FILE",
        help="judge a change, too, while it is made and after it: by steps, by what rules do, or of an "
        "architecture FILE by the file after it",
    )
    parser.add_argument(
        "--alternatives",
        action="store_true",
        help="judge each alternative and fallback core of an architecture FILE, too",
    )
    parser.add_argument(
        "--chain",
        action="append",
        default=[],
        metavar="FROM:TO",
        help="bound the reaction time and the data age from a component, port (COMPONENT.PORT), resource or "
        "topic to another one by each route, or by one route (FROM:STEP:...:TO), and measure both in a bag; "
        "may be repeated",
    )
    parser.add_argument("--json", action="store_true", help="print the result as JSON")


def main(args: argparse.Namespace) -> int:
    """Print the model and the verdict; returns the exit status."""
    from mauve_rt.analysis.bounds import OFFSETS  # noqa: PLC0415 - only this verb
    from mauve_rt.analysis.locks import with_measured_holds  # noqa: PLC0415
    from mauve_rt.analysis.obstacles import assumptions_about  # noqa: PLC0415
    from mauve_rt.analysis.study import study  # noqa: PLC0415
    from mauve_rt.cli.analyzed import analyzed  # noqa: PLC0415
    from mauve_rt.cli.measured_times import budgets_of, measured_of, statistics_of  # noqa: PLC0415
    from mauve_rt.cli.supposed import with_supposed  # noqa: PLC0415

    if wrong := _wrong_arguments(args):
        print(f"mauve: {wrong}", file=sys.stderr)
        return BAD_USAGE
    found = analyzed(args.target, args.model)
    components = found.components
    bag = args.budget_from or (Path(args.target) if is_bag(Path(args.target)) else None)
    statistics = statistics_of(bag) if bag is not None else {}
    if args.budget_from is not None:
        budgets, holds = budgets_of(args.budget_from, statistics, args.margin)
        components = [one.with_budgets(budgets.get(one.name, {})) for one in components]
        components = with_measured_holds(components, holds)
        if args.write:
            _write(Path(args.target), found.components, components)
    components = with_supposed(components, args.suppose)
    surroundings = _surroundings(found, args)
    now = study(components, surroundings, measured=measured_of(statistics))
    assumptions = [*assumptions_about(components)]
    assumptions += [
        f"the parts of {path} are written in C++, but for implementations with a module"
        for path in args.model
    ]
    if any(bound.by == OFFSETS for bound in now.bounds.values()):
        assumptions.append("components keep their offsets from the common epoch")
    plans = _plans(args, found, now, components, surroundings)
    chains = _chains(args, found, now, surroundings, bag)
    if args.json:
        told = _as_json(now, surroundings, assumptions)
        print(json.dumps({**told, **_asked_json(args, plans, chains)}, indent=2))
    else:
        _print(now, surroundings, assumptions, plans, chains)
    studies = [now, *(each for plan in plans for each in (plan.during, plan.after))]
    if args.witness is not None:
        _write_witness(args.witness, studies)
    outcomes = {each.verdict.outcome.name for each in studies} | {each.outcome.name for each in chains}
    return next(status for name, status in _STATUSES.items() if name in outcomes)


def _plans(
    args: argparse.Namespace,
    found: "Analyzed",
    now: "Study",
    components: "Sequence[Machine]",
    surroundings: "Surroundings",
) -> "list[Plan]":
    """Of --plan and --alternatives."""
    if args.plan is None and not args.alternatives:
        return []
    if found.model is None:
        from mauve_rt.cli.analyze_node_plan import plans_of_node  # noqa: PLC0415

        return [*plans_of_node(args.target, args.plan)]
    from mauve_rt.cli.analyze_plan import Planner  # noqa: PLC0415

    planner = Planner(found, now, components, surroundings)
    plans = [*planner.of_file(args.plan)] if args.plan is not None else []
    return [*plans, *planner.alternatives()] if args.alternatives else plans


def _chains(
    args: argparse.Namespace,
    found: "Analyzed",
    now: "Study",
    surroundings: "Surroundings",
    bag: Path | None,
) -> "list[JudgedChain]":
    """Of --chain."""
    if not args.chain:
        return []
    from mauve_rt.cli.analyze_chains import judged_chains  # noqa: PLC0415
    from mauve_rt.cli.chain_routes import Wiring  # noqa: PLC0415

    wiring = Wiring.of(found.described, found.channels)
    return judged_chains(args.chain, wiring, now, wakeup_ns=surroundings.wakeup_ns, bag=bag)


def _print(
    now: "Study",
    surroundings: "Surroundings",
    assumptions: Sequence[str],
    plans: "Sequence[Plan]",
    chains: "Sequence[JudgedChain]",
) -> None:
    from mauve_rt.cli.analyze_view import print_model, print_plan, print_verdict  # noqa: PLC0415

    print_model(now, surroundings.threads)
    print_verdict(now, assumptions)
    for plan in plans:
        print_plan(plan)
    if chains:
        from mauve_rt.cli.analyze_chains import print_chain  # noqa: PLC0415

        for chain in chains:
            print_chain(chain)


_STATUSES = {
    "NOT_SCHEDULABLE": REFUSED,
    "REFUTED": REFUTED,
    "NOT_PROVABLE": NOT_PROVED,
    "NOT_PROVED": NOT_PROVED,
    "FORECAST": FORECAST,
    "SCHEDULABLE": OK,
}
"""By the outcome's name; of several outcomes the first one counts."""


def _wrong_arguments(args: argparse.Namespace) -> str:
    if not math.isfinite(args.margin) or args.margin < _LEAST_MARGIN:
        return f"--margin: expected 1 or more, found {args.margin:g}"
    if args.wakeup_us is not None and (not math.isfinite(args.wakeup_us) or args.wakeup_us < 0):
        return f"--wakeup-us: expected 0 or more, found {args.wakeup_us:g}"
    if args.overhead_ns is not None and args.overhead_ns < 0:
        return f"--overhead-ns: expected 0 or more, found {args.overhead_ns}"
    if args.write and (args.budget_from is None or not Path(args.target).is_file()):
        return "--write: expected an architecture FILE and --budget-from BAG"
    return _wrong_target(args)


def _wrong_target(args: argparse.Namespace) -> str:
    """Of --plan and --alternatives."""
    is_file = Path(args.target).is_file() and not is_bag(Path(args.target)) and not args.model
    is_node = args.target.startswith("/") and not Path(args.target).exists()
    if args.alternatives and not is_file:
        return "--alternatives: expected an architecture FILE whose parts are installed"
    if args.plan is not None and not (is_file or is_node):
        return "--plan: expected an architecture FILE whose parts are installed, or a NODE"
    return ""


def _write_witness(folder: Path, studies: "Sequence[Study]") -> None:
    """The first run that misses a deadline, as a bag."""
    from mauve_rt.cli.witness_bag import write_witness  # noqa: PLC0415

    missing = next((study for study in studies if study.verdict.witness is not None), None)
    if missing is not None and missing.verdict.witness is not None:
        write_witness(folder, [subject.machine for subject in missing.subjects], missing.verdict.witness)
        print(f"{folder}: a bag of that run; mauve report {folder} opens at it", file=sys.stderr)


def _surroundings(found: "Analyzed", args: argparse.Namespace) -> "Surroundings":
    """The threads, with the costs of a release that the command line says."""
    from mauve_rt.analysis.study import Surroundings  # noqa: PLC0415
    from mauve_rt.cli.analyzed import machines_beside  # noqa: PLC0415
    from mauve_rt.cli.measured_times import doctor_costs  # noqa: PLC0415
    from mauve_rt.model.threads import ThreadList  # noqa: PLC0415

    threads = found.threads or ThreadList(-1, -1, ())
    if args.doctor is not None:
        costs = doctor_costs(args.doctor)
        threads = replace(threads, wakeup_ns=costs["wakeup_ns"], overhead_ns=costs["overhead_ns"])
    if args.wakeup_us is not None:
        threads = replace(threads, wakeup_ns=round(args.wakeup_us * 1e3))
    if args.overhead_ns is not None:
        threads = replace(threads, overhead_ns=args.overhead_ns)
    untold = "the bag does not tell which threads run beside the components: record it again"
    beside = [machine for target in args.beside for machine in machines_beside(target)]
    return Surroundings(
        threads=threads,
        beside=tuple(beside),
        unknown=() if found.threads is not None else (untold,),
        measured=() if args.doctor is None else ("this computer",),
    )


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
        discard(unfinished)
    print(f"{path}: {counted(count, 'time')} written as wcet_ns; enforce_wcet enforces them", file=sys.stderr)


def _response(bound: "Bound") -> dict[str, Any]:
    names = ("response_ns", "deadline_ns", "reason", "blocking_ns", "too_long", "by")
    return {name: getattr(bound, name) for name in names}


def _as_json(now: "Study", surroundings: "Surroundings", assumptions: Sequence[str]) -> dict[str, Any]:
    parts = [_subject_json(subject, now.bounds) for subject in now.subjects]
    judged = {"outcome": now.verdict.outcome, "sentence": now.verdict.sentence, "unknown": now.unknown}
    return {
        "components": [part for part in parts if part["is_component"]],
        "threads": [part for part in parts if not part["is_component"]],
        "wakeup_ns": surroundings.wakeup_ns,
        "overhead_ns": surroundings.overhead_ns,
        "verdict": judged,
        "assumptions": assumptions,
    }


def _asked_json(
    args: argparse.Namespace, plans: "Sequence[Plan]", chains: "Sequence[JudgedChain]"
) -> dict[str, Any]:
    """Answers to --chain, --plan and --alternatives."""
    from mauve_rt.cli.analyze_chains import chain_json  # noqa: PLC0415

    found: dict[str, Any] = {"chains": [chain_json(chain) for chain in chains]} if args.chain else {}
    if args.plan is not None or args.alternatives:
        found["changes"] = [_plan_json(plan) for plan in plans]
    return found


def _plan_json(plan: "Plan") -> dict[str, Any]:
    return {
        "change": plan.change,
        "during": _study_json(plan.during),
        "after": _study_json(plan.after),
    }


def _study_json(study: "Study") -> dict[str, Any]:
    return {
        "outcome": study.verdict.outcome,
        "sentence": study.verdict.sentence,
        "responses": {name: _response(bound) for name, bound in study.bounds.items()},
    }


def _subject_json(subject: "Subject", bounds: "Mapping[str, Bound]") -> dict[str, Any]:
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
