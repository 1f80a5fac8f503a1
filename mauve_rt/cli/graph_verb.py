"""`mauve graph FILE...|NODE|BAG|MODEL`: the architecture, or the fsm of a component, as a drawing."""

import argparse
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mauve_rt.cli.arguments import absolute_name
from mauve_rt.cli.bag_arguments import is_bag
from mauve_rt.cli.completion import complete_components, complete_executors_and_files, completed_by
from mauve_rt.cli.verb import BAD_USAGE, OK
from mauve_rt.errors import ArchitectureFileError, ParameterError

if TYPE_CHECKING:  # loaded by those who draw only
    from mauve_rt.file_schema.file_kind import FileKind
    from mauve_rt.graph.drawing import Drawing

    Kinds = Mapping[Path, FileKind]

_SUFFIXES = (".svg", ".html", ".dot", ".mmd")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """What is drawn, and where the drawing goes."""
    subjects = parser.add_argument(
        "subject",
        nargs="+",
        metavar="FILE|NODE|BAG|MODEL",
        help="an architecture file, the node of an executor, a bag, or the model of a package. Rules files "
        "add their rules; models beside an architecture file give it parts that are not installed. "
        "Of several models the first one is drawn; the others have parts that it uses",
    )
    completed_by(subjects, complete_executors_and_files)
    component = parser.add_argument(
        "--fsm", default="", metavar="COMPONENT", help="draw the fsm of this component; of a MODEL, this fsm"
    )
    completed_by(component, complete_components)
    parser.add_argument(
        "--steps",
        type=Path,
        metavar="FILE",
        help="draw an architecture file after these steps, and mark each difference",
    )
    parser.add_argument(
        "--out",
        type=Path,
        metavar="FILE",
        help="file of the drawing: .svg, .html, .dot (Graphviz) or .mmd (Mermaid); without it DOT text goes "
        "to the standard output",
    )


def main(args: argparse.Namespace) -> int:
    """Draw; returns the exit status."""
    from mauve_rt.graph.svg import GraphError  # noqa: PLC0415

    if args.out is not None and args.out.suffix not in _SUFFIXES:
        print(
            f"mauve: --out {args.out}: expected a name that ends with {', '.join(_SUFFIXES)}", file=sys.stderr
        )
        return BAD_USAGE
    try:
        text = _writer("" if args.out is None else args.out.suffix)(_drawing(args))
        if args.out is None:
            print(text, end="")
        else:
            args.out.write_text(text, encoding="utf-8")
            print(args.out)
    except ArchitectureFileError as error:
        print("\n".join(error.lines()), file=sys.stderr)
        return BAD_USAGE
    except GraphError as error:
        print(f"mauve: graph: {error} (.dot and .mmd need no Graphviz)", file=sys.stderr)
        return BAD_USAGE
    except BrokenPipeError:
        raise  # the reader of the text is gone
    except OSError as error:
        print(f"mauve: graph {args.out}: cannot be written ({error.strerror or error})", file=sys.stderr)
        return BAD_USAGE
    return OK


def _writer(suffix: str) -> "Callable[[Drawing], str]":
    from mauve_rt.graph.dot import dot_text  # noqa: PLC0415
    from mauve_rt.graph.mermaid import mermaid_text  # noqa: PLC0415
    from mauve_rt.graph.page import page_text  # noqa: PLC0415
    from mauve_rt.graph.svg import svg_text  # noqa: PLC0415

    return {".svg": svg_text, ".html": page_text, ".mmd": mermaid_text}.get(suffix, dot_text)


def _drawing(args: argparse.Namespace) -> "Drawing":
    from mauve_rt.cli.graph_file import Topics, with_rules  # noqa: PLC0415
    from mauve_rt.file_schema.file_kind import FileKind  # noqa: PLC0415
    from mauve_rt.model.file_kinds import file_kind  # noqa: PLC0415

    described = [one for one in args.subject if _is_node(one) or is_bag(Path(one))]
    kinds = {Path(one): file_kind(one) for one in args.subject if one not in described}
    rules = [path for path, kind in kinds.items() if kind is FileKind.RULES]
    if steps := [path for path, kind in kinds.items() if kind is FileKind.STEPS]:
        raise ParameterError(f"graph: {steps[0]} is a file of steps; write --steps {steps[0]}")
    is_file = FileKind.ARCHITECTURE in kinds.values()
    if args.steps is not None and not is_file:
        raise ParameterError("graph: --steps needs an architecture file; an executor is drawn as it is")
    if len(described) + [*kinds.values()].count(FileKind.ARCHITECTURE) > 1:
        raise ParameterError("graph: expected one architecture, found several; draw one after the other")
    if args.fsm and rules:
        raise ParameterError(f"graph: --fsm draws no rules; leave {rules[0]} out")
    topics = Topics("/", {})
    if described:
        drawing, topics = _described(described[0], args.fsm)
    else:
        drawing, topics = _of_files(kinds, args)
    for path in rules:
        drawing = with_rules(drawing, path, topics)
    return drawing


def _is_node(text: str) -> bool:
    return text.startswith("/") and not Path(text).exists()


def _of_files(kinds: "Kinds", args: argparse.Namespace) -> "tuple[Drawing, Any]":
    from mauve_rt.cli.graph_file import Topics, drawing_of_file, fsm_of_file  # noqa: PLC0415
    from mauve_rt.cli.graph_model import drawing_of_model, fsm_of_model  # noqa: PLC0415
    from mauve_rt.file_schema.file_kind import FileKind  # noqa: PLC0415
    from mauve_rt.modelling.loading import ModelLoader  # noqa: PLC0415

    paths = [path for path, kind in kinds.items() if kind is FileKind.MODEL]
    loader = ModelLoader(paths)
    models = [loader.load(path) for path in paths]
    for path, kind in kinds.items():
        if kind is FileKind.ARCHITECTURE:
            if args.fsm:
                return fsm_of_file(path, args.fsm, models), None
            return drawing_of_file(path, models, args.steps)
    if not models or len(models) != len(kinds):
        raise ParameterError("graph: expected an architecture file, a node or a bag beside rules; or models")
    none = Topics("/", {})
    return (fsm_of_model(models[0], args.fsm) if args.fsm else drawing_of_model(models[0])), none


def _described(subject: str, fsm: str) -> "tuple[Drawing, Any]":
    """Of an executor that runs, or of a bag."""
    from mauve_rt.cli.graph_file import Topics, require  # noqa: PLC0415
    from mauve_rt.graph.components import architecture_drawing  # noqa: PLC0415

    components, resources = _of_node(subject) if _is_node(subject) else _of_bag(Path(subject))
    if fsm:
        by_name = {one.name: one for one in components}
        require(fsm, by_name, f"{subject}: component")
        return _described_fsm(by_name[fsm]), None
    topics = {one.subscribes: one.name for one in resources if one.subscribes}
    namespace = subject.rpartition("/")[0] or "/"
    return architecture_drawing(subject, components, resources), Topics(namespace, topics)


def _of_node(node: str) -> tuple[list[Any], list[Any]]:
    from mauve_msgs.srv import ListComponents  # noqa: PLC0415
    from mauve_rt.cli.client import connected  # noqa: PLC0415
    from mauve_rt.trace.reading.architecture import ComponentInfo  # noqa: PLC0415

    name = absolute_name(node)
    with connected(first=True) as client:
        reply = client.call(ListComponents, f"{name}/list_components", ListComponents.Request())
    return [*map(ComponentInfo.of_message, reply.components)], list(reply.resources)


def _of_bag(path: Path) -> tuple[list[Any], list[Any]]:
    import mauve_rt.trace  # noqa: PLC0415
    from mauve_rt.trace.errors import TraceError  # noqa: PLC0415

    trace = mauve_rt.trace.open(path)
    if not trace.architecture:
        raise TraceError(f"bag {path}: it holds no architecture; record it again with this version")
    return list(trace.architecture), []


def _described_fsm(component: Any) -> "Drawing":
    """With the guards and actions of the fsm of that name, where it is installed and has the same states."""
    from types import SimpleNamespace  # noqa: PLC0415

    from mauve_rt._kernel import PluginRegistry  # noqa: PLC0415
    from mauve_rt.errors import MauveError  # noqa: PLC0415
    from mauve_rt.graph.fsms import fsm_drawing  # noqa: PLC0415
    from mauve_rt.model import PluginIndex, PluginLoader  # noqa: PLC0415

    loader = PluginLoader(PluginRegistry(), PluginIndex.installed())
    try:
        loader.require("fsm", component.fsm)
        installed = {one.name: one for one in loader.registry.describe_fsm(component.fsm)}
    except MauveError:
        installed = {}
    states = []
    for one in component.states:
        known = installed.get(one.name)
        is_same = known is not None and list(known.successors) == list(one.successors)
        more = ("action", "guards", "duration_text", "event_port") if is_same else ()
        facts = (
            "name",
            "is_initial",
            "is_wait",
            "is_event_wait",
            "duration_ns",
            "min_interarrival_ns",
            "wcet_ns",
        )
        states.append(
            SimpleNamespace(
                successors=list(one.successors),
                **{name: getattr(one, name) for name in facts},
                **{name: getattr(known, name) for name in more},
            )
        )
    return fsm_drawing(f"{component.name}: {component.fsm}", states)
