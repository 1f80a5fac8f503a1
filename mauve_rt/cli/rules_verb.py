"""`mauve rules ...`: what can be asked of rules before, while and after they matter; the table at the end."""

import argparse
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from mauve_rt.cli import rules_live, rules_of_bags
from mauve_rt.cli.check_verb import checked_with
from mauve_rt.cli.verb import BAD_USAGE, OK, REFUSED, Verb
from mauve_rt.counts import counted
from mauve_rt.errors import ArchitectureFileError, Problem

if TYPE_CHECKING:  # loaded by those who use it only
    from mauve_rt.model import ArchitectureModel
    from mauve_rt.supervision.rule_bounds import Bound
    from mauve_rt.supervision.rules import RulesFile


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the sub-verbs."""
    verbs = parser.add_subparsers(title="verbs", metavar="VERB", required=True)
    for verb in SUB_VERBS:
        subparser = verbs.add_parser(verb.name, help=verb.help, description=verb.help)
        verb.add_arguments(subparser)
        subparser.set_defaults(rules_verb=verb)


def main(args: argparse.Namespace) -> int:
    """Run the sub-verb; returns the exit status."""
    verb: Verb = args.rules_verb
    try:
        return verb.main(args)
    except ArchitectureFileError as error:
        print("\n".join(error.lines()), file=sys.stderr)
        return BAD_USAGE


def _add_file(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", type=Path, metavar="FILE", help="rules file")
    parser.add_argument(
        "--architecture",
        type=Path,
        metavar="FILE",
        help="architecture file: check the rules' names and steps against it",
    )


def _check(args: argparse.Namespace) -> int:
    from mauve_rt.model import load_architecture  # noqa: PLC0415
    from mauve_rt.supervision.drivers import unbounded_outputs  # noqa: PLC0415
    from mauve_rt.supervision.rule_cautions import form_warnings, model_warnings  # noqa: PLC0415
    from mauve_rt.supervision.rule_checks import logic_findings  # noqa: PLC0415
    from mauve_rt.supervision.rule_findings import standing_findings  # noqa: PLC0415
    from mauve_rt.supervision.rules import RulesFile  # noqa: PLC0415

    file = RulesFile(args.file)
    model = load_architecture(args.architecture) if args.architecture else None
    found = [*standing_findings(file, model), *logic_findings(file)]
    periods: Mapping[str, float] = {}
    warnings = list(form_warnings(file))
    if model is not None:
        from mauve_rt.supervision.rehearsal import rehearsal, rehearsal_problems  # noqa: PLC0415

        found += [*rehearsal_problems(file, model), *unbounded_outputs(file, model)]
        with rehearsal(model) as executor:
            periods = executor.periods_s()
            warnings += model_warnings(file, model, executor)
    _print_bounds(file, periods)
    if model is not None:
        _print_verdicts(args.architecture, file)
    for problem in sorted(found, key=lambda each: (each.line, each.column)):
        _complain(file, problem)
    for warning in warnings:
        _complain(file, warning, "warning: ")
    rules = counted(len(file.rules.rules), "rule")
    findings = counted(len(found), "finding") if found else "no error found"
    print(f"{file.path}: {rules}{checked_with(model)}: {findings}")
    return REFUSED if found else OK


def _complain(file: "RulesFile", problem: Problem, kind: str = "") -> None:
    print(f"{file.path}:{problem.line}:{problem.column}: {kind}{problem.text()}", file=sys.stderr)


def _print_bounds(file: "RulesFile", periods: Mapping[str, float]) -> None:
    from mauve_rt.supervision.rule_bounds import bound_of, reserve_bound_of  # noqa: PLC0415

    for rule in file.rules.rules:
        named = f"{rule.name} (in the {rule.where})"
        bound = bound_of(rule, periods, beside=file.rules.rules)
        _print_bound(f"{named}: at most from the cause to the first release", bound)
        if (reserve := reserve_bound_of(rule, periods)) is not None:
            _print_bound(f"{named}: otherwise at most from the cause to safe outputs", reserve)


def _print_verdicts(architecture: Path, file: "RulesFile") -> None:
    """What the timing analysis says of each rule's action; `mauve analyze` has the reasons."""
    from mauve_rt.cli.analyze_plan import Planner  # noqa: PLC0415
    from mauve_rt.cli.analyze_view import verdict_of_plan  # noqa: PLC0415

    planner = Planner.of_architecture(architecture)
    for rule in file.rules.rules:
        try:
            print(verdict_of_plan(planner.of_rule(file.path, rule))[0])
        except ArchitectureFileError as error:  # a new core may refuse the old one's state that early
            print(f"when rule {rule.name} acts: not proved: {error.problems[0].text()}")


def _print_bound(what: str, bound: "Bound") -> None:
    unknown = "" if bound.total_s is not None else " and what is not known"
    print(f"{what}: {bound.known_s * 1e3:.3f} ms{unknown}")
    _print_parts(bound)


def _print_parts(bound: "Bound") -> None:
    for part in bound.parts:
        seconds = "?" if part.seconds is None else f"{part.seconds * 1e3:.3f}"
        print(f"  {seconds:>12} ms  {part.what}{' (assumed)' if part.assumed else ''}")


def _add_try(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", type=Path, metavar="FILE", help="rules file")
    parser.add_argument(
        "script", type=Path, metavar="SCRIPT", help="script of inputs over time (docs/rules.md shows one)"
    )
    parser.add_argument(
        "--architecture",
        type=Path,
        metavar="FILE",
        help="architecture file of the executor; without it the executor has stand-ins for what rules name",
    )


def _checked_model(file: "RulesFile", architecture: Path | None) -> "ArchitectureModel | None":
    """The architecture that rules are tried on.

    Raises:
        ArchitectureFileError: it cannot be used, or its executor would refuse the rules.
    """
    if architecture is None:
        return None
    from mauve_rt.model import load_architecture  # noqa: PLC0415
    from mauve_rt.supervision.rule_findings import all_findings  # noqa: PLC0415

    model = load_architecture(architecture)
    if problems := all_findings(file, model):
        raise ArchitectureFileError(file.path, problems)
    return model


_TELLING = ("refused", "failed", "suppressed")  # whose message says why


def _try(args: argparse.Namespace) -> int:
    from mauve_rt.supervision.rules import RulesFile  # noqa: PLC0415
    from mauve_rt.supervision.script import load_script  # noqa: PLC0415
    from mauve_rt.supervision.trial import LEGEND, Trial  # noqa: PLC0415

    file = RulesFile(args.file)
    script = load_script(args.script, file.rules.rules)
    trial = Trial(file, script, _checked_model(file, args.architecture))
    for said in trial.story:
        why = f": {said.message}" if said.decision in _TELLING and said.message else ""
        print(f"{said.time_ns / 1e9:9.3f} s  {said.rule}: {said.decision}: {said.reason}{why}")
    print("", *trial.timeline(), LEGEND, sep="\n")
    return OK


SUB_VERBS = (
    Verb("check", "find errors in rules, and compute how long each rule takes at most", _add_file, _check),
    Verb(
        "try",
        "run rules against a script of inputs in virtual time, and show their decisions",
        _add_try,
        _try,
    ),
    Verb(
        "list",
        "show the state of each rule of an executor or a supervisor",
        rules_live.add_list,
        rules_live.list_rules,
    ),
    Verb("load", "replace the rules of an executor, all or none", rules_live.add_load, rules_live.load_rules),
    Verb(
        "reset",
        "end a latched rule whose cause is gone, or the quarantine of rejected values",
        rules_live.add_reset,
        rules_live.reset,
    ),
    Verb(
        "release",
        "end what persons put over rules",
        rules_live.add_release,
        rules_live.release,
    ),
    Verb(
        "replay",
        "run rules against a bag, and compare their actions with the recorded ones",
        rules_of_bags.add_replay,
        rules_of_bags.replay,
    ),
    Verb(
        "explain",
        "show the decisions of rules in a bag, and the reason of each",
        rules_of_bags.add_explain,
        rules_of_bags.explain,
    ),
)
