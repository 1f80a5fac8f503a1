"""What `mauve watch` shows, at 80 columns or more; made from what is known, without a terminal."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, NamedTuple

from rich import box
from rich.console import Group, RenderableType
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from mauve_rt.cli.list_view import STATES, bounds_table
from mauve_rt.cli.watched import Figures, Followed, WatchedExecutor
from mauve_rt.counts import duration
from mauve_rt.supervision.truth import truth_word

SORTED_BY = ("file", "wake-up", "response", "execution", "overruns", "state")
"""What the key `s` goes through; `file`: as the executor lists them."""
KEYS = "s sort  / filter  up down enter open  esc back  p pause  q quit"
_STYLES = {"RUNNING": "green", "FAULTED": "bold red", "STOPPED": "yellow"}
_NAME_WIDTH = 24
_BARS = " ▁▂▃▄▅▆▇█"


@dataclass
class Selection:
    """What the keys have chosen."""

    sorted_by: str = "file"
    filter: str = ""
    is_typing: bool = False
    cursor: int = 0
    opened: tuple[str, str] | None = None
    """(executor, component)"""
    is_paused: bool = False


class Row(NamedTuple):
    """A component of an executor."""

    executor: str
    component: Any
    figures: Figures

    @property
    def state(self) -> str:
        """In words."""
        return STATES.get(self.component.state, str(self.component.state))


def rows(executors: Sequence[WatchedExecutor], selection: Selection) -> list[Row]:
    """The components that pass the filter, in order."""
    found = [
        Row(executor.name, component, executor.figures.get(component.name, Figures()))
        for executor in executors
        if executor.listed is not None
        for component in executor.listed.components
    ]
    words = selection.filter.lower()
    found = [row for row in found if words in f"{row.executor} {row.component.name} {row.state}".lower()]
    keys = {
        "wake-up": lambda row: -row.figures.wakeup_ns,
        "response": lambda row: -row.figures.response_ns,
        "execution": lambda row: -row.figures.execution_ns,
        "overruns": lambda row: -row.component.overruns,
        "state": lambda row: row.state == "RUNNING",
    }
    return sorted(found, key=keys[selection.sorted_by]) if selection.sorted_by in keys else found


def view(
    executors: Sequence[WatchedExecutor], selection: Selection, *, has_keys: bool = True
) -> RenderableType:
    """The whole screen."""
    shown = rows(executors, selection)
    selection.cursor = max(0, min(selection.cursor, len(shown) - 1))
    parts: list[RenderableType] = [_heading(executor) for executor in executors]
    if selection.opened is not None:
        name, component = selection.opened
        executor = next(each for each in executors if each.name == name)
        parts += _opened(executor, component)
    else:
        cursor = selection.cursor if has_keys else None
        parts.append(_components(shown, cursor, _whose if len(executors) > 1 else _nobodys))
        parts += [
            Text.from_markup(f"[bold red]{row.component.name}[/]  {escape(text)}")
            for row in shown
            if (text := row.component.fault or row.figures.remark)
        ]
        of_whom = _whose if len(executors) > 1 else _nobodys
        parts += [part for executor in executors for part in _rules(executor, of_whom(executor.name))]
        values = [
            (of_whom(executor.name) + name, value)
            for executor in executors
            for name, value in executor.values.items()
            if executor.is_there
        ]
        if values:
            parts.append(_values(values))
        parts += [
            _event(executor, of_whom(executor.name))
            for executor in executors
            if executor.last_event is not None
        ]
        parts += [
            _violation(executor, of_whom(executor.name))
            for executor in executors
            if executor.last_violation is not None
        ]
    if has_keys:
        parts.append(_footer(selection))
    return Group(*parts)


def _heading(executor: WatchedExecutor) -> Text:
    if executor.listed is None:
        return Text.from_markup(f"[bold]{executor.name}[/]  [yellow]no answer yet[/]")
    if not executor.is_there:
        return Text.from_markup(f"[bold]{executor.name}[/]  [bold red]does not answer[/]; its last values:")
    reply = executor.listed
    missing = "[yellow]no real-time rights[/]" if reply.realtime.missing else "real time"
    words = [f"[bold]{executor.name}[/]", f"revision {reply.revision}", missing]
    return Text.from_markup("  ".join([*words, *(f"[yellow]{escape(each)}[/]" for each in reply.warnings)]))


def _whose(executor: str) -> str:
    """The namespace of one of several executors."""
    return f"{executor.rpartition('/')[0]} "


def _nobodys(_executor: str) -> str:
    """There is only one."""
    return ""


def _components(shown: Sequence[Row], cursor: int | None, of_whom: Callable[[str], str]) -> Table:
    table = _table()
    table.add_column("component", no_wrap=True, max_width=_NAME_WIDTH)
    table.add_column("core", overflow="fold")
    for name in ("state", "Hz", "wake-up", "response", "execution", "overruns"):
        table.add_column(name, justify="left" if name == "state" else "right", no_wrap=True)
    for number, row in enumerate(shown):
        name = of_whom(row.executor) + row.component.name
        figures = row.figures
        table.add_row(
            escape(name),
            escape(row.component.core.rpartition("/")[2]),
            f"[{_STYLES.get(row.state, 'default')}]{row.state}[/]",
            f"{figures.rate_hz:.0f}" if figures.rate_hz else "-",
            duration(figures.wakeup_ns),
            duration(figures.response_ns),
            duration(figures.execution_ns),
            str(row.component.overruns),
            style="reverse" if number == cursor else "",
        )
    return table


def _rules(executor: WatchedExecutor, whose: str) -> Iterator[Text]:
    for rule in executor.rules:
        stands = "in effect" if rule.in_effect else truth_word(rule)
        coming = f", {rule.next} in {max(rule.next_in_s, 0.0):.1f} s" if rule.next else ""
        words = f"{stands} for {rule.since_s:.0f} s{coming}" if rule.armed else "not armed"
        problem = f"  [bold red]{escape(rule.problem)}[/]" if rule.problem else ""
        yield Text.from_markup(f"rule {whose}[bold]{rule.name}[/]  {words}{problem}")


def _values(values: Sequence[tuple[str, Followed]]) -> Table:
    table = _table("value", "", "")
    table.add_column("age", justify="right", no_wrap=True)
    for name, value in values:
        age = duration(value.age_ns) if value.writes else "-"
        table.add_row(escape(name), escape(value.text), sparkline([*value.numbers][-24:]), age)
    return table


def _opened(executor: WatchedExecutor, name: str) -> Iterator[RenderableType]:
    reply = executor.listed
    component = next((each for each in reply.components if each.name == name), None) if reply else None
    if component is None:
        yield Text.from_markup(f"[bold red]{escape(name)}[/] is not in the architecture any more")
        return
    figures = executor.figures.get(name, Figures())
    state = STATES.get(component.state, str(component.state))
    yield Text.from_markup(
        f"[bold]{name}[/]  [{_STYLES.get(state, 'default')}]{state}[/] in {escape(component.current_state)}"
        f"  core {escape(component.core)}\nreleases {component.releases}  overruns {component.overruns}"
        f"  skipped {component.skipped}  worst wake-up {duration(figures.wakeup_ns)}"
        f"  response {duration(figures.response_ns)}  execution {duration(figures.execution_ns)}"
    )
    for line in (component.fault, figures.remark):
        if line:
            yield Text(line, style="bold red")
    if component.bounds:
        yield bounds_table([component])
    ports = _table("port", "connected to", "value")
    ports.add_column("", no_wrap=True)
    for port in component.ports:
        value = executor.values.get(f"{name}.{port.name}", Followed())
        ports.add_row(
            port.name,
            f"{port.resource}.{port.service}" if port.resource else "[yellow]nothing[/]",
            escape(value.text),
            sparkline([*value.numbers][-24:]),
        )
    yield ports
    properties = _table("property", "value")
    for text in component.properties:
        key, _, value_text = text.partition("=")
        properties.add_row(escape(key), escape(value_text))
    if component.properties:
        yield properties


def _event(executor: WatchedExecutor, whose: str) -> Text:
    event = executor.last_event
    when = datetime.fromtimestamp(event.stamp.sec).astimezone()
    outcome = "done" if event.success else f"refused: {event.message}"
    who = f" by {event.requested_by}" if event.requested_by else ""
    return Text(f"last change {when:%H:%M:%S}  {whose}{event.request}{who}: {outcome}", style="dim")


def _violation(executor: WatchedExecutor, whose: str) -> Text:
    violation = executor.last_violation
    when = datetime.fromtimestamp(violation.stamp.sec).astimezone()
    return Text(f"above its bound {when:%H:%M:%S}  {whose}{violation.message}", style="bold red")


def _footer(selection: Selection) -> Text:
    if selection.is_typing:
        return Text(f"filter: {selection.filter}_", style="bold")
    words = [f"sorted by {selection.sorted_by}"] if selection.sorted_by != "file" else []
    words += [f"filter {selection.filter}"] if selection.filter else []
    words += ["PAUSED"] if selection.is_paused else []
    return Text("  ".join([*words, KEYS]), style="dim")


def sparkline(numbers: Sequence[float]) -> str:
    """One character for each number, from the least to the largest; without a terminal's help."""
    finite = [number for number in numbers if abs(number) < float("inf")]
    if not finite:
        return ""
    least, most = min(finite), max(finite)
    span = most - least or 1.0
    top = len(_BARS) - 2
    return "".join(
        _BARS[1 + round((number - least) / span * top)] if abs(number) < float("inf") else _BARS[0]
        for number in numbers
    )


def _table(*folding: str) -> Table:
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    for name in folding:
        table.add_column(name, overflow="fold")
    return table
