"""`mauve check FILE...`: what is wrong with models, architecture, rules and steps files; nothing is started.

What a file is its contents say. Beside an architecture file, steps and rules are tried on it as well. Of the
models that are given with it an architecture may use parts that are not written yet.
"""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from mauve_rt.cli.verb import BAD_USAGE, OK
from mauve_rt.counts import counted
from mauve_rt.errors import ArchitectureFileError

if TYPE_CHECKING:  # loaded by those who check only: the other verbs need not wait for it
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from mauve_rt.errors import Problem
    from mauve_rt.file_schema.file_kind import FileKind
    from mauve_rt.model import ArchitectureModel
    from mauve_rt.model.remarks import Subject, Uses
    from mauve_rt.modelling.loading import ModelLoader
    from mauve_rt.modelling.package_model import PackageModel


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The files."""
    parser.add_argument(
        "files",
        nargs="+",
        type=Path,
        metavar="FILE",
        help="models, and files of an architecture, rules or steps; beside an architecture file, "
        "steps and rules are tried on it, and models give it parts. Models may use parts of each other",
    )


def main(args: argparse.Namespace) -> int:
    """Check every file; returns the exit status."""
    from mauve_rt.file_schema.file_kind import FileKind  # noqa: PLC0415
    from mauve_rt.model.file_kinds import file_kind  # noqa: PLC0415

    kinds: dict[Path, FileKind] = {}
    for path in args.files:
        try:
            kinds[path] = file_kind(path)
        except ArchitectureFileError as error:
            return _tell(error)
    architectures = [path for path, kind in kinds.items() if kind is FileKind.ARCHITECTURE]
    if len(architectures) > 1 and len(kinds) > len(architectures):
        print("mauve: check steps and rules with one architecture file, not with several", file=sys.stderr)
        return BAD_USAGE
    order = [FileKind.MODEL, FileKind.ARCHITECTURE, FileKind.STEPS, FileKind.RULES]
    return _check_all(
        {path: kinds[path] for path in sorted(kinds, key=lambda path: order.index(kinds[path]))}
    )


def _check_all(kinds: "Mapping[Path, FileKind]") -> int:
    """Check files in this order. The warnings of an architecture come when all files are read."""
    from mauve_rt.file_schema.file_kind import FileKind  # noqa: PLC0415
    from mauve_rt.model.remarks import Uses, remarks  # noqa: PLC0415
    from mauve_rt.modelling.loading import ModelLoader  # noqa: PLC0415

    status, model, uses = OK, None, Uses()
    printed: set[str] = set()  # a model that others use is wrong once
    loader = ModelLoader(path for path, kind in kinds.items() if kind is FileKind.MODEL)
    models: list[PackageModel] = []
    subjects: list[Subject] = []
    for path, kind in kinds.items():
        try:
            if kind is FileKind.MODEL:
                models.append(_check_model(path, loader))
            elif kind is FileKind.ARCHITECTURE:
                subjects.append(_check_architecture(path, models, uses))
                model = subjects[-1].model
            elif kind is FileKind.RULES:
                _check_rules(path, model, uses)
            else:
                _check_steps(path, model, uses)
        except ArchitectureFileError as error:
            status = _tell(error, printed)
    for subject in subjects if status == OK else ():
        _warn(subject.model.path, remarks(subject))
        if subject.model.executor.require_schedulable and not models:
            _warn(subject.model.path, _unschedulable(subject.model))
    return status


def _tell(error: ArchitectureFileError, printed: "set[str] | None" = None) -> int:
    printed = set() if printed is None else printed
    for line in error.lines():
        if line not in printed:
            print(line, file=sys.stderr)
            printed.add(line)
    return BAD_USAGE


def _check_model(path: Path, loader: "ModelLoader") -> "PackageModel":
    model = loader.load(path)
    _warn(path, model.warnings)
    content = model.content
    counts = {"shell": len(content.shells), "core": len(content.cores), "fsm": len(content.fsms)}
    found = ", ".join(counted(count, what) for what, count in counts.items())
    print(f"{path}: {found}: no error found")
    return model


def _warn(path: Path, warnings: "Iterable[Problem]") -> None:
    for warning in warnings:
        print(f"{path}:{warning.line}:{warning.column}: warning: {warning.text()}", file=sys.stderr)


def _check_architecture(path: Path, models: "Sequence[PackageModel]", uses: "Uses") -> "Subject":
    from mauve_rt.control.limits import bytes_of_resource  # noqa: PLC0415
    from mauve_rt.interfaces.bound_types import type_problems  # noqa: PLC0415
    from mauve_rt.model import build, configure, load_architecture  # noqa: PLC0415
    from mauve_rt.model.modelled_parts import modelled_parts  # noqa: PLC0415
    from mauve_rt.model.remarks import Subject  # noqa: PLC0415
    from mauve_rt.supervision.drivers import late_writers  # noqa: PLC0415

    model = load_architecture(path)
    parts = model.parts = modelled_parts(models)
    architecture = build(model, parts.registry, index=parts.index)
    configure(model, architecture)
    subject = Subject(model, architecture, uses)
    unloaded = [*type_problems(model, architecture, parts.types)]
    architecture.cleanup()
    if problems := unloaded + late_writers(model):
        raise ArchitectureFileError(path, problems)
    counts = {
        "component": len(model.components),
        "resource": len(model.resources),
        "connection": len(model.connections),
    }
    found = ", ".join(counted(count, what) for what, count in counts.items())
    print(f"{path}: {found}: no error found")
    for name, resource in model.resources.items():
        if parts.registry.sequences(resource.type):
            print(f"{path}: resource '{name}' takes {bytes_of_resource(resource, parts.registry):,} bytes")
    return subject


def _unschedulable(model: "ArchitectureModel") -> "Iterator[Problem]":
    """That each change will be refused, where the file itself is not schedulable."""
    from mauve_rt.analysis.verdict import Outcome  # noqa: PLC0415
    from mauve_rt.cli.analyze_plan import Planner  # noqa: PLC0415

    now = Planner.of_architecture(model.path).now
    if now.verdict.outcome is not Outcome.SCHEDULABLE:
        what = f"the executor requires schedulable changes, and this file is {now.verdict.sentence}"
        remedy = f"mauve analyze {model.path} says what to declare"
        yield model.key_problem(("executor", "require_schedulable"), what, remedy=remedy)


def _check_steps(path: Path, model: "ArchitectureModel | None", uses: "Uses") -> None:
    from mauve_rt.model.steps import load_change  # noqa: PLC0415
    from mauve_rt.supervision.rehearsal import try_change  # noqa: PLC0415

    change = load_change(path)
    uses.steps += change.steps
    if model is not None:
        try_change(path, change, model)
    print(f"{path}: {counted(len(change.steps), 'step')}{checked_with(model)}: no error found")


def _check_rules(path: Path, model: "ArchitectureModel | None", uses: "Uses") -> None:
    from mauve_rt.supervision.drivers import unbounded_outputs  # noqa: PLC0415
    from mauve_rt.supervision.rule_findings import all_findings  # noqa: PLC0415
    from mauve_rt.supervision.rules import RulesFile  # noqa: PLC0415
    from mauve_rt.supervision.uses import add_uses, unpublished_topics  # noqa: PLC0415

    file = RulesFile(path)
    add_uses(uses, file)
    found = all_findings(file, model)
    if model is not None:
        found += unbounded_outputs(file, model)
    if found:
        raise ArchitectureFileError(path, found)
    if model is not None:
        _warn(path, unpublished_topics(file, model, uses))
    print(f"{path}: {counted(len(file.rules.rules), 'rule')}{checked_with(model)}: no error found")


def checked_with(model: "ArchitectureModel | None") -> str:
    """The architecture that steps or rules were tried on, for the line that ends a check."""
    return f", checked with {model.path}" if model is not None else ""
