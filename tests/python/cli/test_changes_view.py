"""`mauve changes` for people, and the messages that it is made from."""

from types import SimpleNamespace

import pytest

from mauve_msgs.msg import LateComponent, OpenChange
from mauve_msgs.srv import ListChanges
from mauve_rt.cli.changes_verb import change_lines
from mauve_rt.control.open_changes import long_ones
from mauve_rt.interfaces.changes import PHASES, open_change_message

NODE = "/robot_1/executor"
SECOND = 1_000_000_000
LATE = SimpleNamespace(name="arm", state="Move", state_age_ns=3_200_000_000, waiting=False, left_behind=False)


def test_no_open_change_is_said() -> None:
    assert list(change_lines(ListChanges.Response(), NODE)) == ["no open change"]


def test_a_change_its_late_components_and_the_way_out_are_told() -> None:
    arm = LateComponent(name="arm", state="Move", state_age_ns=3_200_000_000)
    gone = LateComponent(name="gone", state="Grip", state_age_ns=5 * SECOND, left_behind=True)
    made = OpenChange(
        author="rule slow_arm",
        steps=["start a", "stop b"],
        age_ns=4 * SECOND,
        phase=OpenChange.MADE,
        late=[arm, gone],
    )
    preparing = OpenChange(
        steps=["replace_core d my/Pid"],
        age_ns=3 * SECOND,
        phase=OpenChange.PREPARING,
        hook="configure of core my/Pid",
        hook_age_ns=2 * SECOND,
    )
    waiting = OpenChange(
        steps=["stop c"], age_ns=SECOND, phase=OpenChange.WAITING, late=[LateComponent(name="c")]
    )
    assert list(change_lines(ListChanges.Response(changes=[made, waiting, preparing]), NODE)) == [
        "made, begun 4 s ago by rule slow_arm: start a; stop b",
        "  late: arm has not taken the change, in state Move for 3.2 s",
        (
            "  late: gone has not taken the change, in state Grip for 5 s, "
            "left behind: its thread still executes"
        ),
        "waiting, begun 1 s ago: stop c",
        "  late: c has not agreed to the change, in no state",
        "preparing, begun 3 s ago: replace_core d my/Pid, in configure of core my/Pid for 2 s",
        f"to end it: mauve changes {NODE} --abandon arm",
        f"to end it: mauve changes {NODE} --abandon c",
    ]


def test_a_cleanup_that_lasts_is_told() -> None:
    reply = ListChanges.Response(cleanup="cleanup of parts of component 'arm'", cleanup_age_ns=2 * SECOND)
    assert list(change_lines(reply, NODE)) == [
        "cleanup of parts of component 'arm', for 2 s",
        "no open change",
    ]


@pytest.mark.parametrize("phase", PHASES.values())
def test_a_change_of_the_kernel_becomes_a_message(phase: str) -> None:
    facts = SimpleNamespace(
        author="mauve",
        steps=["stop arm"],
        begun_ns=5,
        phase=phase,
        instant_ns=7,
        hook="",
        hook_age_ns=0,
        late=[LATE],
    )
    message = open_change_message(facts, 9)  # type: ignore[arg-type]
    assert (PHASES[message.phase], message.author, message.age_ns, message.instant_ns) == (
        phase,
        "mauve",
        4,
        7,
    )
    assert message.late == [LateComponent(name="arm", state="Move", state_age_ns=3_200_000_000)]


def test_only_a_change_that_is_open_for_long_is_told_in_diagnostics() -> None:
    change = SimpleNamespace(author="rule r", phase="made", begun_ns=10 * SECOND, late=[LATE])
    assert list(long_ones([change], 11 * SECOND)) == []  # type: ignore[list-item]
    assert list(long_ones([change], 12 * SECOND)) == [  # type: ignore[list-item]
        "late: arm has not taken the change of rule r, in state Move for 3.2 s"
    ]
    hangs = SimpleNamespace(
        author="",
        phase="preparing",
        begun_ns=0,
        late=[],
        hook="configure of core my/Pid",
        hook_age_ns=2 * SECOND,
    )
    assert list(long_ones([hangs], 2 * SECOND)) == [  # type: ignore[list-item]
        "the change is preparing, in configure of core my/Pid for 2 s"
    ]
