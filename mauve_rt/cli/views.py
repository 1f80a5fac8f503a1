"""What the verbs print: lines for people, JSON for programs."""

import json
import math
import re
import sys
from collections.abc import Sequence
from datetime import datetime
from typing import TYPE_CHECKING, Any

from mauve_rt.cli.plain_output import beneath, plain
from mauve_rt.cli.verb import OK, REFUSED
from mauve_rt.counts import duration
from mauve_rt.fields import json_value

if TYPE_CHECKING:  # rich takes its time to load, and JSON or a line of text have no use for it
    from rich.console import Console
    from rich.text import Text

_WIDE = 160
_BLANKS = re.compile(r" +$", re.MULTILINE)
_WORTH_TELLING_NS = 1_000  # some steps prepare nothing


def print_json(value: Any) -> None:
    """Indented JSON on stdout."""
    text = json.dumps(json_value(value), indent=2, ensure_ascii=False)
    print(text if plain(text) == text else json.dumps(json_value(value), indent=2))


def console() -> "Console":
    """Standard output; wide enough for every table where it is no terminal."""
    from rich.console import Console  # noqa: PLC0415

    class OurConsole(Console):
        def render_str(self, text: str, **how: Any) -> "Text":
            """Also of the cells of tables."""
            return super().render_str(plain(text), **how)

        def on_broken_pipe(self) -> None:
            """As of any other output: see `pipe`."""
            raise BrokenPipeError

    if sys.stdout.isatty():
        return OurConsole(file=beneath(sys.stdout), highlight=False)
    trimmed: Any = _Trimmed(beneath(sys.stdout))
    return OurConsole(file=trimmed, highlight=False, width=_WIDE)


class _Trimmed:
    """A file that gets no blanks at the ends of lines: tables fill their last column with them."""

    def __init__(self, file: Any) -> None:
        self._file = file

    def write(self, text: str) -> int:
        return int(self._file.write(_BLANKS.sub("", text)))

    def __getattr__(self, name: str) -> Any:
        return getattr(self._file, name)


def print_reply(reply: Any, *, as_json: bool, lines: Sequence[str] = ()) -> int:
    """What came of a request, with `lines` below its message; the exit status."""
    if as_json:
        print_json(reply)
    elif reply.success:
        print("\n  ".join([reply.message, *lines]))
    else:
        from mauve_rt.control.requests import code_name  # noqa: PLC0415 - it loads messages

        print(f"refused, {code_name(reply.code)} ({reply.code}): {reply.message}", file=sys.stderr)
    return OK if reply.success else REFUSED


def is_incomplete(reply: Any) -> bool:
    """Whether a release is still to come that the report of a change tells of."""
    return any(
        step.blackout_ns != step.NOT_MEASURED and step.missed_releases == step.NOT_MEASURED
        for step in getattr(reply, "report", ())
    )


def report_lines(report: Sequence[Any]) -> list[str]:
    """What each step cost, in words: a line for each of several, for one when something was measured."""
    lines = []
    for step in report:
        none = type(step).NOT_MEASURED
        facts = [f"prepared in {duration(step.prepare_ns)}"] if step.prepare_ns >= _WORTH_TELLING_NS else []
        if step.blackout_ns != none:
            facts.append(f"blackout {duration(step.blackout_ns)}")
            if step.missed_releases != none:
                facts.append(f"missed releases {step.missed_releases}")
            else:
                facts.append("the next release has not come yet")
        elif step.instant_ns != none and step.release_ns == none and step.remark:
            facts.append(step.remark)  # the component is late
        if step.taken:
            facts.append(f"took over {', '.join(step.taken)}")
        if step.phase_actual_ns != none:
            facts.append(_next_release(step))
        facts += [output_step_words(output) for output in step.outputs]
        if step.left:
            facts.append(f"not taken over: {'; '.join(step.left)}")
        if len(report) > 1:
            subject = f"{step.component}: " if step.component else ""
            lines.append(f"{subject}{step.step}" + (f": {', '.join(facts)}" if facts else ""))
        elif facts:
            lines.append(f"{step.step}: {', '.join(facts)}")
    return lines


def output_step_words(output: Any) -> str:
    """How far an output went at a bumpless change."""
    if math.isnan(output.step):
        return f"{output.output} {output.difference:+.4g} before the change, its step is not known yet"
    bound = f"difference {output.difference:+.4g}, at most {output.greatest:g}"
    return f"{output.output} stepped by {output.step:+.4g} ({bound})"


def _next_release(step: Any) -> str:
    """When the release is due that follows the change, and how late it was."""
    woken = f"woken {_after(step.phase_actual_ns, 'its instant')}"
    if type(step).NOT_MEASURED in (step.instant_ns, step.release_ns):
        return f"next release {woken}"
    return f"next release due {_after(step.release_ns - step.instant_ns, 'the change')}, {woken}"


def _after(nanoseconds: int, event: str) -> str:
    return f"{duration(nanoseconds)} after {event}" if nanoseconds else f"at {event}"


def clock_text(realtime_ns: int) -> str:
    """An instant of CLOCK_REALTIME for people: local time, with ms."""
    when = datetime.fromtimestamp(realtime_ns // 1_000_000_000).astimezone()
    return f"{when:%H:%M:%S}.{realtime_ns // 1_000_000 % 1000:03d}"


def event_line(event: Any) -> str:
    """One line about a ReconfigurationEvent."""
    outcome = (
        f"done, revision {event.revision}" if event.success else f"refused ({event.code}): {event.message}"
    )
    who = f" by {event.requested_by}" if event.requested_by else ""
    why = f" because {event.cause}" if event.cause else ""
    stamp = clock_text(event.stamp.sec * 1_000_000_000 + event.stamp.nanosec)
    return f"{stamp} {event.request}{who}{why}: {outcome}"
