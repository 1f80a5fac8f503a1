"""The verbs of `mauve`, from its argparse parsers."""

import argparse
from collections.abc import Iterator

from _reference.tables import table
from mauve_rt.cli.main import build_parser
from mauve_rt.cli.verb import EXIT_STATUSES
from mauve_rt.file_schema.setting_words import sentence


def text() -> str:
    """The exit statuses, then each verb with its arguments."""
    statuses = table(
        ("status", "meaning"), [(str(code), sentence(what)) for code, what in EXIT_STATUSES.items()]
    )
    return "\n".join(["## Exit statuses\n", statuses, *_verbs(build_parser(), 2)])


def _verbs(parser: argparse.ArgumentParser, level: int) -> Iterator[str]:
    for action in _actions(parser):
        if isinstance(action, argparse._SubParsersAction):  # noqa: SLF001 - argparse has no other way to ask
            helps = {each.dest: each.help or "" for each in action._choices_actions}  # noqa: SLF001
            for name, verb in action.choices.items():
                yield _verb(verb, helps[name], level)
                yield from _verbs(verb, level + 1)


def _verb(verb: argparse.ArgumentParser, what: str, level: int) -> str:
    _demand(what, verb.prog)
    actions = [each for each in _actions(verb) if not isinstance(each, argparse._SubParsersAction)]  # noqa: SLF001
    rows = [_row(each, verb.prog) for each in sorted(actions, key=lambda each: bool(each.option_strings))]
    head = f"{'#' * level} {verb.prog}\n\n{sentence(what)}\n"
    return f"{head}\n{table(('argument', 'values', 'default', 'meaning'), rows)}" if rows else head


def _row(action: argparse.Action, prog: str) -> list[str]:
    _demand(action.help or "", f"{prog} {action.dest}")
    name = ", ".join(action.option_strings) or str(action.metavar or action.dest)
    takes = str(action.metavar or action.dest.upper()) if action.option_strings and action.nargs != 0 else ""
    values = ", ".join(f"`{each}`" for each in action.choices or ())
    many = {"+": "one or more", "*": "any number", "?": "may be left out"}.get(str(action.nargs), "")
    is_told = action.default not in (None, "", False, []) and action.default is not argparse.SUPPRESS
    default = f"`{action.default}`" if is_told else ""
    return [f"`{name} {takes}`".replace(" `", "`"), values or many, default, sentence(action.help or "")]


def _actions(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    for action in parser._actions:  # noqa: SLF001 - argparse has no other way to ask
        if not isinstance(action, argparse._HelpAction):  # noqa: SLF001
            yield action


def _demand(what: str, where: str) -> None:
    if not what:
        raise ValueError(
            f"{where}: expected a help text, found none; give add_argument() or add_parser() one"
        )
