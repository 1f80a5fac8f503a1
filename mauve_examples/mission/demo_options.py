"""What the demo can be told on its command line, checked."""

import argparse
import math
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import NoReturn

from mauve_examples.mission.architecture import map_file
from mauve_examples.mission.demo_errors import BadInputError

DESCRIPTION = """Robots explore a building together, lose their radio link, swap their exploration algorithm
while they run, carry on alone, and swap back when the link returns. Exit status: 0 success, 1 failure,
2 bad input, 130 interrupted."""
MAX_ROBOTS = 16
LINK_LOSS_AT_S = 20.0
LINK_BACK_AT_S = 45.0
DURATION_S = 90.0
STEADY_S = 3.0  # how long the link must be back before a supervisor swaps back


@dataclass(frozen=True, kw_only=True)
class Options:
    """A mission to run. Times in seconds of mission time, which begins when the robots do."""

    map_file: Path
    robots: int
    duration_s: float
    link_loss_at_s: float | None  # None: the link stays
    link_back_at_s: float | None
    supervisor: bool
    drop_share: float
    seed: int
    simulated_time: bool
    hosts: bool  # each robot on a machine of its own, a real link between them
    out: Path

    @property
    def names(self) -> list[str]:
        """The robots' names, which are their namespaces too."""
        return [f"robot_{number}" for number in range(1, self.robots + 1)]


def parse_options(arguments: list[str]) -> Options:
    """Read and check the command line.

    Raises:
        BadInputError: an unknown option, a value out of its range, times that contradict one another.
        SystemExit: --help.
    """
    given = _parser().parse_args(arguments)
    if not 1 <= given.robots <= MAX_ROBOTS:
        raise BadInputError(f"--robots {given.robots}: expected 1 to {MAX_ROBOTS}")
    if not 0.0 <= given.drop_share <= 1.0:
        raise BadInputError(f"--drop-share {given.drop_share:g}: expected a share from 0 to 1")
    if not 0 <= given.seed < 2**31:
        raise BadInputError(f"--seed {given.seed}: expected a number from 0 to {2**31 - 1}")
    _check_hosts(given)
    loss_s, back_s = _link_times(given)
    return Options(
        map_file=map_file(given.map),
        robots=given.robots,
        duration_s=given.duration,
        link_loss_at_s=loss_s,
        link_back_at_s=back_s,
        supervisor=not given.no_supervisor and given.robots > 1,
        drop_share=given.drop_share,
        seed=given.seed,
        simulated_time=given.simulated_time,
        hosts=given.hosts,
        out=_out_folder(given.out),
    )


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        """One line instead of the usage and a line."""
        raise BadInputError(f"{message} (see --help)")


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(prog="demo", allow_abbrev=False, description=DESCRIPTION)
    add = parser.add_argument
    add("--map", metavar="FILE.yaml", default="office", help="map-server map (default: the project's office)")
    add("--robots", metavar="N", type=int, default=2, help="how many (default: %(default)s)")
    add("--duration", metavar="S", type=_seconds, default=DURATION_S, help="at most (default: %(default)g)")
    add("--link-loss-at", metavar="S", type=_seconds, help=f"the link is lost (default: {LINK_LOSS_AT_S:g})")
    add("--link-back-at", metavar="S", type=_seconds, help=f"it is back (default: {LINK_BACK_AT_S:g})")
    add("--no-supervisor", action="store_true", help="nobody swaps anything: the robots stall")
    add("--drop-share", metavar="P", type=float, default=0.0, help="share of messages lost (default: 0)")
    add("--seed", metavar="K", type=int, default=1, help="of starts and losses (default: %(default)s)")
    add(
        "--simulated-time",
        action="store_true",
        help="no threads, no ROS graph, no real time: as fast as it goes; equal seeds give equal traces",
    )
    add(
        "--hosts",
        action="store_true",
        help="each robot on a machine of its own, of Linux namespaces (as root): their link is cut for real",
    )
    add("--out", metavar="DIR", help="results (default: out/mission_DATE_TIME in the current folder)")
    return parser


def _seconds(text: str) -> float:
    value = float(text)
    if not math.isfinite(value) or value < 0.0:
        raise argparse.ArgumentTypeError(f"expected seconds, 0 or more, found {text!r}")
    return value


def _check_hosts(given: argparse.Namespace) -> None:
    if not given.hosts:
        return
    if given.robots != 2:  # noqa: PLR2004 - who hears one topic hears one peer
        raise BadInputError(f"--hosts --robots {given.robots}: expected 2, one at each end of the link")
    for option, is_given in (("simulated-time", given.simulated_time), ("drop-share", given.drop_share)):
        if is_given:
            raise BadInputError(f"--hosts: leave out --{option}: the link is a real one")


def _link_times(given: argparse.Namespace) -> tuple[float | None, float | None]:
    if given.duration <= 0.0:
        raise BadInputError("--duration 0: expected more than 0 s")
    if given.robots == 1:
        if given.link_loss_at is not None or given.link_back_at is not None:
            raise BadInputError("--robots 1: no link to lose; leave out --link-loss-at and --link-back-at")
        return None, None
    loss_s = LINK_LOSS_AT_S if given.link_loss_at is None else given.link_loss_at
    back_s = LINK_BACK_AT_S if given.link_back_at is None else given.link_back_at
    if back_s <= loss_s:
        raise BadInputError(f"the link would be back at {back_s:g} s, not after its loss at {loss_s:g} s")
    if loss_s >= given.duration:
        raise BadInputError(f"the link would be lost at {loss_s:g} s, after the end at {given.duration:g} s")
    if back_s + STEADY_S >= given.duration:
        raise BadInputError(
            f"the link would be back at {back_s:g} s and the swap back {STEADY_S:g} s later, after the end "
            f"at {given.duration:g} s; set --link-loss-at and --link-back-at, or a longer --duration"
        )
    return loss_s, back_s


def _out_folder(text: str | None) -> Path:
    if text is None:
        return Path("out", f"mission_{datetime.now().astimezone():%Y-%m-%d_%H-%M-%S}").absolute()
    out = Path(text).absolute()
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise BadInputError(f"--out {text}: exists and is not an empty folder")
    return out
