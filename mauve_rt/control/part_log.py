"""Log lines of components and resources on their way to the console, /rosout and the bag. Knows no ROS."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from mauve_rt._kernel import LogEntries, LogEntry
from mauve_rt.counts import counted

__all__ = ["LogBundles", "LogLine"]

_MOST = 10
"""The same line of a source comes so often in a second; what is more is counted."""
_SECOND_NS = 1_000_000_000


@dataclass(frozen=True)
class LogLine:
    """A line as people read it."""

    time_ns: int
    """CLOCK_MONOTONIC, or simulated."""
    level: str
    part: str
    """The component or the resource that wrote it; "": neither is known."""
    text: str
    function: str = ""
    file: str = ""
    line: int = 0


@dataclass
class _Bundle:
    begin_ns: int
    count: int = 0
    last: LogLine | None = None  # withheld


class LogBundles:
    """Names the lines' places, and bundles lines of one format and source. For one thread."""

    def __init__(self) -> None:
        """None is open."""
        self._bundles: dict[tuple[str, str, str], _Bundle] = {}

    def take(self, looks: Sequence[LogEntries], *, now_ns: int, last: bool = False) -> list[LogLine]:
        """Return the lines to write; what was withheld comes when its second is over, or with the `last`."""
        lines = [line for entries in looks for line in self._lines(entries, now_ns)]
        over = [
            key for key, bundle in self._bundles.items() if last or now_ns - bundle.begin_ns >= _SECOND_NS
        ]
        lines += [line for key in over for line in _rest(self._bundles.pop(key))]
        return lines

    def _lines(self, entries: LogEntries, now_ns: int) -> Iterator[LogLine]:
        for entry in entries.lines:
            yield from self._bundled((entry.component, entry.source, entry.format), _line(entry))
        for component, count in entries.lost:
            text = f"{counted(count, 'log line')} lost: they came faster than they were written"
            yield LogLine(now_ns, "warn", component, text)

    def _bundled(self, key: tuple[str, str, str], line: LogLine) -> Iterator[LogLine]:
        bundle = self._bundles.get(key)
        if bundle is None or line.time_ns - bundle.begin_ns >= _SECOND_NS:
            if bundle is not None:
                yield from _rest(bundle)
            bundle = self._bundles[key] = _Bundle(line.time_ns)
        bundle.count += 1
        if bundle.count <= _MOST:
            yield line
        else:
            bundle.last = line


def _rest(bundle: _Bundle) -> Iterator[LogLine]:
    if bundle.last is not None:
        more = counted(bundle.count - _MOST, "more line")
        yield replace(bundle.last, text=f"{bundle.last.text} [the last of {more} within a second]")


def _line(entry: LogEntry) -> LogLine:
    is_resource = entry.source not in ("", "shadow")
    where = [entry.component] if is_resource and entry.component else []
    where += [entry.source] if entry.source == "shadow" else []
    where += [entry.state] if entry.state else []
    text = f"{'.'.join(where)}: {entry.text}" if where else entry.text
    return LogLine(
        time_ns=entry.time_ns,
        level=entry.level,
        part=entry.source if is_resource else entry.component,
        text=text,
        function=entry.function,
        file=entry.file,
        line=entry.line,
    )
