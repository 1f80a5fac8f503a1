"""An executor's own rule of a link's silence, and a link that is bad in every way: only a cut is silence.

A talker of 10 Hz, a limit of 1 s, reliable delivery, which stands still for up to a second while it repairs.
The link is a program of the test's, since netem and nftables may be missing. Asserted are order and counts.
"""

import signal
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from listener import Listener, Talker
from lossy_cable import LossyCable
from needed_hosts import hosts_or_skip

from mauve_examples.mission.hosts import Hosts

PERIOD_S, LIMIT_S, UNDO_S = 0.1, 1.0, 0.5
EACH_S = 2.5
_RANGE = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}
BAD: dict[str, dict[str, Any]] = {
    "perfect": {},
    "5 % lost": {"loss": 0.05},
    "10 % lost": {"loss": 0.1},
    "30 % lost": {"loss": 0.3},
    "delay": {"delay_s": 0.2},
    "jitter": {"delay_s": 0.02, "jitter_s": 0.2},  # reorders, too
    "reordering": {"swap": 0.3},
    "duplication": {"duplicate": 0.5},
}


class Link:
    """A talker on one machine, an executor that minds it on another, and the cable between them."""

    def __init__(self, folder: Path) -> None:
        """Start all of them.

        Raises:
            HostsError: no such machines can be made here.
        """
        self.hosts = Hosts(["robot_1", "robot_2"])
        self.cable = LossyCable(self.hosts)
        self.talker = Talker(PERIOD_S, wrapper=self.hosts.wrapper("robot_2"), environment=_RANGE)
        self.listener = Listener(
            folder,
            limit_s=LIMIT_S,
            undo_s=UNDO_S,
            kind="link_silence",
            wrapper=self.hosts.wrapper("robot_1"),
            environment=_RANGE,
        )

    def calm(self) -> None:
        """Let all come back to rest."""
        self.cable.set()
        self.listener.until(self.listener.is_usual, "the way back")

    def close(self) -> None:
        """End all of it."""
        self.listener.close()
        self.talker.signal(signal.SIGKILL)
        self.cable.close()
        self.hosts.close()


@pytest.fixture(scope="module")
def link(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Link]:
    with hosts_or_skip():
        made = Link(tmp_path_factory.mktemp("link"))
    made.listener.until(lambda: "armed" in made.listener.decisions(), "the rule to be armed")
    time.sleep(LIMIT_S)  # who does not hear the talker yet acts by then
    made.calm()
    yield made
    made.close()


@pytest.mark.parametrize("name", BAD)
def test_a_bad_link_is_no_silence(link: Link, name: str) -> None:
    before = link.listener.alarms()
    link.cable.set(**BAD[name])
    time.sleep(EACH_S)
    link.calm()
    assert link.listener.alarms() == before, link.listener.executor.output


def _acts_once(link: Link, before: int) -> None:
    link.listener.until(lambda: link.listener.alarms() == before + 1, "silence")
    link.listener.until(lambda: link.listener.decisions()[-1] == "done", "the swap")


def test_a_cut_is_silence_until_it_is_mended(link: Link) -> None:
    before = link.listener.alarms()
    link.cable.set(up=False)
    _acts_once(link, before)
    link.calm()
    assert link.listener.alarms() == before + 1


def test_a_flapping_link_that_is_never_down_for_long_is_no_silence(link: Link) -> None:
    before = link.listener.alarms()
    for up in (False, True) * 4:
        link.cable.set(up=up)
        time.sleep(0.3)
    link.calm()
    assert link.listener.alarms() == before, link.listener.executor.output


def test_a_frozen_talker_is_silent_until_it_is_thawed(link: Link) -> None:
    before = link.listener.alarms()
    link.talker.signal(signal.SIGSTOP)
    _acts_once(link, before)
    link.talker.signal(signal.SIGCONT)
    link.calm()


def test_a_killed_talker_is_silent_until_it_is_started_anew(link: Link) -> None:
    before = link.listener.alarms()
    link.talker.signal(signal.SIGKILL)
    _acts_once(link, before)
    link.talker.start()
    link.calm()
    assert link.listener.alarms() == before + 1
