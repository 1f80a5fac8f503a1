"""Redraws Fig. 3, 5 and 6 of the paper from runs on this machine: `scripts/figures`."""

import argparse
import os
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from mauve_examples.figures.drawings import draw_deployment, draw_reconfiguration, draw_without_barrier
from mauve_examples.figures.page import Runs, write_page
from mauve_examples.figures.runs import (
    plugin_registry,
    run_deployment,
    run_reconfiguration,
    run_without_barrier,
)
from mauve_rt.errors import MauveError, one_line
from mauve_rt.trace import TraceError

_OK, _FAILED = 0, 2


def main(arguments: Sequence[str] | None = None) -> int:
    """Run, draw, tell which files were written; returns the exit status."""
    args = _parser().parse_args(arguments)
    try:
        args.out.mkdir(parents=True, exist_ok=True)
        if args.bags is not None:
            args.bags.mkdir(parents=True, exist_ok=True)
            runs = _run(args.bags, args.cpu)
        else:
            with tempfile.TemporaryDirectory(prefix="mauve_figures_") as folder:
                runs = _run(Path(folder), args.cpu)
        for path in _draw(args.out, runs):
            print(path)
    except (MauveError, TraceError, OSError) as error:
        print(f"figures: {one_line(str(error))}", file=sys.stderr)
        return _FAILED
    if runs.deployment.policy != "SCHED_FIFO":
        print(
            f"figures: without real-time rights; the tasks ran under {runs.deployment.policy}",
            file=sys.stderr,
        )
    return _OK


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="figures", description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("figures"), metavar="DIR", help="(default: figures)")
    parser.add_argument("--bags", type=Path, metavar="DIR", help="keep the recorded bags here")
    last = max(os.sched_getaffinity(0))
    parser.add_argument(
        "--cpu", type=int, default=last, metavar="N", help=f"run the tasks on it (default: {last})"
    )
    return parser


def _run(bags: Path, cpu: int) -> Runs:
    registry = plugin_registry()
    runs = Runs(
        without_barrier=run_without_barrier(registry, bags / "figure3", cpu),
        deployment=run_deployment(registry, bags / "figure5", cpu),
        reconfiguration=run_reconfiguration(registry, bags / "figure6", cpu),
    )
    for run in (runs.without_barrier, runs.deployment, runs.reconfiguration):
        if run.trace.lost:
            raise TraceError(f"{run.trace.lost} trace records were lost: nothing is drawn; run it again")
    return runs


def _draw(out: Path, runs: Runs) -> list[Path]:
    paths = [out / f"figure{number}.svg" for number in (3, 5, 6)] + [out / "figures.md"]
    draw_without_barrier(runs.without_barrier).save(paths[0])
    draw_deployment(runs.deployment).save(paths[1])
    draw_reconfiguration(runs.reconfiguration).save(paths[2])
    write_page(paths[3], runs)
    return paths


if __name__ == "__main__":
    sys.exit(main())
