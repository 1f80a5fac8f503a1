"""The screen of `mauve dev`, at 80 columns or more; made from the cycles, without a terminal."""

from collections.abc import Sequence

from rich import box
from rich.console import Group, RenderableType
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from mauve_rt.cli.dev_cycle import Cycle, Development
from mauve_rt.cli.dev_outputs import OutputStep, number_text

KEYS = "b back to the code before  r build and reload now  q quit"
_MOST_CYCLES, _MOST_STEPS, _MOST_LINES = 6, 12, 14
_STYLES = {"passed": "green", "in force": "green", "went back": "green", "nothing changed": "green"}
_GREY = ("superseded", "stopped", "")


def dev_view(name: str, *, is_there: bool, development: Development) -> RenderableType:
    """The whole screen."""
    cycles = development.cycles
    there = "[green]answers[/]" if is_there else "[bold red]does not answer[/]"
    parts: list[RenderableType] = [Text.from_markup(f"[bold]{name}[/]  {there}"), _state(development)]
    if cycles:
        parts.append(_cycles(cycles[-_MOST_CYCLES:]))
    stepped = next((each for each in reversed(cycles) if each.steps), None)
    if stepped is not None:
        parts += _steps(stepped)
    if cycles and cycles[-1].lines:
        parts.append(Text("\n".join(cycles[-1].lines[-_MOST_LINES:]), style="red"))
    parts.append(Text(KEYS, style="dim"))
    return Group(*parts)


def _state(development: Development) -> Text:
    last = next((each for each in reversed(development.cycles) if each.outcome), None)
    text = Text(development.state, style="bold")
    if development.is_busy:
        text.append("".join(f"  {line}" for line in development.output)[:60], style="dim")
    elif last is not None:
        style = _STYLES.get(last.outcome, "bold red")
        text.append(f"  {last.outcome}", style=style)
        text.append(f": {last.message}" if last.message else "")
    return text


def _cycles(cycles: Sequence[Cycle]) -> Table:
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    table.add_column("", justify="right", no_wrap=True)
    table.add_column("cause", overflow="fold")
    for name in ("build", "test", "reload", "save to release"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("outcome", no_wrap=True)
    for each in cycles:
        style = "dim" if each.outcome in _GREY else _STYLES.get(each.outcome, "bold red")
        table.add_row(
            str(each.number),
            escape(each.why),
            *(_seconds(took_s) for took_s in (each.build_s, each.test_s, each.reload_s, each.total_s)),
            Text(each.outcome or "...", style=style),
        )
    return table


def _steps(cycle: Cycle) -> list[RenderableType]:
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    table.add_column(f"output, cycle {cycle.number}", overflow="fold")
    for name in ("before", "after", "step"):
        table.add_column(name, justify="right", no_wrap=True)
    for each in _largest(cycle.steps):
        table.add_row(escape(each.name), *map(number_text, (each.before, each.after, each.step)))
    more = len(cycle.steps) - _MOST_STEPS
    return [table, Text(f"{more} more with smaller steps", style="dim")] if more > 0 else [table]


def _largest(steps: Sequence[OutputStep]) -> list[OutputStep]:
    """The largest steps, in the order of the outputs."""
    if len(steps) <= _MOST_STEPS:
        return [*steps]
    chosen = sorted(steps, key=lambda each: -abs(each.step) if each.step is not None else 0.0)[:_MOST_STEPS]
    return [each for each in steps if each in chosen]


def _seconds(took_s: float | None) -> str:
    return "-" if took_s is None else f"{took_s:.2f} s"
