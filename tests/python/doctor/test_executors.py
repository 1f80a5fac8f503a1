"""What `mauve doctor NODE` finds in an executor's own reply."""

from typing import Any

from mauve_msgs.msg import ComponentInfo, RealtimeStatus
from mauve_msgs.srv import ListComponents
from mauve_rt.doctor.executors import (
    describe_executor,
    describe_found,
    describe_not_asked,
    describe_unreached,
)
from mauve_rt.doctor.finding import Status

DENIED = "SCHED_FIFO priority 80 (the rtprio limit is 0): components can be late"


def found(
    *, missing: tuple[str, ...] = (), here: tuple[str, ...] = (), **component: Any
) -> list[tuple[Status, str]]:
    fields = {"name": "control", "policy": "SCHED_FIFO", "state": ComponentInfo.RUNNING} | component
    reply = ListComponents.Response(
        revision=7,
        components=[ComponentInfo(**fields)],
        realtime=RealtimeStatus(granted=not missing, missing=list(missing)),
    )
    findings = list(describe_executor(reply, here))
    assert all(each.cost and each.remedy for each in findings if each.status != Status.OK)
    return [(each.status, each.found) for each in findings]


def test_an_executor_that_suits_has_one_line() -> None:
    assert found() == [(Status.OK, "1 component, revision 7, all real-time rights")]


def test_rights_as_the_executor_runs() -> None:
    denied, last = found(missing=(DENIED,), here=(DENIED,), policy="SCHED_OTHER")
    assert denied == (Status.WARNING, DENIED)
    assert last[1].endswith("not all real-time rights")


def test_rights_that_differ_from_this_shell() -> None:
    words = "the executor has {} real-time rights than this shell"
    assert (Status.WARNING, words.format("more")) in found(here=(DENIED,))
    assert (Status.WARNING, words.format("fewer")) in found(missing=(DENIED,))


def test_components_that_are_late_faulted_or_no_longer_real_time() -> None:
    assert (Status.WARNING, "overruns: control 3 of 1,000") in found(overruns=3, releases=1000)
    assert (Status.WARNING, "faulted: control") in found(state=ComponentInfo.FAULTED)
    assert (Status.WARNING, "not SCHED_FIFO: control") in found(policy="SCHED_OTHER")


def test_executors_that_answer_or_do_not() -> None:
    assert [each.found for each in describe_found(["/a", "/b"])] == ["/a, /b"]
    assert [each.found for each in describe_found([])] == ["none"]
    assert describe_not_asked(None).status == Status.WARNING
    assert describe_not_asked("/a").status == Status.ERROR
    assert describe_unreached("no executor /a").status == Status.ERROR
