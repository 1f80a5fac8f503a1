"""Two robots and a real link between them: what befalls it, and what their supervisors do about it.

Each group of scenarios has a pair of robots of its own, on machines of their own but for the kernel; the
groups run at once, in threads, since they mostly wait. Asserted are order, counts and lower bounds.
"""

import threading
from collections.abc import Iterator
from concurrent.futures import Future

import pytest
from needed_hosts import hosts_or_skip
from robots import SILENCE_S, UNDO_S, Pair
from scenarios import ACTING, GROUPS, Outcome, Scenario, acted_as_expected, is_calm

from mauve_examples.mission.hosts import Hosts, HostsError

LATE_S = 0.05  # a log's stamp is of after the decision, the cause's of after the cut


def _play(pair: Pair, group: dict[str, Scenario], outcomes: dict[str, Future[Outcome]]) -> None:
    failed: BaseException | None = None
    for name, scenario in group.items():
        if failed is not None:
            outcomes[name].set_exception(AssertionError(f"not tried: one before it failed: {failed}"))
            continue
        try:
            outcomes[name].set_result(scenario(pair))
        except BaseException as error:  # noqa: BLE001 - for whoever asks
            if not isinstance(error, HostsError):  # no program for it: nothing was begun
                failed = error
            outcomes[name].set_exception(error)


@pytest.fixture(scope="module")
def outcomes(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, Future[Outcome]]]:
    """What came of each scenario, as soon as it is over."""
    with hosts_or_skip():
        Hosts([]).close()
    futures: dict[str, Future[Outcome]] = {name: Future() for group in GROUPS for name in group}
    pairs = [Pair(tmp_path_factory.mktemp("pair")) for _ in GROUPS]
    threads = [
        threading.Thread(target=_play, args=(pair, group, futures))
        for pair, group in zip(pairs, GROUPS, strict=True)
    ]
    for thread in threads:
        thread.start()
    yield futures
    for thread in threads:
        thread.join()
    for pair in pairs:
        pair.close()


def outcome_of(outcomes: dict[str, Future[Outcome]], name: str) -> Outcome:
    try:
        return outcomes[name].result()
    except HostsError as error:  # nftables may be missing
        pytest.skip(str(error))


@pytest.mark.parametrize("name", ACTING)
def test_who_hears_nothing_acts_once_and_comes_back(outcomes: dict[str, Future[Outcome]], name: str) -> None:
    outcome = outcome_of(outcomes, name)
    assert acted_as_expected(name, outcome), outcome.told
    for robot in ACTING[name]:
        decided = [outcome.instants(robot, what) for what in ("do", "undo")]
        assert list(map(len, decided)) == [1, 1], outcome.told
        [done], [undone] = decided
        # The last message came at most its period of 0.1 s before the cause.
        assert done - outcome.began_s > SILENCE_S - 0.1 - LATE_S
        assert undone - outcome.mended_s > UNDO_S - LATE_S
        assert undone - done >= UNDO_S


def test_a_flapping_link_swaps_no_more_often_than_the_cooldown_lets_it(
    outcomes: dict[str, Future[Outcome]],
) -> None:
    outcome = outcome_of(outcomes, "flapping")
    assert is_calm(outcome), outcome.told
