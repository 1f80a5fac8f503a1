"""Run the benchmarks; prints a Markdown table.

Started by scripts/bench, which builds what is missing. Figures are medians over interleaved rounds, each of
which runs what is measured and its reference next to each other; a verdict is given where the whole 95 %
interval is on one side of the target.
"""

import argparse
import json
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import machine
from analysis import analysis_rows
from command import command_rows
from document import PAGE, figures_of, write_docs
from echo import echo_rows, watch_rows
from large_messages import large_message_rows
from links import links_rows
from listeners import last_message_rows
from micro import (
    activation_rows,
    inversion_rows,
    latest_value_rows,
    ring_buffer_rows,
    shadow_rows,
    shared_data_rows,
    trace_rows,
    transform_lookup_rows,
)
from mission import mission_rows
from native import BenchmarkError
from proof import proof_rows
from reading import reading_rows
from reconfiguration import (
    deployment_rows,
    prefault_rows,
    restart_rows,
    stop_beside_rows,
    stop_rows,
    swap_rows,
)
from recording import recording_rows
from recording_kept import kept_rows
from recording_killed import kill_rows
from recording_topics import recording_topics_rows
from reload import reload_rows
from report_large import report_large_rows
from rows import Row, markdown, not_available
from rules import rule_rows
from safe_stop import safe_stop_rows
from save import save_rows
from scale import idle_rows, scale_rows, simulation_rows
from service_calls import service_blackout_rows, service_rows, service_stop_rows
from settings import FULL, QUICK, Settings
from start import start_rows
from topics import topic_rows
from transactions import refused_rows, soak_rows, transaction_rows
from wakeup import wakeup_rows
from wakeup_executor import executor_wakeup_rows

BENCHMARKS: dict[str, Callable[[Settings], Iterator[Row]]] = {
    "wakeup": wakeup_rows,
    "watch": watch_rows,
    "executor-wakeup": executor_wakeup_rows,
    "echo": echo_rows,
    "deployment": deployment_rows,
    "restart": restart_rows,
    "stop": stop_rows,
    "stop-beside": stop_beside_rows,
    "swap": swap_rows,
    "reload": reload_rows,
    "save": save_rows,
    "prefault": prefault_rows,
    "transaction": transaction_rows,
    "refused": refused_rows,
    "rule-reaction": rule_rows,
    "shared-data": shared_data_rows,
    "ring-buffer": ring_buffer_rows,
    "latest-value": latest_value_rows,
    "transform-lookup": transform_lookup_rows,
    "activation": activation_rows,
    "trace": trace_rows,
    "shadow": shadow_rows,
    "inversion": inversion_rows,
    "scale": scale_rows,
    "idle": idle_rows,
    "simulation": simulation_rows,
    "safe-stop": safe_stop_rows,
    "last-message": last_message_rows,
    "soak": soak_rows,
    "service": service_rows,
    "service-blackout": service_blackout_rows,
    "service-stop": service_stop_rows,
    "topics": topic_rows,
    "large-messages": large_message_rows,
    "start": start_rows,
    "command": command_rows,
    "recording": recording_rows,
    "recording-killed": kill_rows,
    "recording-kept": kept_rows,
    "recording-topics": recording_topics_rows,
    "reading": reading_rows,
    "report-large": report_large_rows,
    "analysis": analysis_rows,
    "proof": proof_rows,
    "mission": mission_rows,
    "links": links_rows,
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Return the exit status: 1 where something could not be measured, or by --gate missed its target."""
    parser = _parser()
    given = parser.parse_args(arguments)
    if given.rounds is not None and given.rounds < 1:
        parser.error(f"--rounds: expected at least 1, found {given.rounds}")
    if given.json is not None and not given.json.parent.is_dir():
        parser.error(f"--json: there is no folder {given.json.parent}")
    if given.write_docs and given.only:
        parser.error("--write-docs: the figures are those of one run of all benchmarks; leave out --only")
    if given.write_docs:
        try:
            figures_of(PAGE.read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            parser.error(f"--write-docs: {error}")
    settings = FULL if given.full else QUICK
    if given.rounds is not None:
        settings = replace(settings, rounds=given.rounds)
    described, steal = machine.describe(), machine.StealMeter()
    rows, complete = _measure(given.only or list(BENCHMARKS), settings)
    print(markdown(rows))
    print(f"\n{described.line()}")
    steal_percent = steal.percent()
    print(f"{settings.mode}, {settings.rounds} rounds; steal time {steal_percent:.2f} %")
    result = {
        "mode": settings.mode,
        "machine": described.as_json(),
        "machine_line": described.line(),
        "steal_percent": steal_percent,
        "rows": [row.as_json() for row in rows],
    }
    if given.json is not None:
        given.json.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    if given.write_docs:
        told = f"`scripts/bench --{settings.mode}`, steal time {steal_percent:.2f} %"
        write_docs(rows, f"{described.line()}; {told}.")
    missed = [row for row in rows if row.verdict == "missed"] if given.gate else []
    for row in missed:
        sys.stderr.write(
            f"bench: missed: {row.what}: expected {row.target}, found {row.measured:g} {row.unit}\n"
        )
    return 0 if complete and not missed else 1


def _measure(names: Sequence[str], settings: Settings) -> tuple[list[Row], bool]:
    rows: list[Row] = []
    complete = True
    for name in names:
        began_s = time.monotonic()
        sys.stderr.write(f"bench: {name} ... ")
        sys.stderr.flush()
        try:
            rows += BENCHMARKS[name](settings)
        except BenchmarkError as error:
            complete = False
            rows.append(not_available(name, " ".join(str(error).split())))
        sys.stderr.write(f"{time.monotonic() - began_s:.0f} s\n")
    return rows, complete


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="scripts/bench", description=__doc__)
    amount = parser.add_mutually_exclusive_group()
    amount.add_argument("--quick", action="store_true", help="about 20 minutes (the default)")
    amount.add_argument("--full", action="store_true", help="about 30 minutes")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the rows, with every round, to FILE")
    parser.add_argument(
        "--only", action="append", choices=BENCHMARKS, help="only this one; may be given again"
    )
    parser.add_argument(
        "--gate",
        action="store_true",
        help="exit with 1 where a count that must be zero is not, or a whole interval is beyond its target",
    )
    parser.add_argument(
        "--write-docs", action="store_true", help="write the figures into docs/concepts/performance.md"
    )
    parser.add_argument("--rounds", type=int, help="another number of rounds; fewer than 10 decide nothing")
    return parser


if __name__ == "__main__":
    sys.exit(main())
