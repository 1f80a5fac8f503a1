"""What befalls a real link between two robots, again and again: do they see it, act once, and come back?"""

import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from native import BenchmarkError
from rows import Row, alone
from settings import Settings

from mauve_examples.mission.hosts import HostsError

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "ros" / "links"))

from robots import SILENCE_S, Pair
from scenarios import ACTING, GROUPS, Outcome, acted_as_expected, is_calm

DECLARED_S = SILENCE_S + 0.1  # from the cause to the decision: the last message came up to a period before it


def links_rows(settings: Settings) -> Iterator[Row]:
    """Each scenario `rounds` times; the groups of scenarios at once, each on machines of its own."""
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(len(GROUPS)) as pool:
        runs = [pool.submit(_play, index, settings.rounds, Path(folder)) for index in range(len(GROUPS))]
        for run in runs:
            try:
                outcomes = run.result()
            except HostsError as error:
                raise BenchmarkError(str(error)) from None
            for name in outcomes:
                if name != "begin":
                    yield _row(name, outcomes[name], settings.rounds)


def _play(index: int, rounds: int, folder: Path) -> dict[str, list[Outcome]]:
    """Each round with a new pair; what fails has no outcome, nor has what comes after it in its round."""
    outcomes: dict[str, list[Outcome]] = {name: [] for name in GROUPS[index]}
    for number in range(rounds):
        log = folder / f"{index}_{number}"
        log.mkdir()
        pair = Pair(log)
        try:
            for name, scenario in GROUPS[index].items():
                outcomes[name].append(scenario(pair))
        except AssertionError as error:
            sys.stderr.write(f"\nbench: links: {name}: {str(error).splitlines()[0]}\n")
        finally:
            pair.close()
    return outcomes


def _row(name: str, outcomes: list[Outcome], rounds: int) -> Row:
    acting = ACTING.get(name, ())
    well = sum(
        (is_calm(outcome) if name == "flapping" else acted_as_expected(name, outcome)) for outcome in outcomes
    )
    what = f"link: {name}"
    if not acting:
        note = f"no swap more than the cooldown lets in {well} of {rounds}" if name == "flapping" else ""
        calm = note or f"no robot acted in {well} of {rounds}"
        return Row(what=what, note=calm, verdict="met" if well == rounds else "missed")
    seen = [outcome.after_s(robot, "do") for outcome in outcomes for robot in acting]
    back = [outcome.after_s(robot, "undo") for outcome in outcomes for robot in acting]
    note = (
        f"acted once and came back in {well} of {rounds}, {min(back):.2f} to {max(back):.2f} s after its end"
    )
    limit = (
        None if name in ("never spoke", "down from the start") else DECLARED_S
    )  # from its start, not arming
    return alone(f"{what}, until seen", seen, unit="s", limit=limit, note=note)
