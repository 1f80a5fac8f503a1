"""What the verbs print: lines for people, JSON for programs."""

import array
import json
import math
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from mauve_rt.cli.plain_output import beneath, plain
from mauve_rt.cli.verb import OK, REFUSED
from mauve_rt.counts import duration

if TYPE_CHECKING:  # rich takes its time to load, and JSON or a line of text have no use for it
    from rich.console import Console
    from rich.text import Text

_WIDE = 160
_WORTH_TELLING_NS = 1_000  # some steps prepare nothing


def as_plain(message: Any) -> Any:
    """A ROS message as values that JSON has."""
    if hasattr(message, "get_fields_and_field_types"):
        return {name: as_plain(getattr(message, name)) for name in message.get_fields_and_field_types()}
    if isinstance(message, float) and not math.isfinite(message):
        return None  # JSON has no word for it
    if isinstance(message, bytes):
        return list(message)
    if isinstance(message, array.array) or hasattr(message, "tolist"):
        return message.tolist()
    if isinstance(message, Sequence) and not isinstance(message, str):
        return [as_plain(item) for item in message]
    return message


def print_json(value: Any) -> None:
    """Indented JSON on stdout."""
    text = json.dumps(as_plain(value), indent=2, ensure_ascii=False)
    print(text if plain(text) == text else json.dumps(as_plain(value), indent=2))


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

    return OurConsole(file=beneath(sys.stdout), highlight=False, width=None if sys.stdout.isatty() else _WIDE)


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


def event_line(event: Any) -> str:
    """One line about a ReconfigurationEvent."""
    outcome = (
        f"done, revision {event.revision}" if event.success else f"refused ({event.code}): {event.message}"
    )
    who = f" by {event.requested_by}" if event.requested_by else ""
    why = f" because {event.cause}" if event.cause else ""
    stamp = f"{event.stamp.sec}.{event.stamp.nanosec // 1_000_000:03d}"
    return f"{stamp} {event.request}{who}{why}: {outcome}"
