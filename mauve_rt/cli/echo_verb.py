"""`mauve echo NODE RESOURCE|COMPONENT.PORT`: values of an executor, polled while it runs."""

import argparse
import csv
import json
import sys
import time
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from mauve_rt.cli.arguments import add_executor, add_value, positive_rate
from mauve_rt.cli.verb import OK, REFUSED
from mauve_rt.errors import MauveError

_DEFAULT_HZ = 10.0
_MOST_HZ = 200.0  # a poll takes a millisecond
_MOST_ELEMENTS = 1000  # a list that people read; --csv has all of each
_CSV_HEAD = ("time_ns", "monotonic_ns", "age_ns", "writes")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Of `mauve echo`."""
    add_executor(parser)
    add_value(parser, "a resource, or COMPONENT.PORT of a read or write port")
    parser.add_argument(
        "--field", metavar="F", default="", help="show one field of it, such as position.x or ranges[3]"
    )
    parser.add_argument(
        "--rate",
        type=positive_rate(_MOST_HZ),
        default=_DEFAULT_HZ,
        metavar="HZ",
        help=f"polls a second (default {_DEFAULT_HZ:g}, at most {_MOST_HZ:g})",
    )
    parser.add_argument("--once", action="store_true", help="show the present value, and end")
    parser.add_argument(
        "--csv", action="store_true", help="a line for each poll, with a column for each field"
    )


def main(args: argparse.Namespace) -> int:
    """Show values until Ctrl-C. 1: there is no such value, or with --once none was written yet."""
    shown = _Csv(args.field) if args.csv else _Text(args.field)
    if not args.once:
        told = f"polled {args.rate:g} times a second: writes between two polls are counted, not shown"
        print(f"{args.value}: {told}", file=sys.stderr)
    before: Sample | None = None
    try:
        for sample in polled(args.executor, args.value, rate_hz=args.rate):
            if args.once and not sample.writes:
                print(f"{args.value} ({sample.type}): nothing was written yet", file=sys.stderr)
                return REFUSED
            shown.show(sample, before)
            sys.stdout.flush()
            if args.once:
                break
            before = sample
    except NoValueError as error:
        print(f"refused: {error}", file=sys.stderr)
        return REFUSED
    except KeyboardInterrupt:
        pass
    return OK


class NoValueError(MauveError):
    """The executor has no value of this name, or no field of it."""


class Sample(NamedTuple):
    """A value as one poll found it."""

    type: str
    message: Any
    """Decoded: its attributes are the fields."""
    writes: int
    """Since the start, this one included; 0: none yet, and the message is the type's default."""
    stamp_ns: int
    """When it was written: CLOCK_REALTIME."""
    monotonic_ns: int
    age_ns: int

    def skipped(self, before: "Sample | None") -> int:
        """Writes between the sample before and this one, which no poll found."""
        return 0 if before is None else max(self.writes - before.writes - 1, 0)


def polled(executor: str, name: str, *, rate_hz: float) -> Iterator[Sample]:
    """The value of a resource or port, again and again.

    Raises:
        NoValueError: there is none; the executor's reason.
        NoExecutorError: no executor answers.
    """
    from mauve_msgs.srv import ReadValues  # noqa: PLC0415 - ROS takes its time to load
    from mauve_rt.cli.client import connected  # noqa: PLC0415
    from mauve_rt.trace.format.message_decoding import Decoder  # noqa: PLC0415

    decoders: dict[str, Decoder] = {}
    with connected(first=True) as client:
        due_s = time.monotonic()
        while True:
            request = ReadValues.Request(names=[name], with_definitions=not decoders)
            (value,) = client.call(ReadValues, f"{executor}/read_values", request).values
            if value.problem:
                raise NoValueError(value.problem)
            if value.type not in decoders:  # the first, or the resource was replaced by one of another type
                if not value.definition:
                    decoders.clear()
                    continue
                decoders[value.type] = Decoder(value.type, value.definition)
            yield Sample(
                type=value.type,
                message=decoders[value.type].decode(bytes(value.data)),
                writes=value.writes,
                stamp_ns=value.stamp.sec * 1_000_000_000 + value.stamp.nanosec,
                monotonic_ns=value.time_ns,
                age_ns=value.age_ns,
            )
            due_s = max(due_s + 1 / rate_hz, time.monotonic())
            client.sleep_until(due_s)


def _fields(sample: Sample, field: str) -> Mapping[str, Any]:
    """What is shown of a sample, by name."""
    from mauve_rt.fields import field_at, flat_fields  # noqa: PLC0415

    if not field:
        return dict(flat_fields(sample.message))
    try:
        return dict(flat_fields(field_at(sample.message, field), field))
    except ValueError as error:
        raise NoValueError(f"{error} (of {sample.type})") from None


class _Text:
    """For people: a block for each new value; of an old one once that it is old."""

    def __init__(self, field: str) -> None:
        self._field = field
        self._told_old = False

    def show(self, sample: Sample, before: Sample | None) -> None:
        from mauve_rt.cli.views import clock_text  # noqa: PLC0415
        from mauve_rt.counts import duration  # noqa: PLC0415

        fields = _fields(sample, self._field)  # first: a bad --field is reported at once
        is_new = bool(sample.writes) and (before is None or before.writes != sample.writes)
        if not is_new:
            if not self._told_old:
                age = f", age {duration(sample.age_ns)}" if sample.writes else ""
                print(f"old{age}" if sample.writes else "nothing was written yet")
            self._told_old = True
            return
        self._told_old = False
        skipped = sample.skipped(before)
        between = f", {skipped} writes since the last poll are not shown" if skipped else ""
        age = "0 ns" if sample.age_ns == 0 else duration(sample.age_ns)
        print(f"{clock_text(sample.stamp_ns)} new, age {age}, write {sample.writes}{between}")
        for name, value in fields.items():
            is_long = isinstance(value, list) and len(value) > _MOST_ELEMENTS
            print(f"  {name}: {f'{len(value):,} elements' if is_long else value_text(value)}")


class _Csv:
    """For programs: a line for each poll."""

    def __init__(self, field: str) -> None:
        self._field = field
        self._writer = csv.writer(sys.stdout, lineterminator="\n")
        self._names: list[str] = []

    def show(self, sample: Sample, _before: Sample | None) -> None:
        fields = _fields(sample, self._field)
        if not self._names:
            self._names = list(fields)
            self._writer.writerow([*_CSV_HEAD, *self._names])
        values = [value_text(fields.get(name, "")) for name in self._names]
        self._writer.writerow([sample.stamp_ns, sample.monotonic_ns, sample.age_ns, sample.writes, *values])


def value_text(value: Any) -> str:
    """Text of others without control characters; numbers as they are, lists in JSON."""
    if isinstance(value, list | dict | bool):
        return json.dumps(value, ensure_ascii=False)
    if not isinstance(value, str):
        return str(value)
    return "".join(letter if letter.isprintable() else ascii(letter)[1:-1] for letter in value)
