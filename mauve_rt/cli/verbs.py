"""The verbs of `mauve`, each with `add_arguments(parser)` and `main(args) -> exit status`."""

import argparse
import sys
from typing import Any

from mauve_rt.cli import (
    analyze_verb,
    build_verb,
    changes_verb,
    check_verb,
    dev_verb,
    doctor_verb,
    echo_verb,
    generate_verb,
    get_verb,
    graph_verb,
    log_level_verb,
    mirror_verb,
    model_verb,
    new_verb,
    plugins_verb,
    record_verb,
    report_verb,
    rules_verb,
    run_verb,
    schema_verb,
    shadow_verb,
    trace_verb,
    types_verb,
    watch_verb,
)
from mauve_rt.cli.arguments import add_executor_and_json, take_negative_numbers
from mauve_rt.cli.bumpless import add_bumpless, bumpless_text
from mauve_rt.cli.completion import (
    complete_components,
    complete_cores,
    complete_properties,
    completed_by,
)
from mauve_rt.cli.request import add_request_fields, send_request
from mauve_rt.cli.verb import BAD_USAGE, OK, Verb
from mauve_rt.errors import ArchitectureFileError


def _add_request(parser: argparse.ArgumentParser) -> None:
    add_executor_and_json(parser)
    completed_by(parser.add_argument("component", help="name of the component"), complete_components)
    add_request_fields(parser)


def _add_timed_request(parser: argparse.ArgumentParser) -> None:
    _add_request(parser)
    _add_timeout(parser)


def _add_timeout(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--timeout",
        type=float,
        default=0.0,
        metavar="S",
        help="seconds until the request is refused (default 1)",
    )


def _add_force(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--force",
        action="store_true",
        help="give up a component whose state does not end in time: it becomes FAULTED",
    )


def _add_idle(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--idle",
        action="store_true",
        help="make the change while no job of a participant is pending, or refuse it",
    )
    parser.add_argument(
        "--idle-within",
        type=float,
        metavar="S",
        help="with --idle: seconds for such an instant to come, once all components have agreed (default 1)",
    )


def _add_over(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--over-rules",
        nargs="?",
        const=None,
        default="",
        metavar="NAME",
        help="where a rule holds what is to be changed: put this above all rules but safety rules, or "
        "above the safety rule NAME, until `mauve rules release` or the rule's end",
    )


def _add_over_and_base(parser: argparse.ArgumentParser) -> None:
    _add_over(parser)
    parser.add_argument(
        "--base",
        action="store_true",
        help="where a rule holds what is to be changed: change what comes back when the rule ends",
    )


def _over(args: argparse.Namespace) -> str:
    from mauve_rt.control.requests import OVER_RULES  # noqa: PLC0415 - what a request needs anyway

    return OVER_RULES if args.over_rules is None else str(args.over_rules)


def _over_of(args: argparse.Namespace) -> dict[str, Any]:
    """Fields of a request."""
    return {"over": _over(args), "base": args.base}


def _add_phase_timeout(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--phase-timeout",
        type=float,
        default=1.0,
        metavar="S",
        help="seconds to wait for the first release after it, which is reported (default 1; 0: none)",
    )


def _add_probation(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--probation",
        type=float,
        default=0.0,
        metavar="S",
        help="put the new core on probation for S seconds: a violation puts the old core back",
    )
    parser.add_argument(
        "--revert-on",
        action="append",
        default=[],
        metavar="V",
        help="violation: fault, overrun, over_declared, nan, or {output: COMPONENT.PORT.FIELD, minimum: X, "
        "maximum: Y}, where COMPONENT. may be left out; may be repeated (default: fault and nan)",
    )
    parser.add_argument(
        "--probation-releases",
        type=int,
        default=0,
        metavar="N",
        help="releases without which the verdict is inconclusive (default 1)",
    )


def _probation_of(args: argparse.Namespace) -> dict[str, Any]:
    """Fields of a request."""
    return {
        "probation_s": args.probation,
        "revert_on": args.revert_on,
        "probation_releases": max(args.probation_releases, 0),
    }


def _add_stop(parser: argparse.ArgumentParser) -> None:
    _add_timed_request(parser)
    _add_force(parser)


def _add_start(parser: argparse.ArgumentParser) -> None:
    _add_request(parser)
    _add_over(parser)


def _add_replace_core(parser: argparse.ArgumentParser) -> None:
    _add_timed_request(parser)
    _add_force(parser)
    _add_phase_timeout(parser)
    _add_probation(parser)
    add_bumpless(parser)
    _add_over_and_base(parser)
    completed_by(parser.add_argument("core", help="the new core, package/Class"), complete_cores)


def _add_reconfigure(parser: argparse.ArgumentParser) -> None:
    add_executor_and_json(parser)
    parser.add_argument("file", help="YAML list of steps {kind, target, name, value}; - for standard input")
    parser.add_argument("--dry-run", action="store_true", help="check and prepare everything, change nothing")
    add_request_fields(parser)
    _add_timeout(parser)
    _add_force(parser)
    _add_idle(parser)
    _add_phase_timeout(parser)
    _add_over_and_base(parser)


def _add_reload(parser: argparse.ArgumentParser) -> None:
    add_executor_and_json(parser)
    targets = parser.add_argument(
        "target",
        nargs="*",
        help="package or component whose code is loaded anew (default: all that was rebuilt)",
    )
    completed_by(targets, complete_components)
    parser.add_argument(
        "--back", action="store_true", help="put the code of before the last reload in force again"
    )
    parser.add_argument(
        "--dry-run", action="store_true", help="try and check the new code in a process of its own only"
    )
    _add_probation(parser)
    add_request_fields(parser)
    _add_timeout(parser)
    _add_force(parser)
    _add_phase_timeout(parser)


def _add_set(parser: argparse.ArgumentParser) -> None:
    add_executor_and_json(parser)
    name = parser.add_argument("property", type=_property, help="COMPONENT.PROPERTY, e.g. control.max_speed")
    completed_by(name, complete_properties)
    parser.add_argument("value", help="the new value, as in an architecture file")
    take_negative_numbers(parser)
    add_request_fields(parser)
    _add_timeout(parser)
    _add_over_and_base(parser)


def _property(text: str) -> tuple[str, str]:
    component, dot, name = text.partition(".")
    if not (component and dot and name):
        raise argparse.ArgumentTypeError(
            f"expected COMPONENT.PROPERTY such as control.max_speed, found {text}"
        )
    return component, name


def _list(args: argparse.Namespace) -> int:
    from mauve_msgs.srv import ListComponents  # noqa: PLC0415 - ROS takes its time to load
    from mauve_rt.cli.client import connected  # noqa: PLC0415

    with connected(first=True) as client:
        reply = client.call(ListComponents, f"{args.executor}/list_components", ListComponents.Request())
    if args.json:
        from mauve_rt.cli.views import print_json  # noqa: PLC0415

        print_json(reply)
    else:
        from mauve_rt.cli.list_view import print_components  # noqa: PLC0415

        print_components(reply)
    return OK


def _stop(args: argparse.Namespace) -> int:
    from mauve_msgs.srv import Stop  # noqa: PLC0415

    fields = {"component": args.component, "timeout_s": args.timeout, "force": args.force}
    return send_request(args, Stop, "stop", **fields)


def _start(args: argparse.Namespace) -> int:
    from mauve_msgs.srv import Start  # noqa: PLC0415

    return send_request(args, Start, "start", component=args.component, over=_over(args))


def _replace_core(args: argparse.Namespace) -> int:
    from mauve_msgs.srv import ReplaceCore  # noqa: PLC0415

    return send_request(
        args,
        ReplaceCore,
        "replace_core",
        component=args.component,
        core=args.core,
        commit_timeout_s=args.timeout,
        force=args.force,
        bumpless=bumpless_text(args),
        **_probation_of(args),
        **_over_of(args),
    )


def _reconfigure(args: argparse.Namespace) -> int:
    from mauve_msgs.msg import ReconfigurationStep  # noqa: PLC0415
    from mauve_msgs.srv import Reconfigure  # noqa: PLC0415
    from mauve_rt.model.steps import load_change  # noqa: PLC0415

    try:
        if args.file == "-":
            change = load_change("standard input", text=sys.stdin.read())
        else:
            change = load_change(args.file)
    except ArchitectureFileError as error:
        print("\n".join(error.lines()), file=sys.stderr)
        return BAD_USAGE
    return send_request(
        args,
        Reconfigure,
        "reconfigure",
        steps=[
            ReconfigurationStep(kind=step.kind, target=step.target, name=step.name, value=step.value)
            for step in change.steps
        ],
        dry_run=args.dry_run,
        commit_timeout_s=args.timeout,
        force=args.force or change.force,
        idle=args.idle or change.idle,
        idle_within_s=change.idle_within_s if args.idle_within is None else args.idle_within,
        **_over_of(args),
    )


def _reload(args: argparse.Namespace) -> int:
    from mauve_msgs.srv import Reload  # noqa: PLC0415

    return send_request(
        args,
        Reload,
        "reload",
        targets=args.target,
        back=args.back,
        dry_run=args.dry_run,
        commit_timeout_s=args.timeout,
        force=args.force,
        **_probation_of(args),
    )


def _set(args: argparse.Namespace) -> int:
    from mauve_msgs.msg import ReconfigurationStep  # noqa: PLC0415
    from mauve_msgs.srv import Reconfigure  # noqa: PLC0415

    component, name = args.property
    step = ReconfigurationStep(kind="set_property", target=component, name=name, value=args.value)
    fields = {"steps": [step], "commit_timeout_s": args.timeout, **_over_of(args)}
    return send_request(args, Reconfigure, "reconfigure", **fields)


def _nodes(args: argparse.Namespace) -> int:
    from mauve_rt.cli.client import connected  # noqa: PLC0415
    from mauve_rt.cli.views import print_json  # noqa: PLC0415

    with connected(first=True) as client:
        found = client.find_executors()
    if args.json:
        print_json(found)
    else:
        print(
            "\n".join(found) if found else "no executor on this machine",
            file=sys.stdout if found else sys.stderr,
        )
    return OK if found else BAD_USAGE


def _events(args: argparse.Namespace) -> int:
    from mauve_msgs.msg import ReconfigurationEvent  # noqa: PLC0415
    from mauve_rt.cli.client import connected  # noqa: PLC0415
    from mauve_rt.cli.views import event_line, print_json, report_lines  # noqa: PLC0415

    def heard(event: Any) -> None:
        if args.json:
            print_json(event)
        else:
            print("\n  ".join([event_line(event), *report_lines(event.report)]))
        sys.stdout.flush()

    try:
        with connected(first=True) as client:
            client.listen(ReconfigurationEvent, f"{args.executor}/events", heard)
    except KeyboardInterrupt:
        pass
    return OK


def _add_json(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--json", action="store_true", help="print JSON")


VERBS = (
    Verb("new", "write a package, or a part of one", new_verb.add_arguments, new_verb.main),
    Verb("build", "build and install a package", build_verb.add_arguments, build_verb.main),
    Verb("run", "run the executor of a package's architecture", run_verb.add_arguments, run_verb.main),
    Verb("list", "show the components of an executor", add_executor_and_json, _list),
    Verb("stop", "stop a component", _add_stop, _stop),
    Verb("start", "start a stopped component", _add_start, _start),
    Verb(
        "replace-core",
        "replace the core of a component, also while the component runs",
        _add_replace_core,
        _replace_core,
    ),
    Verb("reconfigure", "carry out a transaction: all its steps or none", _add_reconfigure, _reconfigure),
    Verb("reload", "load rebuilt code into a running executor, or go back", _add_reload, _reload),
    Verb(
        "dev",
        "build, test and reload code at each save, while the executor runs",
        dev_verb.add_arguments,
        dev_verb.main,
    ),
    Verb(
        "doctor",
        "examine this computer and this shell, and measure wake-up latencies",
        doctor_verb.add_arguments,
        doctor_verb.main,
    ),
    Verb("events", "show the reconfigurations of an executor as they happen", add_executor_and_json, _events),
    Verb(
        "changes",
        "show the changes of an executor that are not complete, or end one",
        changes_verb.add_arguments,
        changes_verb.main,
    ),
    Verb("nodes", "list the executors that can be reached", _add_json, _nodes),
    Verb(
        "check",
        "check architecture, rules and steps files without starting anything",
        check_verb.add_arguments,
        check_verb.main,
    ),
    Verb(
        "graph",
        "draw an architecture, a change of it, or an fsm",
        graph_verb.add_arguments,
        graph_verb.main,
    ),
    Verb(
        "analyze",
        "prove that each component meets its deadline, or show which one does not",
        analyze_verb.add_arguments,
        analyze_verb.main,
    ),
    Verb(
        "shadow",
        "run a candidate core in parallel with the core, and show how their outputs differ",
        shadow_verb.add_arguments,
        shadow_verb.main,
    ),
    Verb("set", "set a property of a component", _add_set, _set),
    Verb("get", "print a property or a field of a resource", get_verb.add_arguments, get_verb.main),
    Verb("echo", "show the values of a resource or port", echo_verb.add_arguments, echo_verb.main),
    Verb(
        "log-level",
        "set the level from which on log lines of a component are kept",
        log_level_verb.add_arguments,
        log_level_verb.main,
    ),
    Verb("mirror", "publish a value on a ROS topic", mirror_verb.add_arguments, mirror_verb.main),
    Verb("watch", "show a live table of executors", watch_verb.add_arguments, watch_verb.main),
    Verb(
        "record",
        "start or stop a recording of an executor, or write a snapshot of its last seconds",
        record_verb.add_arguments,
        record_verb.main,
    ),
    Verb(
        "report",
        "write a report of a recorded run as one HTML page",
        report_verb.add_arguments,
        report_verb.main,
    ),
    Verb(
        "rules",
        "check, try, list, load, replay and explain rules",
        rules_verb.add_arguments,
        rules_verb.main,
    ),
    Verb(
        "trace",
        "check, repair, measure and export recorded traces",
        trace_verb.add_arguments,
        trace_verb.main,
    ),
    Verb(
        "plugins",
        "show the installed shells, cores, fsms, resources and types, or all of one",
        plugins_verb.add_arguments,
        plugins_verb.main,
    ),
    Verb(
        "types",
        "show the types of data that plug-ins register, and write them as .msg files",
        types_verb.add_arguments,
        types_verb.main,
    ),
    Verb(
        "generate",
        "write the code of a package's model, and skeletons of its algorithms",
        generate_verb.add_arguments,
        generate_verb.main,
    ),
    Verb(
        "model",
        "print the model of the parts that an installed package registers",
        model_verb.add_arguments,
        model_verb.main,
    ),
    Verb(
        "schema",
        "print the JSON Schema of a kind of file, by which editors complete and check the file",
        schema_verb.add_arguments,
        schema_verb.main,
    ),
)
